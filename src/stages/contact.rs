//! Contact with colliders, shared by the grid and the particles. Twin: `shaders/lib/contact.wgsl`.

use crate::cpu::state::ColliderConstants;
use crate::math::linear::{add, dot, scale, sub, transform, transform_transposed};
use crate::math::real::Real;
use crate::math::sdf;

/// How often all colliders are visited, so that motion stopped by one is not directed into another.
pub const SWEEPS: usize = 2;

/// Distance to the body and its outward normal in the world, for a point at `r` from the body's centre.
#[inline(always)]
fn distance_normal<R: Real>(c: &ColliderConstants<R>, r: [R; 3]) -> (R, [R; 3]) {
    let (distance, normal) = sdf::distance_normal(c.kind, c.size, transform_transposed(&c.axes, r));
    (distance, transform(&c.axes, normal))
}

/// Distance and outward normal at the start of the step.
#[inline(always)]
pub fn distance_normal_before<R: Real>(c: &ColliderConstants<R>, x: [R; 3]) -> (R, [R; 3]) {
    distance_normal(c, sub(x, c.position))
}

/// Distance at the start of the step.
#[inline(always)]
pub fn distance<R: Real>(c: &ColliderConstants<R>, x: [R; 3]) -> R {
    distance_normal(c, sub(x, c.position)).0
}

/// Distance and outward normal at the end of the step.
#[inline(always)]
pub fn distance_normal_after<R: Real>(c: &ColliderConstants<R>, x: [R; 3]) -> (R, [R; 3]) {
    let r = sub(sub(x, c.position), c.shift);
    // (turn + 1) is the step's rotation; its transpose turns back.
    let back = add(transform_transposed(&c.turn, r), r);
    let (distance, normal) = distance_normal(c, back);
    (distance, add(transform(&c.turn, normal), normal))
}

/// Displacement of the body's material at `x` in the step.
#[inline(always)]
pub fn motion<R: Real>(c: &ColliderConstants<R>, x: [R; 3]) -> [R; 3] {
    add(c.shift, transform(&c.turn, sub(x, c.position)))
}

/// The displacement `u` of a point at `x`, kept from entering the body.
///
/// Relative to the body, a point at distance `d` may move at most `max(d, 0)` against the normal. For a convex body the
/// end of the step then lies outside, however long the step is. What is stopped along the normal bounds the friction.
#[inline(always)]
pub fn resolve<R: Real>(c: &ColliderConstants<R>, x: [R; 3], u: [R; 3], friction: R) -> Option<[R; 3]> {
    let zero = R::of(0.0);
    let (distance, normal) = distance_normal(c, sub(x, c.position));
    let body = motion(c, x);
    let relative = sub(u, body);
    let along = dot(relative, normal);
    let gap = distance.max(zero);
    let stopped = -gap - along;
    if stopped <= zero {
        return None;
    }
    let mut tangent = sub(relative, scale(normal, along));
    if friction > zero {
        let slip = dot(tangent, tangent).sqrt();
        let kept = if slip > friction * stopped { R::of(1.0) - friction * stopped / slip } else { zero };
        tangent = scale(tangent, kept);
    }
    Some(add(body, sub(tangent, scale(normal, gap))))
}

/// A collider that can be touched from a block, with a lower bound of its distance there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near<R> {
    pub collider: usize,
    /// Tangent to the distance at the block's middle, less the collider's own reach. The distance to a convex body is a
    /// convex function, so that it is nowhere below its tangents.
    pub slope: [R; 3],
    pub offset: R,
}

impl<R: Real> Near<R> {
    /// Whether a point at `x` that moves at most `speed` can touch the collider.
    #[inline(always)]
    pub fn reaches(&self, x: [R; 3], speed: R) -> bool {
        dot(self.slope, x) + self.offset <= speed
    }
}

/// `u` kept out of all of `near`.
#[inline(always)]
pub fn resolve_all<R: Real>(
    colliders: &[ColliderConstants<R>],
    near: &[Near<R>],
    x: [R; 3],
    mut u: [R; 3],
    with_friction: bool,
) -> [R; 3] {
    let speed = dot(u, u).sqrt();
    for _ in 0..SWEEPS {
        let mut touched = false;
        for near in near.iter().filter(|near| near.reaches(x, speed)) {
            let c = &colliders[near.collider];
            let friction = if with_friction { c.friction } else { R::of(0.0) };
            if let Some(resolved) = resolve(c, x, u, friction) {
                u = resolved;
                touched = true;
            }
        }
        if !touched {
            break;
        }
    }
    u
}
