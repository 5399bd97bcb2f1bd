//! Which measured densities a particle believes (accepts, so that they change its volume ratio J). Twin:
//! `shaders/lib/believed.wgsl`.
//!
//! An excess over what the volume ratio says is always believed. A deficit may only mean that the particle is at a
//! surface: it is believed where the nodes around the particle hold about the same mass, since matter there has come
//! apart evenly, and of a liquid where it lies loosely: where no side of the particle lacks much more than the other.
//! Without the latter, what a splash throws together stays a foam.
//!
//! Beside solids more deficits are believed: a solid and a liquid that approach each other first meet on shared nodes
//! while still a cell apart, and a gap would stay between them.

use super::integrate::SHORTFALL;
use crate::math::real::Real;

/// Subtracted from a deficit that is believed because of solids. Since a volume ratio is at least 0.1, every deficit is
/// a fraction below ten, so the two cases stay distinct.
pub(crate) const BESIDE_SOLIDS: f64 = 16.0;

/// The same for one that is believed because matter lies loosely.
pub(crate) const LOOSE: f64 = 32.0;

/// The volume `fraction` measured at a particle, negated if it is a deficit that is believed: where matter lies evenly,
/// or, less [`LOOSE`], loosely for what it lacks. Both are evaluated only for deficits.
#[inline(always)]
pub(super) fn believed<R: Real>(
    fraction: R,
    ratio: R,
    even: impl FnOnce() -> bool,
    loose: impl FnOnce(R) -> bool,
) -> R {
    if !is_too_little(fraction, ratio) {
        fraction
    } else if even() {
        -fraction
    } else if loose(R::of(1.0) - fraction * ratio) {
        -(fraction + R::of(LOOSE))
    } else {
        fraction
    }
}

/// As [`believed`] in worlds with solids: [`BESIDE_SOLIDS`] is subtracted as well where they are the reason.
#[inline(always)]
pub(super) fn believed_beside<R: Real>(
    fraction: R,
    ratio: R,
    even: impl FnOnce() -> bool,
    loose: impl FnOnce(R) -> bool,
    beside: impl FnOnce(bool) -> bool,
) -> R {
    if !is_too_little(fraction, ratio) {
        return fraction;
    }
    let even = even();
    if beside(even) { -(fraction + R::of(BESIDE_SOLIDS)) } else { believed(fraction, ratio, || even, loose) }
}

#[inline(always)]
fn is_too_little<R: Real>(fraction: R, ratio: R) -> bool {
    fraction * ratio < R::of(1.0 - SHORTFALL)
}
