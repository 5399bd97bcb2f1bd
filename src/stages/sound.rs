//! Whether a particle's state is made of finite numbers, or why there is none. Twin: `shaders/lib/sound.wgsl`.
//!
//! Deformation gradients are not checked: steps write bounded values, snapshots are checked when they are loaded, and
//! `bin_insert` has no storage buffer left for them beside the other arrays. A host must write finite ones.

use crate::cpu::gradient::Gradient;
use crate::cpu::state::{DRAINED, ESCAPED, QUARANTINED, VACANT};
use crate::math::real::{Lanes, Real};

/// Whether the fourth lane of a position tells why there is no particle, rather than being a volume ratio.
#[inline(always)]
pub(super) fn is_fate<R: Real>(ratio: R) -> bool {
    ratio <= R::of(0.0) && [VACANT, ESCAPED, QUARANTINED, DRAINED].map(R::of).contains(&ratio)
}

/// Whether position, displacement and gradient are finite, with their fourth lanes: zero times an infinite number or
/// NaN is not zero.
#[inline(always)]
pub fn sound<R: Real>(x: &[R; 4], u: &[R; 4], d: &Gradient<R>) -> bool {
    let zero = R::V::all(R::of(0.0));
    let nothing = |lanes: &[R; 4]| R::V::from4(*lanes) * zero;
    let sum = (nothing(x) + nothing(u) + (nothing(&d[0]) + nothing(&d[1]) + nothing(&d[2]))).to4();
    sum[0] + sum[1] + sum[2] + sum[3] == R::of(0.0)
}

/// The same for four particles, with their fields by lanes.
#[inline(always)]
pub(super) fn sound_lanes<R: Real>(fields: [[R::V; 4]; 5]) -> [bool; 4] {
    let zero = R::V::all(R::of(0.0));
    let nothing = |[a, b, c, d]: [R::V; 4]| (a * zero + b * zero) + (c * zero + d * zero);
    let [x, u, d, e, f] = fields;
    (nothing(x) + nothing(u) + (nothing(d) + nothing(e) + nothing(f))).at_most(zero).lanes()
}
