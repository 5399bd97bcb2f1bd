//! What solids beside a clamp, and liquids beside what they stick to, see of a strain, and what makes up for it. Twins:
//! `shaders/lib/correction.wgsl`, `shaders/lib/corrected.wgsl`.
//!
//! Nodes that a body holds move with it. Between them and the first that are free the kernel smears the motion, so that of a
//! strain along the body's normal n particles there see only the share r: matter gives way as if it were held a quarter of a cell or more inside.
//! So what they gather is multiplied by C = 1 + (1/r − 1) n nᵀ, kept as m = n √(1/r − 1), and, one being the transpose of the other, the stress that they
//! scatter too.

use super::contact::{FIXED, Near, STICKING, STUCK, distance_normal_after};
use crate::cpu::state::{ColliderConstants, Constants, Gradient};
use crate::math::kernel::Stencil;
use crate::math::linear::{add, dot, scale, sub, transform};
use crate::math::real::{Lanes, Real};
use crate::math::sdf;
use crate::math::symmetric::Symmetric;

/// From how near to the last nodes that a body may hold on particles look at them, in cells.
pub(crate) const SIGHT: f64 = 1.5;
/// The least share that is made up for in full: with less, a particle by itself just before a node would be too stiff for the explicit scheme.
/// On a plane it is above a third.
pub(crate) const LEAST_SEEN: f64 = 0.5;
/// The most that is seen of a strain: beside nodes that are held before a surface some see more than there is.
pub(crate) const MOST_SEEN: f64 = 1.5;
/// Of such particles the square of m is what is to be taken off, and this.
pub(crate) const TOO_MUCH: f64 = 2.0;
/// Of the others it is less than this.
pub(crate) const NOT_ALL: f64 = 1.5;

/// What makes up for what a particle does not see.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction<R> {
    /// Zero where it sees all.
    pub m: [R; 3],
    /// What the turning of the body brings to D m in a step, which is no strain.
    pub turned: [R; 3],
}

/// Of a particle at `x`: none inside a body. Solids are beside clamps that do not turn, liquids beside all they stick to.
#[inline(always)]
pub(super) fn correction<R: Real>(
    x: [R; 3],
    liquid: bool,
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
) -> Correction<R> {
    let [zero, one] = [0.0, 1.0].map(R::of);
    let none = Correction { m: [zero; 3], turned: [zero; 3] };
    let at = x.map(R::V::all);
    let mut nearest = (R::of(if liquid { SIGHT + STUCK } else { SIGHT }), None);
    let holds = |c: &&ColliderConstants<R::V>| if liquid { sticks::<R>(c) } else { is_clamp::<R>(c) };
    for body in near.iter().map(|near| &colliders[near.collider]).filter(holds) {
        let (distance, normal) = distance_normal_after::<R>(body, at);
        let distance = distance.to4()[0];
        if distance < zero {
            return none;
        }
        if distance < nearest.0 {
            nearest = (distance, Some((body, normal)));
        }
    }
    let (distance, Some((body, normal))) = nearest else { return none };
    let seen = seen::<R>(x, distance, body, normal);
    let size = if seen < one {
        one / seen.max(R::of(LEAST_SEEN)) - one
    } else if liquid && seen > one {
        R::of(TOO_MUCH) + (one - one / seen.min(R::of(MOST_SEEN)))
    } else {
        return none;
    };
    let size = size.sqrt();
    let m = normal.map(|n| n.to4()[0] * size);
    Correction { m, turned: transform(&body.turn.map(|column| column.map(|entry| entry.to4()[0])), m) }
}

/// Whether liquids stick to it.
#[inline(always)]
fn sticks<R: Real>(c: &ColliderConstants<R::V>) -> bool {
    c.friction.to4()[0] >= R::of(STICKING)
}

/// Whether it holds what is inside. Only what is convex does.
#[inline(always)]
fn holds_inside<R: Real>(c: &ColliderConstants<R::V>) -> bool {
    !sdf::is_inverted(c.kind) && !sdf::is_grid(c.kind) && c.friction.to4()[0] >= R::of(FIXED)
}

/// Whether it does so and does not turn.
#[inline(always)]
fn is_clamp<R: Real>(c: &ColliderConstants<R::V>) -> bool {
    let turn = [c.turn[0][1], c.turn[0][2], c.turn[1][2]].map(|entry| entry.to4()[0]);
    holds_inside::<R>(c) && turn.iter().all(|entry| *entry == R::of(0.0))
}

