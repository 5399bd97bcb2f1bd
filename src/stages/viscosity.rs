//! What viscosity takes from a displacement gradient. Twin: `shaders/lib/viscosity.wgsl`.

use crate::cpu::state::{Constants, Gradient, MaterialConstants};
use crate::math::real::Real;

/// Takes from the shear rate what viscosity takes in a step, at most all of it. An isolated particle loses the whole share, smooth flow a
/// small part of it, so that the share has to be the explicit one: r/(1 + r) is a quarter less at r = 1/3.
#[inline(always)]
pub fn viscosity<R: Real>(m: &MaterialConstants<R>, d: &mut Gradient<R>, constants: &Constants<R>) {
    let share = viscous_share(m, constants);
    if share > R::of(0.0) {
        take_shear(share, d);
    }
}

/// The share of its shear rate that viscosity which is not solved for takes from a particle by itself in a step.
#[inline(always)]
pub(super) fn viscous_share<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    (R::of(8.0) * m.viscosity * m.inverse_density * constants.seconds).min(R::of(1.0))
}

/// Takes a share off the shear rate.
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
