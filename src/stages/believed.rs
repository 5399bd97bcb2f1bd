//! Which measures of volume a particle believes. Twin: `shaders/lib/believed.wgsl`.
//!
//! Where there is more matter than a particle's volume ratio says, that is so. Where there is less, the particle may be at a
//! surface; only where the nodes around it hold about the same matter has come apart evenly, and it is believed. Nodes on walls of
//! the domain, behind which there is no matter, do not count.

use super::integrate::MEASURE_MARGIN;
use crate::cpu::state::Constants;
use crate::math::kernel;
use crate::math::real::Real;

/// How much of the fullest node the emptiest has to hold. Where a surface is as near as that, the measure is too little by a few
/// hundredths, for which there is twice the margin; matter that has come apart and lies in disorder is not much evener.
const EVEN: f64 = 0.8;

/// The volume `fraction` measured at a particle, of opposite sign where it is too little and believed nevertheless. `volume` is what
/// the node at an offset from the first of the particle's nodes holds.
#[inline(always)]
pub(super) fn believed<R: Real>(
    fraction: R,
    position: &[R; 4],
    constants: &Constants<R>,
    volume: impl Fn([usize; 3]) -> R,
) -> R {
    let too_little = fraction * position[3] < R::of(1.0) - R::of(2.0 * MEASURE_MARGIN);
    if too_little && even(position, constants, volume) { -fraction } else { fraction }
}

#[inline(always)]
fn even<R: Real>(position: &[R; 4], constants: &Constants<R>, volume: impl Fn([usize; 3]) -> R) -> bool {
    // The nodes on each axis that do not lie on walls or behind them.
    let counts = [0, 1, 2].map(|a| {
        let (first, _) = kernel::base(position[a]);
        let sides = constants.open_sides >> (2 * a);
        [0, 1, 2].map(|i| {
            let node = R::of(f64::from(first + i));
            (sides & 1 != 0 || node - constants.lo[a] >= R::of(0.5))
                && (sides & 2 != 0 || constants.hi[a] - node >= R::of(0.5))
        })
    });
    // More than any node can hold.
    let (mut least, mut most) = (R::of(f64::from(u32::MAX)), R::of(0.0));
    for z in 0..3 {
        for y in 0..3 {
            for x in 0..3 {
                if counts[0][x] && counts[1][y] && counts[2][z] {
                    let volume = volume([x, y, z]);
                    least = least.min(volume);
                    most = most.max(volume);
                }
            }
        }
    }
    least >= most * R::of(EVEN)
}
