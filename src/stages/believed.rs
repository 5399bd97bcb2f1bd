//! Which measures of volume a particle believes. Twin: `shaders/lib/believed.wgsl`.
//!
//! Where there is more matter than a particle's volume ratio says, that is so. Where there is less, the particle may be at a
//! surface; only where the nodes around it hold about the same matter has come apart evenly, and it is believed. Nodes on walls of
//! the domain, behind which there is no matter, do not count.

use super::integrate::SHORTFALL;
use crate::bins::tile_index;
use crate::cpu::state::Constants;
use crate::math::real::Real;

/// How much of the fullest node the emptiest has to hold. Matter that has come apart and lies in disorder is not much evener.
pub(crate) const EVEN: f64 = 0.6;

/// The volume `fraction` measured at a particle, of opposite sign where it is too little and believed nevertheless. `volume` is what
/// a node of the tile holds, which begins at `origin`.
#[inline(always)]
pub(super) fn believed<R: Real>(
    fraction: R,
    ratio: R,
    first: [u32; 3],
    origin: [u32; 3],
    constants: &Constants<R>,
    volume: impl Fn(usize) -> R,
) -> R {
    let too_little = fraction * ratio < R::of(1.0 - SHORTFALL);
    if too_little && even(first, origin, constants, volume) { -fraction } else { fraction }
}

#[inline(always)]
fn even<R: Real>(first: [u32; 3], origin: [u32; 3], constants: &Constants<R>, volume: impl Fn(usize) -> R) -> bool {
    let nodes = |a: usize| inside(a, first[a], constants).map(|i| (first[a] - origin[a] + i) as usize);
    let (xs, ys, zs) = (nodes(0), nodes(1), nodes(2));
    let mut least = volume(tile_index(xs[0], ys[0], zs[0]));
    let mut most = least;
    for z in zs {
        for y in ys {
            for x in xs {
                let volume = volume(tile_index(x, y, z));
                least = least.min(volume);
                most = most.max(volume);
            }
        }
        if least < most * R::of(EVEN) {
            return false;
        }
    }
    true
}

/// Of an axis' three nodes those that do not lie on walls or behind them, repeated for the others; all where there are none.
#[inline(always)]
fn inside<R: Real>(axis: usize, first: u32, constants: &Constants<R>) -> [u32; 3] {
    let sides = constants.open_sides >> (2 * axis);
    let counts = |i: u32| {
        let node = R::of(f64::from(first + i));
        (sides & 1 != 0 || node - constants.lo[axis] >= R::of(0.5))
            && (sides & 2 != 0 || constants.hi[axis] - node >= R::of(0.5))
    };
    match [counts(0), counts(1), counts(2)] {
        [true, _, true] | [false, false, false] => [0, 1, 2],
        [true, middle, false] => [0, u32::from(middle), u32::from(middle)],
        [false, true, last] => [1, 1, 1 + u32::from(last)],
        [false, false, true] => [2, 2, 2],
    }
}
