//! What contact does to the bodies whose load is asked for. Twin: `shaders/lib/load.wgsl`.

use crate::cpu::state::ColliderConstants;
use crate::load::{NONE, Running};
use crate::math::linear::{cross, scale, sub};
use crate::math::real::{Lanes, Real};
use std::sync::atomic::Ordering;

/// Largest part that is counted of one change, in units: far more than momentum there can be in a node.
const MOST: f64 = (1u64 << 62) as f64;

/// Notes that a body has changed the motion of points at `x` from `before` to `after`. `weight` is the points' mass, in units
/// of a load per displacement.
pub(super) fn note<R: Real>(
    loads: &[Running],
    c: &ColliderConstants<R::V>,
    x: [R::V; 3],
    before: [R::V; 3],
    after: [R::V; 3],
    weight: R::V,
) {
    if c.load == NONE {
        return;
    }
    let impulse = scale(sub(before, after), weight);
    let angular = cross(sub(x, c.position), impulse);
    for (sum, lanes) in loads[c.load as usize].iter().zip(impulse.into_iter().chain(angular)) {
        let total = lanes.to4().map(whole).into_iter().fold(0, i64::wrapping_add);
        sum.fetch_add(total as u64, Ordering::Relaxed);
    }
}

/// Notes that by a body a particle at `x` has got so much more of a displacement and of its gradient, whose moments of inertia are a quarter.
pub(super) fn note_lacking<R: Real>(
    loads: &[Running],
    c: &ColliderConstants<R::V>,
    x: [R; 4],
    u: &[R; 3],
    d: &[[R; 3]; 3],
    weight: R,
) {
    if c.load == NONE {
        return;
    }
    let lane = |v: R::V| v.to4()[0];
    let impulse = scale(*u, -weight);
    let spin = [d[1][2] - d[2][1], d[2][0] - d[0][2], d[0][1] - d[1][0]];
    let arm = sub([x[0], x[1], x[2]], c.position.map(lane));
    let angular = sub(cross(arm, impulse), scale(spin, R::of(0.25) * weight));
    for (sum, part) in loads[c.load as usize].iter().zip(impulse.into_iter().chain(angular)) {
        sum.fetch_add(whole(part) as u64, Ordering::Relaxed);
    }
}

/// The nearest whole number, the even one of two.
pub(super) fn whole<R: Real>(x: R) -> i64 {
    x.f64().round_ties_even().clamp(-MOST, MOST) as i64
}
