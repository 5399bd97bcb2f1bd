//! The effect of viscosity on a displacement gradient. Twin: `shaders/lib/viscosity.wgsl`.

use crate::cpu::constants::{Constants, MaterialConstants};
use crate::cpu::gradient::Gradient;
use crate::math::real::Real;

/// Removes the share of the shear rate that viscosity removes in a step, at most all of it. An isolated particle loses
/// the whole share, smooth flow a small part of it, so that the share must be the explicit one: r/(1 + r) is a quarter
/// less at r = 1/3.
#[inline(always)]
pub fn viscosity<R: Real>(m: &MaterialConstants<R>, d: &mut Gradient<R>, constants: &Constants<R>) {
    let share = viscous_share(m, constants);
    if share > R::of(0.0) {
        take_shear(share, d);
    }
}

/// The share of its shear rate that an isolated particle loses in a step by viscosity that is not solved for.
#[inline(always)]
pub(super) fn viscous_share<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    (R::of(8.0) * m.viscosity * m.inverse_density * constants.seconds).min(R::of(1.0))
}

/// Removes a share of the shear rate.
#[inline(always)]
pub fn take_shear<R: Real>(share: R, d: &mut Gradient<R>) {
    let half = share * R::of(0.5);
    let mean = (d[0][0] + d[1][1] + d[2][2]) * R::of(1.0 / 3.0);
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let shear = half * (d[a][b] + d[b][a]);
        d[a][b] -= shear;
        d[b][a] -= shear;
    }
    for (i, column) in d.iter_mut().enumerate() {
        column[i] = column[i] - half * (column[i] + column[i]) + share * mean;
    }
}
