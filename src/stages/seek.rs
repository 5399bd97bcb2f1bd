//! Advances the conjugate gradients by one step along the direction of search, and sums the effect of the next on the
//! nodes.
//!
//! The unknowns are changes q of the pressures with c q + tr ∇u(q) = r, and likewise of the stresses' deviators. An
//! iteration is one pass over the particles and one over the nodes. The nodes keep the velocities of the direction of
//! search, so that the effect of the whole direction is gathered, not only that of the last answer (preconditioned
//! residual).

use super::Kernel;
use super::compliance::compliances;
use super::correction::{corrected, missed};
use super::g2p::{gather, tile};
use super::p2g::{Nodes, Tile, scatter_affine};
use super::solid::{LIQUID, VISCOPLASTIC};
use super::walls::{Walls, factors_beside};
use crate::bins::{NODES, origin};
use crate::cpu::blocks::BlockPressure;
use crate::cpu::constants::{Constants, MaterialConstants};
use crate::cpu::gradient::{Gradient, beside_of, mass_of, material_of, pressure_mut};
use crate::cpu::par;
use crate::cpu::solve::{Search, Shear, Solve};
use crate::cpu::state::{Block, CpuState};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel::Stencil;
use crate::math::linear::{add, dot};
use crate::math::real::{Lanes, Real};
use crate::math::symmetric::Symmetric;
use crate::math::wide::{Wide, Work, widely};
use std::ops::Range;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials).with_materials(),
        read(Slot::Position),
        write(Slot::Gradient),
        write(Slot::Search),
        read(Slot::Order),
        read(Slot::Chunks),
        read(Slot::Field),
        write(Slot::Force),
        write(Slot::Solve),
    ],
    over: Over::SolveChunks,
    source: include_str!("../../shaders/stages/seek.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool, last: bool) {
    if s.solve.active {
        step(s, first);
    } else if !last {
        return;
    }
    let scale = s.solve.force_scale(&s.constants, last);
    if last {
        admit(s);
    }
    let push = Push {
        position: &s.position,
        gradient: &s.gradient,
        search: &s.search,
        shear: &s.shear,
        materials: &s.materials,
        solve: s.solve,
        scale,
        last,
        corrects: s.features.corrects,
        sticks: s.features.sticks,
        walls: Walls::of(s),
    };
    let nodes = Nodes::<R> {
        blocks: &s.blocks,
        sources: &s.sources,
        masses: None,
        borders: false,
        tiles: &mut s.tiles,
        grid: &mut s.force,
    };
    nodes.sum(s.occupied, |tile, origin, particles| widely(&push, (tile, origin, particles)));
}

/// Adds the effect of the particles' stresses to the tile of their block.
struct Push<'a, R: Real> {
    position: &'a [[R; 4]],
    gradient: &'a [Gradient<R>],
    search: &'a [Search<R>],
    /// Empty where only pressures are unknown.
    shear: &'a [Shear<R>],
    materials: &'a [MaterialConstants<R>],
    solve: Solve<R>,
    scale: R,
    last: bool,
    corrects: bool,
    sticks: bool,
    walls: Walls<R>,
}

