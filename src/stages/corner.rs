//! Nodes that are stopped by two bodies which meet at an angle. Twin: `shaders/lib/corner.wgsl`.
//!
//! If the bodies stop a node one after the other, it keeps a motion along the second that only the first has given it:
//! pressure in the corner would drive liquid out of it. So the amount that each of the two stops follows from the
//! motion before either has changed it.

use super::contact::{LEAST_SHARE, Resolved};
use crate::math::linear::{add, dot, scale, sub};
use crate::math::real::{Lanes, Real};

/// Cosine of the angle between the normals above which the bodies stop more together than one by one.
pub(crate) const TOGETHER: f64 = 1e-3;
/// Square of its sine below which they stop motion along the same line.
pub(crate) const APART: f64 = 1e-3;
/// The least change of motion, in cells, from which a normal is derived.
pub(crate) const LEAST_CHANGE: f64 = 1e-12;

/// The effect of a body without friction on points.
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

/// The effect of two bodies on points together.
pub(super) struct Corner<R: Real> {
    /// The points that both stop.
    at: R::V,
    /// The motion that both leave; for points that they do not stop together, the motion that the second leaves.
    pub left: [R::V; 3],
    /// Index of the first body among those in reach, and the motion that it leaves where it stops more than before.
    first: R::V,
    by_first: [R::V; 3],
}

impl<R: Real> Stop<R> {
    /// The effect of no body.
    pub fn none() -> Self {
        let none = R::V::all(R::of(0.0));
        Stop { known: none, normal: [none; 3], by: none, allowed: none, body: none }
    }

    /// The effect of a body that has changed the motion `before` of the points `touched` into `after`.
    #[inline(always)]
    fn of(body: usize, before: [R::V; 3], after: [R::V; 3], touched: R::V) -> Self {
        let all = |x: f64| R::V::all(R::of(x));
        let change = sub(after, before);
        let by = dot(change, change).sqrt();
        let least = (dot(after, after).sqrt() * all(LEAST_SHARE)).max(all(LEAST_CHANGE));
        let normal = scale(change, all(1.0) / by.max(all(LEAST_CHANGE)));
        Stop { known: touched.and(least.below(by)), normal, by, allowed: dot(normal, after), body: all(body as f64) }
    }

    /// Adds that `body` changes the motion `u` into `second`. For points that the two bodies stop together, `second`
    /// becomes the effect of that body alone, and the result holds the rest. `None` where there are no such points.
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
        // Where one of them would have to pull, the other acts alone.
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
    /// The effect of `body` on the motion `u` of the points where it was the first of the two.
    #[inline(always)]
    pub fn by_first(&self, body: usize, u: [R::V; 3]) -> Option<Resolved<R::V>> {
        let body = R::V::all(R::of(body as f64));
        let touched = self.at.and(self.first.at_most(body)).and(body.at_most(self.first));
        let by = [0, 1, 2].map(|a| touched.pick(self.by_first[a], u[a]));
        let stuck = R::V::all(R::of(0.0));
        touched.any().then_some(Resolved { u: by, touched, stuck, more: true })
    }
}
