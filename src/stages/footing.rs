//! How meshes stand on other bodies. Twin: `shaders/lib/footing.wgsl`.
//!
//! A mesh is represented by interpolated distances, which round its edges by about half of the grid's spacing. Where it
//! stands on a floor, that leaves a wedge beneath its edge, through which liquid would creep under it. Points there
//! query the mesh from a place as far off the floor as the rounding reaches.

use super::contact::{Near, distance_normal_before};
use crate::cpu::constants::ColliderConstants;
use crate::math::linear::{add, scale};
use crate::math::real::{Lanes, Real};

/// Distance from other bodies at which a mesh is queried, in spacings of its grid: as far as its edges are rounded.
pub(crate) const ROUNDED: f64 = 0.5;

/// The upper bound of that distance, in cells; other bodies farther off are ignored.
pub(crate) const FARTHEST_OFF: f64 = 1.0;

/// The most by which a query point is shifted for that, in spacings: twice as far along each axis, and rounded up.
pub(crate) const MOVED: f64 = 1.74 * (2.0 * ROUNDED);

/// The places, in the world, from which points at `x` query the mesh `near[mesh]`; `None` if all do so from where they
/// are.
#[inline(always)]
pub(super) fn off_others<R: Real>(
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    mesh: usize,
    spacing: f64,
    x: [R::V; 3],
) -> Option<[R::V; 3]> {
    let all = |x: f64| R::V::all(R::of(x));
    let off = all((ROUNDED * spacing).min(FARTHEST_OFF));
    let (zero, most) = (all(0.0), off + off);
    let mut by = None;
    for (n, other) in near.iter().enumerate() {
        if n == mesh || !other.within(x, off) {
            continue;
        }
        let (distance, normal) = distance_normal_before::<R>(&colliders[other.collider], x);
        let moved = scale(normal, (off - distance).max(zero).min(most));
        by = Some(by.map_or(moved, |by| add(by, moved)));
    }
    by.map(|by| add(x, by.map(|axis| axis.max(-most).min(most))))
}
