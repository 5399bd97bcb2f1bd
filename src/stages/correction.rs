//! What particles beside a clamp see of a strain, and what makes up for it. Twins: `shaders/lib/correction.wgsl`, `shaders/lib/corrected.wgsl`.
//!
//! Nodes in a body that holds what is inside move with it. Between them and the first that are free the kernel smears the motion, so that of a
//! strain along the body's normal n particles there see only the share r: matter gives way as if it were held a quarter of a cell or more inside.
//! So what they gather is multiplied by C = 1 + m mᵀ with m = n √(1/r − 1), and, one being the transpose of the other, the stress that they
//! scatter too.

use super::contact::{FIXED, Near, distance_normal_after};
use crate::cpu::state::{ColliderConstants, Gradient};
use crate::math::kernel::Stencil;
use crate::math::linear::{add, dot, scale, transform};
use crate::math::real::{Lanes, Real};
use crate::math::sdf;

/// From how near to a clamp on particles look at its nodes, in cells.
pub(crate) const SIGHT: f64 = 1.5;
/// The least share that is made up for in full: with less, a particle by itself just before a node would be too stiff for the explicit scheme.
/// On a plane it is above a third.
pub(crate) const LEAST_SEEN: f64 = 0.5;

/// The m of a particle at `x`: zero where it sees all, inside a clamp, and beside one that turns, whose turning is no strain.
#[inline(always)]
pub(super) fn correction<R: Real>(x: [R; 3], colliders: &[ColliderConstants<R::V>], near: &[Near<R>]) -> [R; 3] {
    let [zero, one] = [0.0, 1.0].map(R::of);
    let at = x.map(R::V::all);
    let mut nearest = (R::of(SIGHT), None);
    for clamp in near.iter().map(|near| &colliders[near.collider]).filter(|c| is_clamp::<R>(c)) {
        let (distance, normal) = distance_normal_after::<R>(clamp, at);
        let distance = distance.to4()[0];
        if distance < zero {
            return [zero; 3];
        }
        if distance < nearest.0 {
            nearest = (distance, Some((clamp, normal)));
        }
    }
    let (distance, Some((clamp, normal))) = nearest else { return [zero; 3] };
    let seen = seen::<R>(x, distance, clamp, normal);
    if seen >= one {
        return [zero; 3];
    }
    let size = (one / seen.max(R::of(LEAST_SEEN)) - one).sqrt();
    normal.map(|n| n.to4()[0] * size)
}

/// Whether it is a clamp that does not turn. Only what is convex holds.
#[inline(always)]
fn is_clamp<R: Real>(c: &ColliderConstants<R::V>) -> bool {
    if sdf::is_inverted(c.kind) || sdf::is_grid(c.kind) {
        return false;
    }
    let turn = [c.turn[0][1], c.turn[0][2], c.turn[1][2]].map(|entry| entry.to4()[0]);
    c.friction.to4()[0] >= R::of(FIXED) && turn.iter().all(|entry| *entry == R::of(0.0))
}

/// The share of a strain along the normal that a particle at `away` from a clamp sees: that of the strain of matter whose motion is the distance
/// from the clamp, zero inside and behind it, as the nodes have it. All where none of its nodes is held.
#[inline(always)]
fn seen<R: Real>(x: [R; 3], away: R, clamp: &ColliderConstants<R::V>, normal: [R::V; 3]) -> R {
    let stencil = Stencil::at([x[0], x[1], x[2], R::of(0.0)]);
    let [wx, wy, wz] = [0, 1, 2].map(|a| stencil.along(a));
    let node = |a: usize, n: u32| R::of(f64::from(stencil.first[a] + n));
    let along_x = [0, 1, 2, 2].map(|n| node(0, n));
    let zero = R::V::all(R::of(0.0));
    let (mut sum, mut least) = (R::of(0.0), R::V::all(R::of(SIGHT)));
    for k in 0..3 {
        for j in 0..3 {
            let at = [R::V::from4(along_x), R::V::all(node(1, j)), R::V::all(node(2, k))];
            let way = [0, 1, 2].map(|a| at[a] - R::V::all(x[a]));
            let along = dot(way, normal);
            let distance = distance_normal_after::<R>(clamp, at).0;
            least = least.min(distance);
            let before = zero.below(along + R::V::all(away)).and(zero.below(distance));
            let [a, b, c, _] = (before.pick(distance, zero) * along).to4();
            let (j, k) = (j as usize, k as usize);
            sum += (wz[k] * wy[j]) * (a * wx[0] + b * wx[1] + c * wx[2]);
        }
    }
    let held = least.at_most(zero).any();
    if held { R::of(4.0) * sum } else { R::of(1.0) }
}

/// The matrix of these columns times C − 1.
#[inline(always)]
pub(super) fn missed<R: Real>(columns: &[[R; 3]; 3], m: [R; 3]) -> [[R; 3]; 3] {
    let along = transform(columns, m);
    m.map(|m| scale(along, m))
}

/// The matrix of these columns times C.
#[inline(always)]
pub(super) fn corrected<R: Real>(columns: &[[R; 3]; 3], m: [R; 3]) -> [[R; 3]; 3] {
    let missed = missed(columns, m);
    [0, 1, 2].map(|b| add(columns[b], missed[b]))
}

/// The same of a displacement gradient.
#[inline(always)]
pub(super) fn corrected_gradient<R: Real>(d: &Gradient<R>, m: [R; 3]) -> Gradient<R> {
    let columns = corrected(&d.map(|c| [c[0], c[1], c[2]]), m);
    [0, 1, 2].map(|b| [columns[b][0], columns[b][1], columns[b][2], d[b][3]])
}

/// Where a particle keeps its m: the fourth lanes of its deformation gradient, which sand alone has another use for.
#[inline(always)]
pub(super) fn kept<R: Real>(deformation: &Gradient<R>) -> [R; 3] {
    [0, 1, 2].map(|column| deformation[column][3])
}
