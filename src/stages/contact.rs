//! Contact with colliders, shared by the grid and the particles. Twin: `shaders/lib/contact.wgsl`.

use crate::cpu::state::ColliderConstants;
use crate::math::real::Real;
use crate::math::sdf;

/// How often all colliders are visited, so that motion stopped by one is not directed into another.
pub const SWEEPS: usize = 2;

#[inline(always)]
pub fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub fn add<R: Real>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub fn sub<R: Real>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub fn scale<R: Real>(a: [R; 3], s: R) -> [R; 3] {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `m · v` for a matrix of columns.
#[inline(always)]
fn mul<R: Real>(m: &[[R; 3]; 3], v: [R; 3]) -> [R; 3] {
    add(add(scale(m[0], v[0]), scale(m[1], v[1])), scale(m[2], v[2]))
}

/// `mᵀ · v` for a matrix of columns.
#[inline(always)]
fn mul_transposed<R: Real>(m: &[[R; 3]; 3], v: [R; 3]) -> [R; 3] {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}

/// Distance to the body and its outward normal in the world, for a point at `r` from the body's centre.
#[inline(always)]
fn distance_normal<R: Real>(c: &ColliderConstants<R>, r: [R; 3]) -> (R, [R; 3]) {
    let (distance, normal) = sdf::distance_normal(c.kind, c.size, mul_transposed(&c.axes, r));
    (distance, mul(&c.axes, normal))
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
    let back = add(mul_transposed(&c.turn, r), r);
    let (distance, normal) = distance_normal(c, back);
    (distance, add(mul(&c.turn, normal), normal))
}

/// Displacement of the body's material at `x` in the step.
#[inline(always)]
pub fn motion<R: Real>(c: &ColliderConstants<R>, x: [R; 3]) -> [R; 3] {
    add(c.shift, mul(&c.turn, sub(x, c.position)))
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

/// `u` kept out of all of `near`.
#[inline(always)]
pub fn resolve_all<R: Real>(
    colliders: &[ColliderConstants<R>],
    near: impl Iterator<Item = usize> + Clone,
    x: [R; 3],
    mut u: [R; 3],
    with_friction: bool,
) -> [R; 3] {
    for _ in 0..SWEEPS {
        let mut touched = false;
        for c in near.clone() {
            let c = &colliders[c];
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
