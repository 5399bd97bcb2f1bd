//! Notes for each block which colliders can be touched from it.

use super::Kernel;
use super::contact::{Near, distance, distance_normal_before, motion};
use crate::bins::{EDGE, coordinates};
use crate::cpu::par;
use crate::cpu::state::{ColliderConstants, CpuState};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::dot;
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Colliders),
        read(Slot::Blocks),
        write(Slot::Cull),
        write(Slot::Counters),
    ],
    over: Over::Blocks,
    source: include_str!("../../shaders/stages/collider_cull.wgsl"),
};

/// From a block's first node to the middle of its nodes and particles, cells along each axis.
const TO_MIDDLE: f64 = 2.25;
/// Distance from that middle to the farthest node or particle: √3 · 2.25.
const BLOCK_RADIUS: f64 = 3.8972;
/// Room for rounding in a lower bound, cells.
const ROUNDING: f64 = 1e-2;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let words = s.cull_words;
    s.cull.resize(s.blocks.len() * words, 0);
    let (blocks, colliders, constants) = (&s.blocks, &s.colliders, &s.constants);
    par::each_block(&mut s.cull, |i, mask| {
        let middle = middle(blocks[i / words].key);
        let first = i % words * 32;
        let here = &colliders[first..colliders.len().min(first + 32)];
        *mask = here
            .iter()
            .enumerate()
            .fold(0, |m, (bit, c)| m | u32::from(in_reach(c, constants.max_displacement, middle)) << bit);
    });
}

/// The middle of a block's nodes and particles.
#[inline(always)]
fn middle<R: Real>(key: u32) -> [R; 3] {
    coordinates(key).map(|c| R::of(f64::from(c * EDGE as u32)) + R::of(TO_MIDDLE))
}

/// Whether anything in a block around `middle` that moves at most `speed` can touch the collider in this step.
fn in_reach<R: Real>(c: &ColliderConstants<R>, speed: R, middle: [R; 3]) -> bool {
    distance(c, middle) <= R::of(BLOCK_RADIUS) + speed + motion_bound(c, middle)
}

/// Of the colliders noted for a block, those that can be touched at the block's own speed. Leaving out the others changes
/// nothing; the shaders do without.
pub(crate) fn touching<R: Real>(colliders: &[ColliderConstants<R>], masks: &[u32], key: u32, speed: R) -> Vec<Near<R>> {
    let middle = middle::<R>(key);
    let bits = masks
        .iter()
        .enumerate()
        .flat_map(|(word, &mask)| (0..32).filter(move |bit| mask >> bit & 1 != 0).map(move |bit| 32 * word + bit));
    let candidates: Vec<_> = bits
        .map(|c| {
            let (distance, slope) = distance_normal_before(&colliders[c], middle);
            (c, distance, slope, motion_bound(&colliders[c], middle) + R::of(ROUNDING))
        })
        .collect();
    // Being stopped by a moving body can make a point faster, by at most twice the body's motion, so that it reaches
    // further bodies: from those in reach at its own speed on, until no further one is found.
    let mut gained = R::of(0.0);
    loop {
        let radius = R::of(BLOCK_RADIUS) + speed + gained;
        let reached = candidates.iter().filter(|(_, distance, _, own)| *distance <= radius + *own);
        let fastest = reached.fold(R::of(0.0), |most, (_, _, _, own)| most.max(*own + *own));
        if fastest <= gained {
            break;
        }
        gained = fastest;
    }
    let radius = R::of(BLOCK_RADIUS) + speed + gained;
    let near = candidates.into_iter().filter(|(_, distance, _, own)| *distance <= radius + *own);
    near.map(|(collider, distance, slope, own)| Near {
        collider,
        slope,
        offset: distance - dot(slope, middle) - own - gained,
    })
    .collect()
}

/// The largest motion of the collider's material in a block around `middle`.
fn motion_bound<R: Real>(c: &ColliderConstants<R>, middle: [R; 3]) -> R {
    let body = motion(c, middle);
    let turn = (dot(c.turn[0], c.turn[0]) + dot(c.turn[1], c.turn[1]) + dot(c.turn[2], c.turn[2])).sqrt();
    dot(body, body).sqrt() + turn * R::of(BLOCK_RADIUS)
}
