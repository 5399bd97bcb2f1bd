//! Which measures of volume a particle believes. Twin: `shaders/lib/believed.wgsl`.
//!
//! Where there is more matter than a particle's volume ratio says, that is so. Where there is less, the particle may be at a
//! surface; only where the nodes around it hold about the same matter has come apart evenly, and it is believed. Nodes on walls of
//! the domain, behind which there is no matter, do not count.

use super::integrate::SHORTFALL;
use crate::bins::tile_index;
use crate::cpu::state::Constants;
use crate::math::kernel;
use crate::math::real::Real;

/// How much of the fullest node the emptiest has to hold. Matter that has come apart and lies in disorder is not much evener.
pub(crate) const EVEN: f64 = 0.6;

/// The volume `fraction` measured at a particle, of opposite sign where it is too little and believed nevertheless. `volume` is what
/// a node of the tile holds, which begins at `origin`.
#[inline(always)]
pub(super) fn believed<R: Real>(
    fraction: R,
    position: &[R; 4],
    origin: [u32; 3],
    constants: &Constants<R>,
    volume: impl Fn(usize) -> R,
) -> R {
    let too_little = fraction * position[3] < R::of(1.0 - SHORTFALL);
    if too_little && even(position, origin, constants, volume) { -fraction } else { fraction }
}

#[inline(always)]
fn even<R: Real>(position: &[R; 4], origin: [u32; 3], constants: &Constants<R>, volume: impl Fn(usize) -> R) -> bool {
    let first = [0, 1, 2].map(|a| kernel::base(position[a]).0);
    // The nodes on each axis that do not lie on walls or behind them.
    let counts = [0, 1, 2].map(|a| {
        let sides = constants.open_sides >> (2 * a);
        [0, 1, 2].map(|i| {
            let node = R::of(f64::from(first[a] + i));
            (sides & 1 != 0 || node - constants.lo[a] >= R::of(0.5))
                && (sides & 2 != 0 || constants.hi[a] - node >= R::of(0.5))
        })
    });
    let [x0, y0, z0] = [0, 1, 2].map(|a| (first[a] - origin[a]) as usize);
    // More than any node can hold.
    let (mut least, mut most) = (R::of(f64::from(u32::MAX)), R::of(0.0));
    for z in 0..3 {
        for y in 0..3 {
            for x in 0..3 {
                if counts[0][x] && counts[1][y] && counts[2][z] {
                    let volume = volume(tile_index(x0 + x, y0 + y, z0 + z));
                    least = least.min(volume);
                    most = most.max(volume);
                }
            }
        }
    }
    least >= most * R::of(EVEN)
}
