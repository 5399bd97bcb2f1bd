//! How much of a strain solids beside a clamp, and liquids beside bodies that they stick to, see, and how the rest is
//! compensated. Twins: `shaders/lib/correction.wgsl`, `shaders/lib/corrected.wgsl`.
//!
//! Nodes that a body holds move with it. Between them and the first free nodes the kernel smears the motion, so that of
//! a strain along the body's normal n particles there see only the share r: matter gives way as if it were held a
//! quarter of a cell or more inside. So the gradient that they gather is multiplied by C = 1 + (1/r − 1) n nᵀ, stored
//! as m = n √(1/r − 1), and so is the stress that they scatter, since one operator is the transpose of the other. For
//! liquids, whose walls exert the missing stress themselves (`drag`), each of the two makes up for half of it, with
//! 1/√r for 1/r, and only in the solve. What liquids gather at the step's end is completed by the motion that the nodes
//! inside would have if motion were proportional to the distance from the body.

use super::contact::{FIXED, Near, STICKING, distance_normal_after};
use super::matter::ON_SURFACE;
use crate::cpu::constants::{ColliderConstants, Constants};
use crate::cpu::gradient::Gradient;
use crate::math::kernel::{KERNEL_REACH, Stencil};
use crate::math::linear::{add, dot, scale, sub, transform};
use crate::math::real::{Lanes, Real};
use crate::math::symmetric::Symmetric;

/// The least share that is compensated in full: a lower bound would make an isolated particle just before a node too
/// stiff for the explicit scheme. On a plane the share is above a third.
pub(crate) const LEAST_SEEN: f64 = 0.5;
/// The same for liquids, where strain and stress make up for half of it each.
pub(crate) const LEAST_SEEN_BY_LIQUIDS: f64 = 0.3;

/// Share from which nothing is corrected.
pub(crate) const ALL_SEEN: f64 = 0.99999;

/// Compensates for the part of a strain that a particle does not see.
#[derive(Debug, Clone, Copy)]
pub(super) struct Correction<R> {
    /// Index of the body.
    pub body: usize,
    /// Zero where the particle sees all of a strain.
    pub m: [R; 3],
    /// The part of D m that comes from the rotation of the body in a step, which is no strain.
    pub turned: [R; 3],
    /// The change of a liquid's motion along the body, per D m of it.
    pub ahead: R,
    /// The part that its gradient lacks, per D m of it.
    pub lacks: [R; 3],
}

/// The correction for a particle at `x`; none inside a body. Solids are corrected beside clamps that do not turn,
/// liquids beside all bodies that they stick to.
#[inline(always)]
pub(super) fn correction<R: Real>(
    x: [R; 3],
    liquid: bool,
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
) -> Correction<R> {
    let [zero, one] = [0.0, 1.0].map(R::of);
    let none = Correction { body: 0, m: [zero; 3], turned: [zero; 3], ahead: zero, lacks: [zero; 3] };
    let at = x.map(R::V::all);
    // Particles nearer than this reach nodes that a body holds.
    let mut nearest = (R::of(KERNEL_REACH), None);
    let holds = |c: &ColliderConstants<R::V>| if liquid { sticks::<R>(c) } else { is_clamp::<R>(c) };
    for body in near.iter().map(|near| near.collider).filter(|body| holds(&colliders[*body])) {
        let (distance, normal) = distance_normal_after::<R>(&colliders[body], at);
        let distance = distance.to4()[0];
        if distance < zero {
            return none;
        }
        if distance < nearest.0 {
            nearest = (distance, Some((body, normal)));
        }
    }
    let (distance, Some((index, normal))) = nearest else { return none };
    let body = &colliders[index];
    let Seen { share, behind, slope } = seen::<R>(x, distance, body, normal);
    if share >= R::of(ALL_SEEN) {
        return none;
    }
    let makes_up =
        if liquid { one / share.max(R::of(LEAST_SEEN_BY_LIQUIDS)).sqrt() } else { one / share.max(R::of(LEAST_SEEN)) };
    let size = (makes_up - one).sqrt();
    let m = normal.map(|n| n.to4()[0] * size);
    let turned = transform(&body.turn.map(|column| column.map(|entry| entry.to4()[0])), m);
    let per_rate = makes_up * makes_up * (one / size);
    Correction { body: index, m, turned, ahead: behind * per_rate, lacks: scale(slope, per_rate) }
}

/// Whether liquids stick to the body.
#[inline(always)]
fn sticks<R: Real>(c: &ColliderConstants<R::V>) -> bool {
    c.friction.to4()[0] >= R::of(STICKING)
}

/// Whether it holds what is inside.
#[inline(always)]
fn holds_inside<R: Real>(c: &ColliderConstants<R::V>) -> bool {
    c.friction.to4()[0] >= R::of(FIXED)
}

/// Whether it does so and does not turn.
#[inline(always)]
fn is_clamp<R: Real>(c: &ColliderConstants<R::V>) -> bool {
    let turn = [c.turn[0][1], c.turn[0][2], c.turn[1][2]].map(|entry| entry.to4()[0]);
    holds_inside::<R>(c) && turn.iter().all(|entry| *entry == R::of(0.0))
}

/// What a particle sees of a motion that equals the distance from a body.
struct Seen<R> {
    /// The share of a strain along the normal. 1 where none of the particle's nodes is held.
    share: R,
    /// The weighted sum of the heights of the held nodes over the body's surface; they are not positive.
    behind: R,
    /// What these heights would add to the gradient of the distance.
    slope: [R; 3],
}