impl<R: Real> Work<(&mut Tile<R>, [u32; 3], Range<usize>)> for Push<'_, R> {
    #[inline(always)]
    fn on(&self, wide: Option<Wide>, (tile, origin, particles): (&mut Tile<R>, [u32; 3], Range<usize>)) {
        let Push { solve, scale, last, corrects, .. } = *self;
        let (zero, bound) = (R::of(0.0), solve.bound);
        let walls = self.walls.beside(origin);
        let walls = walls.as_ref();
        for p in particles {
            let search = &self.search[p];
            let pressure = if last { search.pressure } else { bounded(wanted(search, &solve), bound) };
            let unit = mass_of(&self.gradient[p]) * scale;
            let walls = walls.filter(|_| self.shear.get(p).is_none_or(|shear| shear.compliance <= zero));
            let pressure =
                factors_beside(walls, self.position[p], beside_of(&self.gradient[p])).map(|factor| pressure * factor);
            let columns = match self.shear.get(p) {
                None => {
                    let [x, y, z] = pressure.map(|p| p * unit);
                    [[x, zero, zero], [zero, y, zero], [zero, zero, z]]
                }
                Some(shear) => {
                    let correction = shear.correction;
                    let shear = if last { shear.found } else { wanted_shear(shear, &solve).within(bound) };
                    // For a liquid only the viscous stress is corrected.
                    let apart = self.sticks && is_liquid(self.materials, &self.gradient[p]);
                    let [within, beside] = if apart { [[zero; 3], pressure] } else { [pressure, [zero; 3]] };
                    let diagonal = add(shear.diagonal, within);
                    let columns = Symmetric { diagonal, ..shear }.times(unit).columns();
                    let mut columns = if corrects { corrected(&columns, correction) } else { columns };
                    (0..3).for_each(|c| columns[c][c] += beside[c] * unit);
                    columns
                }
            };
            let column = |c: [R; 3]| R::V::from4([c[0], c[1], c[2], zero]);
            let columns = [column(columns[0]), column(columns[1]), column(columns[2])];
            scatter_affine::<R>(wide, tile, origin, self.position[p], R::V::all(zero), columns);
        }
    }
}

/// Gathers the effect of the direction of search on the strain and takes the step along it. The `first` time it gathers
/// the strain of the predicted motion, which is to be taken back.
fn step<R: Real>(s: &mut CpuState<R>, first: bool) {
    let blocks = &s.blocks[..s.occupied];
    let before = s.solve;
    let (square_scale, compliant_scale) = (before.square_scale(), before.compliant_scale());
    let work = Step {
        position: &s.position,
        gradient: &s.gradient,
        field: &s.field,
        links: &s.links,
        materials: &s.materials,
        pressures: &s.block_pressures,
        before,
        square_scale,
        compliant_scale,
        corrects: s.features.corrects,
        walls: Walls::of(s),
        first,
        totals: par::Totals::new(blocks.len()),
        largest: par::Largest::new(),
    };
    let shear = (!s.shear.is_empty()).then_some(&mut s.shear[..]);
    par::block_particles(blocks, (&mut s.search[..], shear), &|b, block, (search, shear)| {
        widely(&work, (b, block, search, shear));
    });
    let [square, compliant @ ..] = work.totals.take();
    let upwards = if before.resuming() { compliant[2] } else { R::of(0.0) };
    s.solve.square = (square - upwards) * (R::of(1.0) / square_scale);
    s.solve.compliant = compliant.map(|sum| sum * (R::of(1.0) / compliant_scale));
    [s.solve.largest_answer, s.solve.largest_direction, s.solve.largest_found] = work.largest.take();
}

/// Takes the step for a block's particles.
struct Step<'a, R: Real> {
    position: &'a [[R; 4]],
    gradient: &'a [Gradient<R>],
    field: &'a [[[R; 4]; NODES]],
    links: &'a [[u32; 8]],
    materials: &'a [MaterialConstants<R>],
    /// Empty where the liquids of a block share no pressure.
    pressures: &'a [BlockPressure<R>],
    before: Solve<R>,
    square_scale: R,
    compliant_scale: R,
    corrects: bool,
    walls: Walls<R>,
    first: bool,
    totals: par::Totals<R, 4>,
    largest: par::Largest<3>,
}

/// A block and the solve's state of its particles; the second is `None` where only pressures are unknown.
type Sought<'a, R> = (usize, &'a Block, &'a mut [Search<R>], Option<&'a mut [Shear<R>]>);

