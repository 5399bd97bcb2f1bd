//! Which measures of volume a particle believes. Twin: `shaders/lib/believed.wgsl`.
//!
//! Where there is more matter than a particle's volume ratio says, that is so. Where there is less, the particle may be at a
//! surface; only where the nodes around it hold about the same matter has come apart evenly, and it is believed.

use super::integrate::SHORTFALL;
use crate::math::real::Real;

/// The volume `fraction` measured at a particle, of opposite sign where it is too little and believed nevertheless: where matter lies
/// evenly, which is asked for only then.
#[inline(always)]
pub(super) fn believed<R: Real>(fraction: R, ratio: R, even: impl FnOnce() -> bool) -> R {
    let too_little = fraction * ratio < R::of(1.0 - SHORTFALL);
    if too_little && even() { -fraction } else { fraction }
}
