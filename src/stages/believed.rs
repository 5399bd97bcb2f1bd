//! Which measures of volume a particle believes. Twin: `shaders/lib/believed.wgsl`.
//!
//! Beside solids, more is: where a solid has come to liquid, or liquid to it, the two first meet on nodes that they share a cell apart, and a gap
//! would stay between them.
//!
//! Where there is more matter than a particle's volume ratio says, that is so. Where there is less, the particle may be at a
//! surface; only where the nodes around it hold about the same matter has come apart evenly, and it is believed.

use super::integrate::SHORTFALL;
use crate::math::real::Real;

/// What is taken off of what is believed beside solids. A volume ratio being 0.1 at least, less than ten is too little.
pub(crate) const BESIDE_SOLIDS: f64 = 16.0;

/// The volume `fraction` measured at a particle, of opposite sign where it is too little and believed nevertheless: where matter lies
/// evenly, which is asked for only then.
#[inline(always)]
pub(super) fn believed<R: Real>(fraction: R, ratio: R, even: impl FnOnce() -> bool) -> R {
    if is_too_little(fraction, ratio) && even() { -fraction } else { fraction }
}

/// The same where there are solids: less [`BESIDE_SOLIDS`] where they are the reason.
#[inline(always)]
pub(super) fn believed_beside<R: Real>(
    fraction: R,
    ratio: R,
    even: impl FnOnce() -> bool,
    beside: impl FnOnce(bool) -> bool,
) -> R {
    if !is_too_little(fraction, ratio) {
        return fraction;
    }
    let even = even();
    if beside(even) {
        -(fraction + R::of(BESIDE_SOLIDS))
    } else if even {
        -fraction
    } else {
        fraction
    }
}

#[inline(always)]
fn is_too_little<R: Real>(fraction: R, ratio: R) -> bool {
    fraction * ratio < R::of(1.0 - SHORTFALL)
}
