//! Takes a step of conjugate gradients towards the pressures, and sums on the nodes what they do.
//!
//! Wanted are changes q of the pressures with c q + tr ∇u(q) = r. The form of Chronopoulos and Gear (1989) needs both its sums at one
//! place, so that an iteration is one pass over the particles and one over the nodes.

use super::Kernel;
use super::g2p::{gather, tile};
use super::p2g::{Nodes, scatter_affine};
use crate::bins::coordinates;
use crate::cpu::par;
use crate::cpu::state::{Constants, CpuState, MaterialConstants};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::{Lanes, Real};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
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
/// Share in which the pressures that particles bring along become what the nodes know of them: what is left of noise that moves no
/// node would add up.
pub(crate) const LEAK: f64 = 0.05;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool, last: bool) {
    if s.solve.active {
        step(s, first);
    } else if !last {
        return;
    }
    let scale = s.solve.force_scale(&s.constants, last);
    let pressure_scale = s.solve.pressure_scale(&s.constants);
    let (position, gradient, search, bound) = (&s.position, &s.gradient, &s.search, s.solve.bound);
    let nodes =
        Nodes::<R> { blocks: &s.blocks, sources: &s.sources, masses: None, tiles: &mut s.tiles, grid: &mut s.force };
    nodes.sum(s.occupied, |tile, origin, p| {
        let (search, mass) = (&search[p], gradient[p][0][3]);
        let pressure = if last { search.pressure } else { bounded(search.answer(), bound) } * mass * scale;
        let zero = R::of(0.0);
        let column = |c: usize| R::V::from4(std::array::from_fn(|i| if i == c { pressure } else { zero }));
        // With the first answers go the pressures that were brought along.
        let brought = if first { mass * gradient[p][2][3] * pressure_scale } else { zero };
        let value = R::V::from4([zero, zero, zero, brought]);
        scatter_affine::<R>(tile, origin, position[p], value, [column(0), column(1), column(2)]);
    });
    if last {
        let search = &s.search;
        par::block_particles(&s.blocks[..s.occupied], &mut s.gradient[..], &|_, block, gradient| {
            for (gradient, search) in gradient.iter_mut().zip(&search[block.start as usize..]) {
                gradient[2][3] += search.pressure + search.leak;
            }
        });
    }
}

/// Gathers what the last answers have done to the divergence, and goes on.
fn step<R: Real>(s: &mut CpuState<R>, first: bool) {
    let (position, gradient, materials, constants) = (&s.position, &s.gradient, &s.materials, &s.constants);
    let (field, links, blocks) = (&s.field, &s.links, &s.blocks[..s.occupied]);
    let before = s.solve;
    let scale = before.square_scale();
    let (totals, largest) = (par::Totals::<R, 2>::new(blocks.len()), par::Largest::new());
    par::block_particles(blocks, &mut s.search[..], &|b, block, search| {
        let tile = tile(field, &links[b], |node| *node);
        let origin = coordinates(block.key).map(|c| c << 2);
        let mut sums = [R::Whole::default(); 2];
        let mut most = [R::of(0.0); 3];
        for (i, search) in search.iter_mut().enumerate() {
            let p = block.start as usize + i;
            let mut d = [[R::of(0.0); 4]; 3];
            let mean = gather(&tile, origin, position[p], &mut d);
            let divergence = d[0][0] + d[1][1] + d[2][2];
            let brought = gradient[p][2][3];
            if first {
                let material = &materials[gradient[p][1][3].floor_index() as usize];
                let (compliance, share) = compliance(material, constants);
                search.compliance = compliance;
                search.residual = wanted(position[p][3], share) - divergence - compliance * brought;
            } else {
                if before.count == 1 {
                    search.leak = R::of(LEAK) * (mean[3] - brought);
                }
                let answer = bounded(search.answer(), before.last_bound);
                let image = divergence + search.compliance * answer;
                search.direction = answer + search.direction * before.mix;
                search.image = image + search.image * before.mix;
                search.pressure += search.direction * before.step;
                search.residual -= search.image * before.step;
            }
            let answer = bounded(search.answer(), before.bound);
            let mass = gradient[p][0][3] * scale;
            sums[0] += R::whole(mass * (search.residual * answer));
            sums[1] += R::whole(mass * (search.compliance * (answer * answer)));
            // The answer as it would be without the bound, so that it is known where one was cut.
            for (most, value) in most.iter_mut().zip([search.answer(), search.direction, search.pressure]) {
                *most = most.max(value.abs());
            }
        }
        totals.set(b, sums);
        largest.note(most);
    });
    [s.solve.square, s.solve.compliant] = totals.take().map(|sum| sum * (R::of(1.0) / scale));
    [s.solve.answer, s.solve.direction, s.solve.found] = largest.take();
}

/// Compliance of a liquid, as divergence per pressure, and the share of an error in volume that a step takes back: at rest it is as stiff
/// as feedback allows, in motion as iterations can resolve.
#[inline(always)]
pub(super) fn compliance<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> (R, R) {
    let (four, one) = (R::of(4.0), R::of(1.0));
    let stiffness = four * m.inverse_density * constants.seconds * constants.seconds * m.bulk;
    let at_rest = stiffness.min(four * constants.rest_limit);
    let compliance = one / stiffness.min(four * constants.stiffness_limit);
    (compliance, at_rest * compliance)
}

/// The divergence that takes back the share of an error in volume.
#[inline(always)]
fn wanted<R: Real>(ratio: R, share: R) -> R {
    bounded(share * (R::of(1.0) / ratio - R::of(1.0)), R::of(MAX_ERROR))
}

/// `x` within ±`bound`.
#[inline(always)]
fn bounded<R: Real>(x: R, bound: R) -> R {
    x.max(-bound).min(bound)
}