impl<R: Real> Work<Sought<'_, R>> for Step<'_, R> {
    #[inline(always)]
    fn on(&self, _: Option<Wide>, (b, block, search, mut shear): Sought<'_, R>) {
        let Step { before, gradient, first, .. } = self;
        let tile = tile(self.field, &self.links[b], |node| *node);
        let origin = origin(block.key);
        let walls = self.walls.beside(origin);
        let walls = walls.as_ref();
        let mut sums = [R::Whole::default(); 4];
        let mut most = [R::of(0.0); 3];
        let shared = if *first { self.pressures.get(b) } else { None };
        for (i, search) in search.iter_mut().enumerate() {
            let p = block.start as usize + i;
            let mut d = [[R::of(0.0); 4]; 3];
            gather(&tile, origin, &Stencil::at(self.position[p]), &mut d);
            let d = d.map(|c| [c[0], c[1], c[2]]);
            let plain = Symmetric::of(&d);
            let mut strain = plain;
            if let Some(shear) = shear.as_deref().filter(|_| self.corrects) {
                strain = strain.plus(&Symmetric::of(&missed(&d, shear[i].correction)));
            }
            let material = &self.materials[material_of(&gradient[p])];
            let liquid = material.model == LIQUID;
            let bears_shear = shear.as_deref().is_some_and(|shear| shear[i].compliance > R::of(0.0));
            let divergence = if liquid {
                dot(
                    plain.diagonal,
                    factors_beside(walls.filter(|_| !bears_shear), self.position[p], beside_of(&gradient[p])),
                )
            } else {
                strain.trace()
            };
            if let Some(shared) = shared
                && liquid
                && search.compliance > R::of(0.0)
            {
                search.residual += search.compliance * (material.lightness * shared.load);
                search.pressure = material.lightness * shared.found;
            }
            advance(search, before, divergence, *first);
            let mut parts = parts(search, before);
            if let Some(shear) = shear.as_deref_mut().map(|shear| &mut shear[i]).filter(|s| s.compliance > R::of(0.0)) {
                advance_shear(shear, before, strain.traceless(), *first);
                add_shear(&mut parts, shear, before);
            }
            let mass = mass_of(&gradient[p]);
            let (square, compliant) = (mass * self.square_scale, mass * self.compliant_scale);
            let descent = square * parts.square;
            sums[0] += R::whole(descent.max(R::of(0.0)));
            let weighted = parts.compliant.map(|part| compliant * part);
            sums[1] += R::whole(weighted[0]);
            sums[2] += R::whole(weighted[1]);
            // The stress carried over may go up, too: that is summed apart, as sums have no sign, in place of one that
            // counts only once directions mix.
            sums[3] += R::whole(if before.resuming() { (-descent).max(R::of(0.0)) } else { weighted[2] });
            most.iter_mut().zip(parts.most).for_each(|(largest, most)| *largest = largest.max(most));
        }
        self.totals.set(b, sums);
        self.largest.note(most);
    }
}

/// Whether a particle is liquid.
#[inline(always)]
fn is_liquid<R: Real>(materials: &[MaterialConstants<R>], gradient: &Gradient<R>) -> bool {
    materials[material_of(gradient)].model == LIQUID
}

/// The new part of the next direction of search, before the bound.
#[inline(always)]
fn wanted<R: Real>(search: &Search<R>, solve: &Solve<R>) -> R {
    if solve.resuming() { search.direction } else { search.answer() }
}

/// The same for the deviator.
#[inline(always)]
fn wanted_shear<R: Real>(shear: &Shear<R>, solve: &Solve<R>) -> Symmetric<R> {
    if solve.resuming() { shear.direction } else { shear.answer() }
}

/// Takes the step along the direction of search, which changes the divergence by `divergence`.
#[inline(always)]
fn advance<R: Real>(search: &mut Search<R>, before: &Solve<R>, divergence: R, first: bool) {
    let (mut image, mut step) = (divergence, R::of(1.0));
    if !first {
        if !before.resumed() {
            search.direction = bounded(search.answer(), before.last_bound) + search.direction * before.mix;
        }
        search.pressure += search.direction * before.step;
        (image, step) = (divergence + search.compliance * search.direction, before.step);
    }
    // Particles that take no part have no compliance.
    let takes_part = search.compliance > R::of(0.0);
    search.residual = if takes_part { search.residual - image * step } else { R::of(0.0) };
}

