//! Nodes that two bodies stop which meet at an angle. Twin: `shaders/lib/corner.wgsl`.
//!
//! Stopped by the one and then by the other, a node keeps a motion along the second that the first has given it, and that nothing asked for:
//! pressure in the corner would drive liquid out of it. What each of two has to stop follows from the motion that neither has changed.

use crate::math::linear::{add, dot, scale, sub};
use crate::math::real::{Lanes, Real};

/// Cosine of the angle between normals from which on bodies stop more together than one by one.
const TOGETHER: f64 = 1e-3;
/// Square of its sine below which they stop along the same line.
const APART: f64 = 1e-3;
/// The least change, cells, that tells a normal, and the least share of the motion.
const LEAST: f64 = 1e-12;
const LEAST_SHARE: f64 = 1e-5;

/// What a body without friction has stopped of points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop<V> {
    /// Which points it has stopped.
    pub known: V,
    pub normal: [V; 3],
    /// By how much.
    by: V,
    /// The least motion along the normal that it allows.
    allowed: V,
    /// Its place among those in reach.
    pub body: V,
}

impl<V: Copy> Stop<V> {
    /// Of nobody.
    pub fn none(none: V) -> Self {
        Stop { known: none, normal: [none; 3], by: none, allowed: none, body: none }
    }
}

/// Of a body that has changed the motions of those `touched`.
#[inline(always)]
pub(super) fn stop<R: Real>(body: usize, before: [R::V; 3], after: [R::V; 3], touched: R::V) -> Stop<R::V> {
    let all = |x: f64| R::V::all(R::of(x));
    let change = sub(after, before);
    let by = dot(change, change).sqrt();
    let least = (dot(after, after).sqrt() * all(LEAST_SHARE)).max(all(LEAST));
    let normal = scale(change, all(1.0) / by.max(all(LEAST)));
    Stop { known: touched.and(least.below(by)), normal, by, allowed: dot(normal, after), body: all(body as f64) }
}

/// `second` for the points that it has stopped, `first` for the rest.
#[inline(always)]
pub(super) fn latest<R: Real>(second: &Stop<R::V>, first: &Stop<R::V>) -> Stop<R::V> {
    let pick = |a: R::V, b: R::V| second.known.pick(a, b);
    Stop {
        known: pick(second.known, first.known),
        normal: [0, 1, 2].map(|a| pick(second.normal[a], first.normal[a])),
        by: pick(second.by, first.by),
        allowed: pick(second.allowed, first.allowed),
        body: pick(second.body, first.body),
    }
}

/// What two bodies make of points together.
pub(super) struct Corner<V> {
    /// Of which points.
    pub at: V,
    pub u: [V; 3],
    /// How much more than before the first stops, along its normal.
    pub more: V,
    /// How much the second does.
    pub second: V,
}

/// Of points with the motion `u`, that `first` has stopped already and `second` is about to; `None` where there are none that these two stop
/// together.
#[inline(always)]
pub(super) fn corner<R: Real>(u: [R::V; 3], first: &Stop<R::V>, second: &Stop<R::V>) -> Option<Corner<R::V>> {
    let all = |x: f64| R::V::all(R::of(x));
    let zero = all(0.0);
    let cosine = dot(first.normal, second.normal);
    let square = all(1.0) - cosine * cosine;
    let at = first.known.and(second.known).and(all(TOGETHER).below(cosine)).and(all(APART).below(square));
    if !at.any() {
        return None;
    }
    let free = sub(u, scale(first.normal, first.by));
    let a = first.allowed - dot(first.normal, free);
    let b = second.allowed - dot(second.normal, free);
    let inverse = all(1.0) / square.max(all(APART));
    let (both_a, both_b) = ((a - cosine * b) * inverse, (b - cosine * a) * inverse);
    // Where one of them would have to pull, the other is enough.
    let (only_a, only_b) = (both_b.at_most(zero), both_a.at_most(zero));
    let a = only_b.pick(zero, only_a.pick(a.max(zero), both_a));
    let b = only_a.pick(zero, only_b.pick(b.max(zero), both_b));
    let u = add(add(free, scale(first.normal, a)), scale(second.normal, b));
    Some(Corner { at, u, more: a - first.by, second: b })
}
