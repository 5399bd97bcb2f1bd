//! How evenly matter lies around a particle: what the emptiest of its 27 nodes holds of what the fullest does. Twin:
//! `shaders/lib/even.wgsl`.
//!
//! Near 1 deep inside matter in order, 0.5 to 0.6 in disorder, near 0 at a surface. Nodes on walls of the domain, behind which there
//! is no matter, do not count.

use crate::bins::tile_index;
use crate::cpu::state::Constants;
use crate::math::real::Real;

/// From what share of the fullest node in the emptiest on matter counts as even. What has come apart and lies in disorder is not much
/// evener.
pub(crate) const EVEN: f64 = 0.6;

/// The least and the most that the nodes of a stencil hold which begins at `first`. `held` is what a node of the tile does, which
/// begins at `origin`.
#[inline(always)]
pub(super) fn extremes<R: Real>(
    first: [u32; 3],
    origin: [u32; 3],
    constants: &Constants<R>,
    held: impl Fn(usize) -> R,
) -> [R; 2] {
    let nodes = |a: usize| inside(a, first[a], constants).map(|i| (first[a] - origin[a] + i) as usize);
    let (xs, ys, zs) = (nodes(0), nodes(1), nodes(2));
    let mut least = held(tile_index(xs[0], ys[0], zs[0]));
    let mut most = least;
    for z in zs {
        for y in ys {
            for x in xs {
                let held = held(tile_index(x, y, z));
                least = least.min(held);
                most = most.max(held);
            }
        }
    }
    [least, most]
}

/// Whether matter with these extremes lies evenly.
#[inline(always)]
pub(super) fn is_even<R: Real>([least, most]: [R; 2]) -> bool {
    least >= most * R::of(EVEN)
}

/// How evenly, 0 … 1.
#[inline(always)]
pub(super) fn evenness<R: Real>([least, most]: [R; 2]) -> R {
    least * (R::of(1.0) / most.max(R::of(NOTHING)))
}

/// Less than any node holds that a particle has added to.
pub(crate) const NOTHING: f64 = 1e-30;

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
