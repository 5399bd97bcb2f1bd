//! What viscosity takes from a displacement gradient. Twin: `shaders/lib/viscosity.wgsl`.

use super::correction::{corrected, kept, missed_by_liquid, times_seen};
use crate::cpu::state::{Constants, Gradient, MaterialConstants};
use crate::math::linear::{add, dot, scale, sub};
use crate::math::real::Real;
use crate::math::symmetric::Symmetric;

/// Takes from the shear rate what viscosity takes in a step, at most all of it. An isolated particle loses the whole share, smooth flow a
/// small part of it, so that the share has to be the explicit one: r/(1 + r) is a quarter less at r = 1/3. `wall` is, of a liquid beside
/// what it sticks to, what it keeps of that.
#[inline(always)]
pub fn viscosity<R: Real>(
    m: &MaterialConstants<R>,
    d: &mut Gradient<R>,
    wall: Option<&Gradient<R>>,
    constants: &Constants<R>,
) {
    let times = R::of(8.0) * m.viscosity * m.inverse_density * constants.seconds;
    if times <= R::of(0.0) {
        return;
    }
    let share = times.min(R::of(1.0));
    match wall.filter(|wall| dot(kept(wall), kept(wall)) > R::of(0.0)) {
        Some(wall) => take_shear_beside(wall, share, d, constants),
        None => take_shear(share, d),
    }
}

/// Takes a share off the shear rate of a liquid beside what it sticks to, with what it misses of it, at most what a particle by itself has.
#[inline(always)]
fn take_shear_beside<R: Real>(wall: &Gradient<R>, share: R, d: &mut Gradient<R>, constants: &Constants<R>) {
    let (one, m) = (R::of(1.0), kept(wall));
    let columns = d.map(|c| [c[0], c[1], c[2]]);
    let missed = missed_by_liquid(&columns, wall, constants);
    let shear = Symmetric::deviator(&[0, 1, 2].map(|b| add(columns[b], missed[b])));
    // Along the wall it counts once as it is seen and once as it acts.
    let times = times_seen(m);
    let share = share.min(R::of(2.0) * (one / (one + times * times)));
    let taken = corrected(&shear.columns(), m);
    for (b, column) in d.iter_mut().enumerate() {
        column[..3].copy_from_slice(&sub(columns[b], scale(taken[b], share)));
    }
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
