//! Loads: what contact exerts on the bodies for which it is measured. Twin: `shaders/lib/load.wgsl`.

use crate::cpu::constants::ColliderConstants;
use crate::load::{NONE, Running};
use crate::math::linear::{cross, scale, sub};
use crate::math::real::{Lanes, Real};
use std::sync::atomic::Ordering;

/// Largest change that is counted, in units: far more than the momentum that a node can have.
pub(crate) const MOST_WHOLE: f64 = (1u64 << 62) as f64;

/// Adds to a body's load that it has changed the motion of points at `x` from `before` to `after`. `weight` is the
/// points' mass, in units of a load per displacement.
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

/// Adds to a body's load that it has changed the displacement and the gradient of a particle at `x` by these amounts.
/// The moments of inertia of a particle are a quarter of its mass.
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
    add_impulse(&loads[c.load as usize], impulse, angular);
}

/// Adds to the load of a body for which it is measured that it has taken the motion `taken` from a node at `x`; `weight`
/// as in [`note`].
pub(super) fn note_node<R: Real>(loads: &[Running], c: &ColliderConstants<R::V>, x: [R; 3], taken: [R; 3], weight: R) {
    let impulse = scale(taken, weight);
    let arm = sub(x, c.position.map(|v: R::V| v.to4()[0]));
    add_impulse(&loads[c.load as usize], impulse, cross(arm, impulse));
}

fn add_impulse<R: Real>(load: &Running, impulse: [R; 3], angular: [R; 3]) {
    for (sum, part) in load.iter().zip(impulse.into_iter().chain(angular)) {
        sum.fetch_add(whole(part) as u64, Ordering::Relaxed);
    }
}

/// The nearest whole number; of two, the even one.
pub(super) fn whole<R: Real>(x: R) -> i64 {
    x.f64().round_ties_even().clamp(-MOST_WHOLE, MOST_WHOLE) as i64
}
