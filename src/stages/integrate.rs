//! Advances volume ratio and position, keeps particles out of bodies and inside the domain.

use super::Kernel;
use super::collider_cull::touching;
use super::contact::{distance_normal_after, resolve_all};
use crate::cpu::par;
use crate::cpu::state::{Constants, CpuState, ESCAPED, Gradient, QUARANTINED, Tally};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::{add, dot, scale};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        write(Slot::Position),
        write(Slot::Displacement),
        write(Slot::Gradient),
        read(Slot::Colliders),
        read(Slot::Cull),
        read(Slot::Order),
        read(Slot::Chunks),
        write(Slot::Counters),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/integrate.wgsl"),
};

/// Measured over carried density from which on the difference counts as compression. A regular lattice of particles reads
/// up to 2 % too dense between nodes; that must not push it apart in free flight.
pub(crate) const MEASURE_LIMIT: f64 = 1.02;

/// Smallest and largest volume ratio that a particle remembers.
pub(crate) const VOLUME_RATIO: [f64; 2] = [0.1, 4.0];

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (constants, colliders, tally) = (&s.constants, &s.colliders, &s.tally);
    let (cull, words) = (&s.cull, s.cull_words);
    let particles = ((&mut s.position[..], &mut s.displacement[..]), &mut s.gradient[..]);
    let blocks = &s.blocks;
    par::block_particles(&blocks[..s.occupied], particles, &|b, block, ((position, displacement), gradient)| {
        // Where a state is not finite the particle is taken out before anything can be touched.
        let fastest = displacement.iter().map(|u| u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).fold(R::of(0.0), R::max);
        let speed = fastest.sqrt().min(constants.max_displacement);
        let near = touching(colliders, &cull[b * words..(b + 1) * words], block.key, speed);
        for i in 0..block.count as usize {
            let (x, u, d) = (&mut position[i], &mut displacement[i], &gradient[i]);
            let finite = x.iter().chain(u.iter()).chain(d.iter().flatten()).all(|c| c.finite());
            if !finite {
                x[3] = R::of(QUARANTINED);
                Tally::add(&tally.quarantined, 1);
                continue;
            }
            x[3] = volume_ratio(x[3], u[3], d, constants);
            let mut motion = bounded([u[0], u[1], u[2]], constants);
            let at = [x[0], x[1], x[2]];
            let speed = dot(motion, motion).sqrt();
            // The grid has taken friction into account; here only what would end inside a body is stopped.
            motion = resolve_all(colliders, &near, at, motion, false);
            motion = bounded(motion, constants);
            let mut to = add(at, motion);
            for near in near.iter().filter(|near| near.reaches(at, speed)) {
                let (distance, normal) = distance_normal_after(&colliders[near.collider], to);
                if distance < R::of(0.0) {
                    to = add(to, scale(normal, (-distance).min(constants.push_out)));
                }
            }
            u[..3].copy_from_slice(&motion);
            if escapes(to, constants) {
                x[3] = R::of(ESCAPED);
                Tally::add(&tally.escaped, 1);
            }
            for a in 0..3 {
                x[a] = to[a].max(constants.lo[a]).min(constants.hi[a]);
            }
        }
    });
}

/// The carried ratio, its density moved towards the measured one where that is higher, advanced by the step's
/// divergence.
#[inline(always)]
fn volume_ratio<R: Real>(carried: R, fraction: R, d: &Gradient<R>, constants: &Constants<R>) -> R {
    let one = R::of(1.0);
    let mut ratio = carried;
    let excess = fraction * carried - R::of(MEASURE_LIMIT);
    if excess > R::of(0.0) {
        ratio = carried * (one / (one + constants.volume_gain * excess));
    }
    ratio = ratio + ratio * (d[0][0] + d[1][1] + d[2][2]);
    ratio.max(R::of(VOLUME_RATIO[0])).min(R::of(VOLUME_RATIO[1]))
}

#[inline(always)]
fn bounded<R: Real>(u: [R; 3], constants: &Constants<R>) -> [R; 3] {
    let length = dot(u, u);
    let bound = constants.max_displacement;
    if length > bound * bound { scale(u, bound / length.sqrt()) } else { u }
}

/// Whether `x` lies beyond an open side.
#[inline(always)]
fn escapes<R: Real>(x: [R; 3], constants: &Constants<R>) -> bool {
    (0..3).any(|a| {
        let sides = constants.open_sides >> (2 * a);
        (sides & 1 != 0 && x[a] < constants.lo[a]) || (sides & 2 != 0 && x[a] > constants.hi[a])
    })
}
