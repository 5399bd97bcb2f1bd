//! Notes for each block which colliders can be touched from it.

use super::Kernel;
use super::contact::{distance, motion};
use crate::bins::{EDGE, coordinates};
use crate::cpu::par;
use crate::cpu::state::{ColliderConstants, Constants, CpuState};
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
pub(crate) const BLOCK_RADIUS: f64 = 3.8972;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let words = s.cull_words;
    s.cull.resize(s.blocks.len() * words, 0);
    let (blocks, colliders, constants) = (&s.blocks, &s.colliders, &s.constants);
    par::each(&mut s.cull, |i, mask| {
        let middle = middle(blocks[i / words].key);
        let first = i % words * 32;
        let here = &colliders[first..colliders.len().min(first + 32)];
        *mask = here.iter().enumerate().fold(0, |m, (bit, c)| m | u32::from(in_reach(c, constants, middle)) << bit);
    });
}

/// The middle of a block's nodes and particles.
#[inline(always)]
pub(crate) fn middle<R: Real>(key: u32) -> [R; 3] {
    coordinates(key).map(|c| R::of(f64::from(c * EDGE as u32)) + R::of(TO_MIDDLE))
}

/// Whether anything in a block around `middle` can touch the collider in this step.
fn in_reach<R: Real>(c: &ColliderConstants<R>, constants: &Constants<R>, middle: [R; 3]) -> bool {
    let body = motion(c, middle);
    let turn = (dot(c.turn[0], c.turn[0]) + dot(c.turn[1], c.turn[1]) + dot(c.turn[2], c.turn[2])).sqrt();
    let radius = R::of(BLOCK_RADIUS);
    let reach = constants.max_displacement + dot(body, body).sqrt() + turn * radius;
    distance(c, middle) <= radius + reach
}
