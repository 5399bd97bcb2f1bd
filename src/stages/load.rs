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

/// The nearest whole number, the even one of two.
pub(super) fn whole<R: Real>(x: R) -> i64 {
    x.f64().round_ties_even().clamp(-MOST, MOST) as i64
}
