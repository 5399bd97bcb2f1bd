//! Takes a step of conjugate gradients towards the pressures, and sums on the nodes what they do.
//!
//! Wanted are changes q of the pressures with c q + tr ∇u(q) = r. An iteration is one pass over the particles and one over the nodes:
//! these keep the velocities of the direction of search, so that what it does is gathered, not the answer's part of it.

use super::Kernel;
use super::g2p::{gather, tile};
use super::p2g::{Nodes, scatter_affine};
use crate::bins::coordinates;
use crate::cpu::par;
use crate::cpu::solve::Search;
use crate::cpu::state::{Constants, CpuState, MaterialConstants};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::{Lanes, Real};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
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

/// Largest error in volume that a step takes back, as a share.
pub(crate) const MAX_ERROR: f64 = 0.02;
/// Pressure that it may amount to besides, whatever the compliance.
pub(crate) const MAX_LOAD: f64 = 32.0;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool, last: bool) {
    if s.solve.active {
        step(s, first);
    } else if !last {
        return;
    }
    let scale = s.solve.force_scale(&s.constants, last);
    let (position, gradient, search, bound) = (&s.position, &s.gradient, &s.search, s.solve.bound);
    let nodes =
        Nodes::<R> { blocks: &s.blocks, sources: &s.sources, masses: None, tiles: &mut s.tiles, grid: &mut s.force };
    nodes.sum(s.occupied, |tile, origin, p| {
        let search = &search[p];
        let pressure = if last { search.pressure } else { bounded(search.answer(), bound) };
        let pressure = pressure * (gradient[p][0][3] * scale);
        let zero = R::of(0.0);
        let column = |c: usize| R::V::from4(std::array::from_fn(|i| if i == c { pressure } else { zero }));
        scatter_affine::<R>(tile, origin, position[p], R::V::all(zero), [column(0), column(1), column(2)]);
    });
    if last {
        let search = &s.search;
        par::block_particles(&s.blocks[..s.occupied], &mut s.gradient[..], &|_, block, gradient| {
            for (gradient, search) in gradient.iter_mut().zip(&search[block.start as usize..]) {
                gradient[2][3] += search.pressure;
            }
        });
    }
}

/// Gathers what the direction of search does to the divergence, and goes along it.
fn step<R: Real>(s: &mut CpuState<R>, first: bool) {
    let (position, gradient) = (&s.position, &s.gradient);
    let (field, links, blocks) = (&s.field, &s.links, &s.blocks[..s.occupied]);
    let before = s.solve;
    let (square_scale, compliant_scale) = (before.square_scale(), before.compliant_scale());
    let (totals, largest) = (par::Totals::<R, 4>::new(blocks.len()), par::Largest::new());
    par::block_particles(blocks, &mut s.search[..], &|b, block, search| {
        let tile = tile(field, &links[b], |node| *node);
        let origin = coordinates(block.key).map(|c| c << 2);
        let mut sums = [R::Whole::default(); 4];
        let mut most = [R::of(0.0); 3];
        for (i, search) in search.iter_mut().enumerate() {
            let p = block.start as usize + i;
            let mut d = [[R::of(0.0); 4]; 3];
            gather(&tile, origin, position[p], &mut d);
            let divergence = d[0][0] + d[1][1] + d[2][2];
            if first {
                begin(search, gradient[p][2][3], position[p][3], divergence);
            } else {
                search.direction = bounded(search.answer(), before.last_bound) + search.direction * before.mix;
                search.pressure += search.direction * before.step;
                let image = divergence + search.compliance * search.direction;
                search.residual = taking_part(search, search.residual - image * before.step);
            }
            let whole = search.answer();
            let (answer, direction) = (bounded(whole, before.bound), search.direction);
            let mass = gradient[p][0][3];
            let (square, compliant) = (mass * square_scale, mass * (search.compliance * compliant_scale));
            sums[0] += R::whole(square * (search.residual * answer));
            for (sum, part) in sums[1..].iter_mut().zip([answer, direction, answer + direction]) {
                *sum += R::whole(compliant * (part * part));
            }
            // The answer as it would be without the bound, so that it is known where one was cut.
            for (most, value) in most.iter_mut().zip([whole, direction, search.pressure]) {
                *most = most.max(value.abs());
            }
        }
        totals.set(b, sums);
        largest.note(most);
    });
    let [square, compliant @ ..] = totals.take();
    s.solve.square = square * (R::of(1.0) / square_scale);
    s.solve.compliant = compliant.map(|sum| sum * (R::of(1.0) / compliant_scale));
    [s.solve.answer, s.solve.direction, s.solve.found] = largest.take();
}

/// Compliance of a liquid, as divergence per pressure.
#[inline(always)]
pub(super) fn compliance<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    let stiffness = m.inverse_density * constants.seconds * constants.seconds * m.bulk * constants.impulse;
    R::of(1.0) / (R::of(4.0) * stiffness.min(constants.stiffness_limit))
}

/// What is to be found for a particle that takes part: the divergence that takes back the error in volume, but what there is already
/// and what the pressure brought along stands for.
#[inline(always)]
fn begin<R: Real>(search: &mut Search<R>, brought: R, ratio: R, divergence: R) {
    let bound = R::of(MAX_ERROR) + R::of(MAX_LOAD) * search.compliance;
    let wanted = bounded(R::of(1.0) / ratio - R::of(1.0), bound);
    search.residual = taking_part(search, wanted - divergence - search.compliance * brought);
}

/// `residual`, but of particles that take no part, which have no compliance.
#[inline(always)]
fn taking_part<R: Real>(search: &Search<R>, residual: R) -> R {
    if search.compliance > R::of(0.0) { residual } else { R::of(0.0) }
}

/// `x` within ±`bound`.
#[inline(always)]
fn bounded<R: Real>(x: R, bound: R) -> R {
    x.max(-bound).min(bound)
}