/// What a particle at the distance `away` from a body sees if the nodes at and behind its surface move with it.
#[inline(always)]
fn seen<R: Real>(x: [R; 3], away: R, body: &ColliderConstants<R::V>, normal: [R::V; 3]) -> Seen<R> {
    let stencil = Stencil::at([x[0], x[1], x[2], R::of(0.0)]);
    let [wx, wy, wz] = [0, 1, 2].map(|a| stencil.along(a));
    let node = |a: usize, n: u32| R::of(f64::from(stencil.first[a] + n));
    let along_x = [0, 1, 2, 2].map(|n| node(0, n));
    let [zero, on] = [0.0, ON_SURFACE].map(|x| R::V::all(R::of(x)));
    let (mut sum, mut behind, mut least) = (R::of(0.0), R::of(0.0), R::V::all(R::of(KERNEL_REACH)));
    let mut slope = [R::of(0.0); 3];
    for k in 0..3 {
        for j in 0..3 {
            let at = [R::V::from4(along_x), R::V::all(node(1, j)), R::V::all(node(2, k))];
            let way = [0, 1, 2].map(|a| at[a] - R::V::all(x[a]));
            let along = dot(way, normal);
            let distance = distance_normal_after::<R>(body, at).0;
            least = least.min(distance);
            let height = along + R::V::all(away);
            let before = zero.below(height).and(on.below(distance));
            let weight = wz[k as usize] * wy[j as usize];
            let row = |of: R::V| {
                let [a, b, c, _] = of.to4();
                weight * (a * wx[0] + b * wx[1] + c * wx[2])
            };
            sum += row(before.pick(distance, zero) * along);
            let lacking = on.below(distance).pick(zero, height);
            behind += row(lacking);
            (0..3).for_each(|a| slope[a] += row(lacking * way[a]));
        }
    }
    let held = least.at_most(on).any();
    Seen { share: if held { R::of(4.0) * sum } else { R::of(1.0) }, behind, slope: scale(slope, R::of(4.0)) }
}

/// The matrix with these columns times C − 1.
#[inline(always)]
pub(super) fn missed<R: Real>(columns: &[[R; 3]; 3], m: [R; 3]) -> [[R; 3]; 3] {
    outer(transform(columns, m), m)
}

/// The columns of v mᵀ.
#[inline(always)]
fn outer<R: Real>(v: [R; 3], m: [R; 3]) -> [[R; 3]; 3] {
    m.map(|m| scale(v, m))
}

/// The matrix with these columns times C.
#[inline(always)]
pub(super) fn corrected<R: Real>(columns: &[[R; 3]; 3], m: [R; 3]) -> [[R; 3]; 3] {
    let missed = missed(columns, m);
    [0, 1, 2].map(|b| add(columns[b], missed[b]))
}

/// The same for a displacement gradient.
#[inline(always)]
pub(super) fn corrected_gradient<R: Real>(d: &Gradient<R>, m: [R; 3]) -> Gradient<R> {
    let columns = corrected(&d.map(|c| [c[0], c[1], c[2]]), m);
    [0, 1, 2].map(|b| [columns[b][0], columns[b][1], columns[b][2], d[b][3]])
}

/// The m of a particle: stored in the fourth lanes of its deformation gradient, which only sand uses otherwise.
#[inline(always)]
pub(super) fn kept<R: Real>(deformation: &Gradient<R>) -> [R; 3] {
    [0, 1, 2].map(|column| deformation[column][3])
}

/// Stores m, and for a liquid, which has no other use for the deformation gradient, the rest as well.
#[inline(always)]
pub(super) fn keep<R: Real>(deformation: &mut Gradient<R>, liquid: bool, next: Correction<R>) {
    deformation.iter_mut().zip(next.m).for_each(|(column, m)| column[3] = m);
    if liquid {
        deformation[0][..3].copy_from_slice(&next.turned);
        deformation[1][..3].copy_from_slice(&[next.ahead, R::of(next.body as f64), R::of(0.0)]);
        deformation[2][..3].copy_from_slice(&next.lacks);
    }
}

/// What held nodes withhold from a liquid, of its gradient (by columns) and of its displacement, and the body that
/// holds them.
pub(super) struct Lacking<R> {
    pub d: [[R; 3]; 3],
    pub u: [R; 3],
    pub body: usize,
}

/// The part of a liquid's motion along the body that held nodes withhold, if it gathers the gradient `d`.
#[inline(always)]
pub(super) fn lacking<R: Real>(
    d: &Gradient<R>,
    deformation: &Gradient<R>,
    constants: &Constants<R>,
) -> Option<Lacking<R>> {
    let m = kept(deformation);
    let square = dot(m, m);
    if square <= R::of(0.0) {
        return None;
    }
    let columns = d.map(|c| [c[0], c[1], c[2]]);
    let rate = sub(transform(&columns, m), turned(deformation, constants));
    let rate = sub(rate, scale(m, dot(rate, m) * (R::of(1.0) / square)));
    let [_, [ahead, body, ..], [x, y, z, _]] = *deformation;
    Some(Lacking { d: outer(rate, [x, y, z]), u: scale(rate, ahead), body: body.floor_index() as usize })
}

/// The contribution of the body's rotation to the strain that a liquid misses, which must stay in it.
#[inline(always)]
pub(super) fn turned_strain<R: Real>(deformation: &Gradient<R>, constants: &Constants<R>) -> Symmetric<R> {
    Symmetric::deviator(&outer(turned(deformation, constants), kept(deformation)))
}

/// The contribution of the body's rotation to a liquid's D m, stored in the step before, which may have had another
/// length.
#[inline(always)]
fn turned<R: Real>(deformation: &Gradient<R>, constants: &Constants<R>) -> [R; 3] {
    let [x, y, z, _] = deformation[0];
    scale([x, y, z], constants.rescale)
}
