//! Nodes that two bodies stop which meet at an angle. Twin: `shaders/lib/corner.wgsl`.
//!
//! Stopped by the one and then by the other, a node keeps a motion along the second that the first has given it, and that nothing asked for:
//! pressure in the corner would drive liquid out of it. What each of two has to stop follows from the motion that neither has changed.

use super::contact::{LEAST_SHARE, Resolved};
use crate::math::linear::{add, dot, scale, sub};
use crate::math::real::{Lanes, Real};

/// Cosine of the angle between normals from which on bodies stop more together than one by one.
const TOGETHER: f64 = 1e-3;
/// Square of its sine below which they stop along the same line.
const APART: f64 = 1e-3;
/// The least change, cells, that tells a normal.
const LEAST: f64 = 1e-12;

/// What a body without friction has stopped of points.
pub(super) struct Stop<R: Real> {
    /// Which points it has stopped.
    known: R::V,
    normal: [R::V; 3],
    /// By how much.
    by: R::V,
    /// The least motion along the normal that it allows.
    allowed: R::V,
    /// Its place among those in reach.
    body: R::V,
}

/// What two bodies make of points together.
pub(super) struct Corner<R: Real> {
    /// Of which points.
    at: R::V,
    /// What both leave of the motion, and of points that they do not stop together what the second does.
    pub left: [R::V; 3],
    /// The first one's place among those in reach, and what it leaves where it stops more than before.
    first: R::V,
    by_first: [R::V; 3],
}

impl<R: Real> Stop<R> {
    /// Of nobody.
    pub fn none() -> Self {
        let none = R::V::all(R::of(0.0));
        Stop { known: none, normal: [none; 3], by: none, allowed: none, body: none }
    }

    /// Of a body that has made `after` of the motion `before` of those `touched`.
    #[inline(always)]
    fn of(body: usize, before: [R::V; 3], after: [R::V; 3], touched: R::V) -> Self {
        let all = |x: f64| R::V::all(R::of(x));
        let change = sub(after, before);
        let by = dot(change, change).sqrt();
        let least = (dot(after, after).sqrt() * all(LEAST_SHARE)).max(all(LEAST));
        let normal = scale(change, all(1.0) / by.max(all(LEAST)));
        Stop { known: touched.and(least.below(by)), normal, by, allowed: dot(normal, after), body: all(body as f64) }
    }

    /// Takes in that `body` makes `second` of the motion `u`; of points that the two stop together, `second` becomes what is by that body, and
    /// the answer says the rest. `None` where there are no such points.
    #[inline(always)]
    pub fn meet(&mut self, body: usize, u: [R::V; 3], second: &mut Resolved<R::V>) -> Option<Corner<R>> {
        let stop = Stop::of(body, u, second.u, second.touched);
        let corner = self.together(u, &stop, second);
        let pick = |a: R::V, b: R::V| stop.known.pick(a, b);
        *self = Stop {
            known: pick(stop.known, self.known),
            normal: [0, 1, 2].map(|a| pick(stop.normal[a], self.normal[a])),
            by: pick(stop.by, self.by),
            allowed: pick(stop.allowed, self.allowed),
            body: pick(stop.body, self.body),
        };
        corner
    }

    /// See [`meet`](Self::meet).
    #[inline(always)]
    fn together(&self, u: [R::V; 3], second: &Self, resolved: &mut Resolved<R::V>) -> Option<Corner<R>> {
        let all = |x: f64| R::V::all(R::of(x));
        let zero = all(0.0);
        let cosine = dot(self.normal, second.normal);
        let square = all(1.0) - cosine * cosine;
        let at = self.known.and(second.known).and(all(TOGETHER).below(cosine)).and(all(APART).below(square));
        if !at.any() {
            return None;
        }
        let free = sub(u, scale(self.normal, self.by));
        let a = self.allowed - dot(self.normal, free);
        let b = second.allowed - dot(second.normal, free);
        let inverse = all(1.0) / square.max(all(APART));
        let (both_a, both_b) = ((a - cosine * b) * inverse, (b - cosine * a) * inverse);
        // Where one of them would have to pull, the other is enough.
        let (only_a, only_b) = (both_b.at_most(zero), both_a.at_most(zero));
        let a = only_b.pick(zero, only_a.pick(a.max(zero), both_a));
        let b = only_a.pick(zero, only_b.pick(b.max(zero), both_b));
        let pick = |a: [R::V; 3], b: [R::V; 3]| [0, 1, 2].map(|i| at.pick(a[i], b[i]));
        let left = add(add(free, scale(self.normal, a)), scale(second.normal, b));
        let corner = Corner {
            at,
            left: pick(left, resolved.u),
            first: self.body,
            by_first: pick(add(u, scale(self.normal, a - self.by)), u),
        };
        resolved.u = pick(add(u, scale(second.normal, b)), resolved.u);
        Some(corner)
    }
}

impl<R: Real> Corner<R> {
    /// What `body` makes of the motion `u` of the points of which it was the first.
    #[inline(always)]
    pub fn by_first(&self, body: usize, u: [R::V; 3]) -> Option<Resolved<R::V>> {
        let body = R::V::all(R::of(body as f64));
        let touched = self.at.and(self.first.at_most(body)).and(body.at_most(self.first));
        let by = [0, 1, 2].map(|a| touched.pick(self.by_first[a], u[a]));
        let stuck = R::V::all(R::of(0.0));
        touched.any().then_some(Resolved { u: by, touched, stuck, more: true })
    }
}