/// The same for the deviator; the direction changes the strain rate by `change`.
#[inline(always)]
fn advance_shear<R: Real>(shear: &mut Shear<R>, before: &Solve<R>, change: Symmetric<R>, first: bool) {
    let (mut image, mut step) = (change, R::of(1.0));
    if !first {
        if !before.resumed() {
            shear.direction = shear.answer().within(before.last_bound).plus(&shear.direction.times(before.mix));
        }
        shear.found = shear.found.plus(&shear.direction.times(before.step));
        (image, step) = (change.plus(&shear.direction.times(shear.compliance)), before.step);
    }
    shear.residual = shear.residual.minus(&image.times(step));
}

/// A particle's parts of the sums, without its mass, and its largest numbers.
struct Parts<R> {
    /// Residual times answer.
    square: R,
    /// Compliance times the squares of answer, direction and both.
    compliant: [R; 3],
    /// Answer, direction and change found. The answer is the one before the bound, so that a cut one can be detected.
    most: [R; 3],
}

#[inline(always)]
fn parts<R: Real>(search: &Search<R>, before: &Solve<R>) -> Parts<R> {
    let (whole, direction) = (wanted(search, before), search.direction);
    let answer = bounded(whole, before.bound);
    Parts {
        square: search.residual * answer,
        compliant: [answer, direction, answer + direction].map(|part| search.compliance * (part * part)),
        most: [whole, direction, search.pressure].map(R::abs),
    }
}

#[inline(always)]
fn add_shear<R: Real>(parts: &mut Parts<R>, shear: &Shear<R>, before: &Solve<R>) {
    let whole = wanted_shear(shear, before);
    let answer = whole.within(before.bound);
    parts.square += shear.residual.product(&answer);
    let squares = [answer, shear.direction, answer.plus(&shear.direction)].map(|part| part.square());
    parts.compliant.iter_mut().zip(squares).for_each(|(sum, square)| *sum += shear.compliance * square);
    let sizes = [whole, shear.direction, shear.found].map(|part| part.square().sqrt());
    parts.most.iter_mut().zip(sizes).for_each(|(most, size)| *most = most.max(size));
}

/// Adds the stress found to the one carried over; of viscoplastic solids, as much as the yield surface admits.
fn admit<R: Real>(s: &mut CpuState<R>) {
    let constants = &s.constants;
    let materials = &s.materials;
    let tensors = !s.shear.is_empty();
    let shear = (tensors.then_some(&mut s.shear[..]), tensors.then_some(&mut s.deviator[..]));
    let search = &s.search;
    let particles = (&mut s.gradient[..], shear);
    par::block_particles(&s.blocks[..s.occupied], particles, &|_, block, (gradient, (mut shear, mut deviator))| {
        let search = &search[block.start as usize..];
        for (i, (gradient, search)) in gradient.iter_mut().zip(search).enumerate() {
            if let (Some(shear), Some(deviator)) = (&mut shear, &mut deviator) {
                let (shear, deviator) = (&mut shear[i], &mut deviator[i]);
                let material = &materials[material_of(gradient)];
                let before = Symmetric::of_lanes(deviator);
                let mut after = before.plus(&shear.found);
                if material.model == VISCOPLASTIC {
                    after = admissible(material, after, constants);
                    shear.found = after.minus(&before);
                }
                after.store(deviator);
            }
            *pressure_mut(gradient) += search.pressure;
        }
    });
}

/// The part of a stress's deviator that a viscoplastic material can carry.
#[inline(always)]
fn admissible<R: Real>(m: &MaterialConstants<R>, deviator: Symmetric<R>, constants: &Constants<R>) -> Symmetric<R> {
    let [_, shear] = compliances(m, constants);
    deviator.within(m.yield_limit * (R::of(1.0) / shear))
}

/// `x` within ±`bound`.
#[inline(always)]
pub(super) fn bounded<R: Real>(x: R, bound: R) -> R {
    x.max(-bound).min(bound)
}