/// The share of a strain along the normal that a particle at `away` from a body sees: that of the strain of matter whose motion is the distance
/// from the body, zero at and behind the nodes that it holds. All where none of its nodes is held.
#[inline(always)]
fn seen<R: Real>(x: [R; 3], away: R, body: &ColliderConstants<R::V>, normal: [R::V; 3]) -> R {
    let stencil = Stencil::at([x[0], x[1], x[2], R::of(0.0)]);
    let [wx, wy, wz] = [0, 1, 2].map(|a| stencil.along(a));
    let node = |a: usize, n: u32| R::of(f64::from(stencil.first[a] + n));
    let along_x = [0, 1, 2, 2].map(|n| node(0, n));
    let zero = R::V::all(R::of(0.0));
    let stuck = R::V::all(R::of(if holds_inside::<R>(body) { 0.0 } else { STUCK }));
    let (mut sum, mut least) = (R::of(0.0), R::V::all(R::of(SIGHT)));
    for k in 0..3 {
        for j in 0..3 {
            let at = [R::V::from4(along_x), R::V::all(node(1, j)), R::V::all(node(2, k))];
            let way = [0, 1, 2].map(|a| at[a] - R::V::all(x[a]));
            let along = dot(way, normal);
            let distance = distance_normal_after::<R>(body, at).0;
            least = least.min(distance);
            let before = zero.below(along + R::V::all(away)).and(stuck.below(distance));
            let [a, b, c, _] = (before.pick(distance, zero) * along).to4();
            let (j, k) = (j as usize, k as usize);
            sum += (wz[k] * wy[j]) * (a * wx[0] + b * wx[1] + c * wx[2]);
        }
    }
    let held = least.at_most(stuck).any();
    if held { R::of(4.0) * sum } else { R::of(1.0) }
}

/// What makes m mᵀ of this square of m C − 1.
#[inline(always)]
fn weight<R: Real>(square: R) -> R {
    let too_much = R::of(TOO_MUCH);
    if square < R::of(NOT_ALL) { R::of(1.0) } else { (too_much - square) * (R::of(1.0) / square) }
}

/// By how many times more than seen a strain along the normal is.
#[inline(always)]
pub(super) fn times_seen<R: Real>(m: [R; 3]) -> R {
    let square = dot(m, m);
    R::of(1.0) + weight(square) * square
}

/// The matrix of these columns times C − 1.
#[inline(always)]
pub(super) fn missed<R: Real>(columns: &[[R; 3]; 3], m: [R; 3]) -> [[R; 3]; 3] {
    weighted_outer(transform(columns, m), m)
}

/// The columns of v mᵀ by the weight of m.
#[inline(always)]
fn weighted_outer<R: Real>(v: [R; 3], m: [R; 3]) -> [[R; 3]; 3] {
    let weight = weight(dot(m, m));
    m.map(|m| scale(v, m * weight))
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

/// Notes the same, and of a liquid, which has no other use for the rest, what the body's turning brings.
#[inline(always)]
pub(super) fn keep<R: Real>(deformation: &mut Gradient<R>, liquid: bool, next: Correction<R>) {
    deformation.iter_mut().zip(next.m).for_each(|(column, m)| column[3] = m);
    if liquid {
        deformation[0][..3].copy_from_slice(&next.turned);
    }
}

/// The columns (D m − what the body's turning brings) mᵀ: what a liquid misses of the gradient `d`.
#[inline(always)]
pub(super) fn missed_by_liquid<R: Real>(
    d: &[[R; 3]; 3],
    deformation: &Gradient<R>,
    constants: &Constants<R>,
) -> [[R; 3]; 3] {
    let m = kept(deformation);
    weighted_outer(sub(transform(d, m), turned(deformation, constants)), m)
}

/// What the body's turning brings to the strain that a liquid misses, which is to be left in it.
#[inline(always)]
pub(super) fn turned_strain<R: Real>(deformation: &Gradient<R>, constants: &Constants<R>) -> Symmetric<R> {
    Symmetric::deviator(&weighted_outer(turned(deformation, constants), kept(deformation)))
}

/// What the body's turning brings to a liquid's D m, noted in the step before, which may have been of another length.
#[inline(always)]
fn turned<R: Real>(deformation: &Gradient<R>, constants: &Constants<R>) -> [R; 3] {
    let [x, y, z, _] = deformation[0];
    scale([x, y, z], constants.rescale)
}
