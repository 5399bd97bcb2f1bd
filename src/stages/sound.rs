//! Whether a particle's state is made of finite numbers. Twin: `shaders/lib/sound.wgsl`.
//!
//! Deformation gradients need no look: what they remember of stretches is bounded, and no host can write them.

use crate::cpu::state::Gradient;
use crate::math::real::{Lanes, Real};

/// Whether position, displacement and gradient are, with all that lies in their fourth lanes: zero times anything else is not zero.
#[inline(always)]
pub fn sound<R: Real>(x: &[R; 4], u: &[R; 4], d: &Gradient<R>) -> bool {
    let zero = R::V::all(R::of(0.0));
    let nothing = |lanes: &[R; 4]| R::V::from4(*lanes) * zero;
    let sum = (nothing(x) + nothing(u) + (nothing(&d[0]) + nothing(&d[1]) + nothing(&d[2]))).to4();
    sum[0] + sum[1] + sum[2] + sum[3] == R::of(0.0)
}
