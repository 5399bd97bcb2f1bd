//! How bodies that viscous liquids stick to brake the nodes before them. Twin: `shaders/lib/drag.wgsl`.
//!
//! Nodes inside move with the body. Nodes before it are braked by the wall's shear stress η u/d on their part of its
//! surface. Where the motion is u/d times the distance from the body, that stress supplies at a node at d what is
//! missing because the particles' own stress ends at the surface.

use super::compliance::viscous_stiffness;
use super::contact::{Near, STICKING, distance_normal_before, motion};
use super::matter::ON_SURFACE;
use super::solid::LIQUID;
use super::viscosity::viscous_share;
use crate::cpu::constants::{ColliderConstants, Constants, MaterialConstants};
use crate::math::kernel::{KERNEL_REACH, share_before};
use crate::math::linear::{dot, scale, sub};
use crate::math::real::{Lanes, Real};

/// The largest share of a motion that is removed: the solve divides by the remainder.
pub(crate) const MOST_BRAKED: f64 = 0.999;

/// The kinematic viscosity with which bodies drag, in cells² per step: the largest of the liquids', up to the largest
/// that a step accounts for.
pub(crate) fn wall_viscosity<R: Real>(materials: &[MaterialConstants<R>], constants: &Constants<R>) -> R {
    let liquids = materials.iter().filter(|m| m.model == LIQUID);
    let times = liquids.map(|m| viscous_share(m, constants).max(viscous_stiffness(m, constants)));
    times.fold(R::of(0.0), R::max) * R::of(0.125)
}

/// The effect of a body on four points.
pub(super) struct Braked<V> {
    /// The share of their motion along the body that it removes; 0 where it is too far away.
    pub share: V,
    /// Its normal there.
    pub normal: [V; 3],
    /// Its index in `near`.
    pub body: [usize; 4],
    /// Their displacement afterwards.
    pub u: [V; 3],
}

/// The braking of nodes at `x` by the nearest body that they stick to.
#[inline(never)]
pub(super) fn braked<R: Real>(
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    x: [R::V; 3],
    u: [R::V; 3],
    viscosity: R,
) -> Option<Braked<R::V>> {
    let zero = R::V::all(R::of(0.0));
    // Nodes up to this distance from a body have a part of its surface.
    let reach = R::V::all(R::of(KERNEL_REACH));
    let (mut distance, mut normal, mut of_body) = (reach, [zero; 3], [zero; 3]);
    let mut body = [0; 4];
    for (i, near) in near.iter().enumerate().filter(|(_, near)| near.within(x, reach)) {
        let collider = &colliders[near.collider];
        if collider.friction.to4()[0] < R::of(STICKING) {
            continue;
        }
        let (to, away) = distance_normal_before::<R>(collider, x);
        let nearer = to.below(distance);
        let moved = motion::<R>(collider, x);
        distance = nearer.pick(to, distance);
        normal = [0, 1, 2].map(|a| nearer.pick(away[a], normal[a]));
        of_body = [0, 1, 2].map(|a| nearer.pick(moved[a], of_body[a]));
        body.iter_mut().zip(nearer.lanes()).filter(|(_, nearer)| *nearer).for_each(|(body, _)| *body = i);
    }
    let beside = R::V::all(R::of(ON_SURFACE)).below(distance).and(distance.below(reach));
    if !beside.any() {
        return None;
    }
    let share = beside.pick(taken::<R>(distance, viscosity), zero);
    let relative = sub(u, of_body);
    let tangent = sub(relative, scale(normal, dot(relative, normal)));
    let kept = sub(u, scale(tangent, share));
    Some(Braked { share, normal, body, u: kept })
}

/// The share of its motion along a wall at a distance d that a node loses in a step, by implicit Euler: ν a/(ν a + d
/// v). With the quadratic B-spline N, the node's part of the wall is a = 4 ∫ N(z) z dz from d on, and that of the
/// matter before it is v = ∫ N(z) dz from −d on (`share_before`).
#[inline(always)]
fn taken<R: Real>(d: R::V, viscosity: R) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    let (square, rest) = (d * d, all(KERNEL_REACH) - d);
    let far = rest * (rest * rest) * (all(0.25) + all(0.5) * d);
    let wall = all(0.5).below(d).pick(far, all(0.8125) - square * (all(1.5) - square));
    let wall = wall * R::V::all(viscosity);
    (wall * (all(1.0) / (wall + d * share_before::<R>(d)))).min(all(MOST_BRAKED))
}
