//! Contact with colliders, shared by the grid and the particles; four points at a time. Twin:
//! `shaders/lib/contact.wgsl`.

use crate::cpu::state::ColliderConstants;
use crate::math::linear::{add, dot, scale, sub, transform, transform_transposed};
use crate::math::real::{Lanes, Real};
use crate::math::sdf;

/// How often all colliders are visited, so that motion stopped by one is not directed into another.
pub const SWEEPS: usize = 2;

/// Distance to the body and its outward normal in the world, for points at `r` from the body's centre.
#[inline(always)]
fn distance_normal<R: Real>(c: &ColliderConstants<R::V>, r: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let (distance, normal) = sdf::distance_normal::<R>(c.kind, c.size, transform_transposed(&c.axes, r));
    (distance, transform(&c.axes, normal))
}

/// Distance and outward normal at the start of the step.
#[inline(always)]
pub fn distance_normal_before<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3]) -> (R::V, [R::V; 3]) {
    distance_normal::<R>(c, sub(x, c.position))
}

/// Distance and outward normal at the end of the step.
#[inline(always)]
pub fn distance_normal_after<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let r = sub(sub(x, c.position), c.shift);
    // (turn + 1) is the step's rotation; its transpose turns back.
    let back = add(transform_transposed(&c.turn, r), r);
    let (distance, normal) = distance_normal::<R>(c, back);
    (distance, add(transform(&c.turn, normal), normal))
}

/// Displacement of the body's material at `x` in the step.
#[inline(always)]
pub fn motion<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3]) -> [R::V; 3] {
    add(c.shift, transform(&c.turn, sub(x, c.position)))
}

/// The displacements `u` of points at `x`, kept from entering the body, and which of them had to be.
#[inline(always)]
fn resolve<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3], u: [R::V; 3], with_friction: bool) -> ([R::V; 3], R::V) {
    if sdf::is_inverted(c.kind) {
        resolve_inside::<R>(c, x, u, with_friction)
    } else {
        resolve_outside::<R>(c, x, u, with_friction)
    }
}

/// Of a tangential motion, what friction leaves where `stopped` was taken from the motion along the normal.
#[inline(always)]
fn rubbed<R: Real>(c: &ColliderConstants<R::V>, tangent: [R::V; 3], stopped: R::V, with_friction: bool) -> [R::V; 3] {
    if !with_friction || c.friction.to4()[0] <= R::of(0.0) {
        return tangent;
    }
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let slip = dot(tangent, tangent).sqrt();
    let taken = c.friction * stopped;
    scale(tangent, taken.below(slip).pick(one - taken / slip, zero))
}

/// In a container, a point may end no deeper in any of the walls than it began.
///
/// A wall's inside is convex, so that going back along the normal at the point reached is going to the nearest point that is
/// allowed: curved walls hold however long the step is, which a bound by the normal at its start does not give. Walls that
/// meet in edges are at right angles there and taken one by one; by the distance to the edge alone, nodes beyond two walls
/// would be free to move along both.
#[inline(always)]
fn resolve_inside<R: Real>(
    c: &ColliderConstants<R::V>,
    x: [R::V; 3],
    u: [R::V; 3],
    with_friction: bool,
) -> ([R::V; 3], R::V) {
    let zero = R::V::all(R::of(0.0));
    let r = sub(x, c.position);
    let start = transform_transposed(&c.axes, r);
    let end = add(r, sub(u, c.shift));
    let end = transform_transposed(&c.axes, add(transform_transposed(&c.turn, end), end));
    let mut relative = sub(end, start);
    let mut touched = zero.below(zero);
    for wall in 0..sdf::walls(c.kind) {
        let (after, normal) = sdf::wall_distance_normal::<R>(c.kind, wall, c.size, add(start, relative));
        let (before, _) = sdf::wall_distance_normal::<R>(c.kind, wall, c.size, start);
        let stopped = before.min(zero) - after;
        let hit = zero.below(stopped);
        if !hit.any() {
            continue;
        }
        touched = hit.pick(hit, touched);
        let along = dot(relative, normal);
        let tangent = rubbed::<R>(c, sub(relative, scale(normal, along)), stopped, with_friction);
        let kept = add(tangent, scale(normal, along + stopped));
        relative = [0, 1, 2].map(|a| hit.pick(kept[a], relative[a]));
    }
    if !touched.any() {
        return (u, touched);
    }
    let relative = transform(&c.axes, relative);
    let kept = add(motion::<R>(c, x), add(transform(&c.turn, relative), relative));
    ([0, 1, 2].map(|a| touched.pick(kept[a], u[a])), touched)
}

/// Relative to the body, a point at distance `d` may move at most `max(d, 0)` against the normal. For a convex body the
/// end of the step then lies outside, however long the step is. What is stopped along the normal bounds the friction.
#[inline(always)]
fn resolve_outside<R: Real>(
    c: &ColliderConstants<R::V>,
    x: [R::V; 3],
    u: [R::V; 3],
    with_friction: bool,
) -> ([R::V; 3], R::V) {
    let zero = R::V::all(R::of(0.0));
    let (distance, normal) = distance_normal_before::<R>(c, x);
    let body = motion::<R>(c, x);
    let relative = sub(u, body);
    let along = dot(relative, normal);
    let gap = distance.max(zero);
    let stopped = -gap - along;
    let touched = zero.below(stopped);
    if !touched.any() {
        return (u, touched);
    }
    let tangent = rubbed::<R>(c, sub(relative, scale(normal, along)), stopped, with_friction);
    let kept = add(body, sub(tangent, scale(normal, gap)));
    ([0, 1, 2].map(|a| touched.pick(kept[a], u[a])), touched)
}

/// A collider that can be touched from a block, with a lower bound of its distance there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near<R: Real> {
    pub collider: usize,
    /// Tangent to the distance at the block's middle, less the collider's own reach. The distance to a convex body is a
    /// convex function, so that it is nowhere below its tangents. That to the wall around a container is not; there the
    /// slope is zero and the bound, for points of the block only, rests on distances changing by at most the way walked.
    pub slope: [R::V; 3],
    pub offset: R::V,
    /// The most that the body's material moves in the block.
    pub own: R::V,
    /// Where points end says whether they can be inside the collider: it stands still, and the bound holds everywhere.
    pub by_end: bool,
}

impl<R: Real> Near<R> {
    /// Whether any of the points at `x` that move at most `speed` can touch the collider.
    #[inline(always)]
    pub fn reaches(&self, x: [R::V; 3], speed: R::V) -> bool {
        (dot(self.slope, x) + self.offset).at_most(speed).any()
    }

    /// Whether any of the points that move at most `speed` from `x` to `to` can end inside the collider.
    #[inline(always)]
    pub fn holds(&self, x: [R::V; 3], speed: R::V, to: [R::V; 3]) -> bool {
        if self.by_end { self.reaches(to, R::V::all(R::of(0.0))) } else { self.reaches(x, speed) }
    }
}

/// `u` kept out of all of `near`.
#[inline(always)]
pub fn resolve_all<R: Real>(
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    x: [R::V; 3],
    mut u: [R::V; 3],
    with_friction: bool,
) -> [R::V; 3] {
    let speed = dot(u, u).sqrt();
    for _ in 0..SWEEPS {
        let mut touched = false;
        for near in near.iter().filter(|near| near.reaches(x, speed)) {
            let (resolved, mask) = resolve::<R>(&colliders[near.collider], x, u, with_friction);
            u = resolved;
            touched |= mask.any();
        }
        if !touched {
            break;
        }
    }
    u
}
