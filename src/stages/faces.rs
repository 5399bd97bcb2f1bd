//! Before which faces of bodies a particle lies so that they hold nodes that it reaches: faces of boxes and half-spaces
//! at rest that go through nodes. Liquids see less of a strain across them than there is, as before the domain's sides
//! (see [`walls`](super::walls)). Twin: `shaders/lib/faces.wgsl`.
//!
//! The end of a step notes them for the next one, in 64ths beside the number of the particle's material: two bits for
//! each axis, [`ABOVE`] or [`BELOW`] the nearest nodes.

use super::collider_cull::TO_MIDDLE;
use super::contact::Near;
use super::walls::{FAR, ON_NODES};
use crate::cpu::constants::{ColliderConstants, Constants};
use crate::math::linear::{add, scale, sub};
use crate::math::real::{Lanes, Real};
use crate::math::sdf::{BOX, HALF_SPACE, INVERTED};
use crate::timeline::ColliderInput;
use glam::{DMat3, DVec3};

/// The nearest plane of nodes is a face, and the particle is above it.
pub(crate) const ABOVE: u32 = 1;
/// The same, and it is below.
pub(crate) const BELOW: u32 = 2;

/// How far a body's axes may be off those of the grid.
const SQUARE: f64 = 1e-6;

/// The faces of a body at rest that go through nodes: [`ABOVE`] and [`BELOW`] for each axis, where there is room on that
/// side of one.
pub(crate) fn on_nodes(body: &ColliderInput) -> u32 {
    let size = match body.kind & !INVERTED {
        BOX => body.size,
        HALF_SPACE => DVec3::ZERO,
        _ => return 0,
    };
    let axes = DMat3::from_cols_array(&body.axes.to_cols_array().map(f64::abs));
    let square = axes.to_cols_array().iter().all(|entry| *entry < SQUARE || (1.0 - entry).abs() < SQUARE);
    if !square || body.shift != DVec3::ZERO || body.turn != DMat3::ZERO {
        return 0;
    }
    let half = axes * size;
    let inverted = body.kind & INVERTED != 0;
    let on = |plane: f64| (plane - plane.round()).abs() <= ON_NODES;
    (0..3).fold(0, |faces, a| {
        let [above, below] = match body.kind & !INVERTED {
            BOX => [true; 2],
            _ => {
                let up = if inverted { -body.axes.y_axis[a] } else { body.axes.y_axis[a] };
                [up > 0.5, up < -0.5]
            }
        };
        let outward = if inverted { -half[a] } else { half[a] };
        let above = if above && on(body.position[a] + outward) { ABOVE } else { 0 };
        let below = if below && on(body.position[a] - outward) { BELOW } else { 0 };
        faces | (above | below) << (2 * a)
    })
}

/// A face that particles of a block may come to lie before.
pub(super) struct Face<R> {
    axis: usize,
    /// [`ABOVE`] or [`BELOW`].
    side: u32,
    /// Where it is along the axis, and its node there.
    at: R,
    node: R,
    /// How far the body reaches along all axes; `None` where a face has no end.
    extent: Option<[[R; 3]; 2]>,
}

/// The faces that particles of the block from the node `origin` on may come to lie before. `near` are the bodies that may
/// be in sight of it.
#[inline(always)]
pub(super) fn of_block<R: Real>(
    origin: [u32; 3],
    constants: &Constants<R>,
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
) -> Vec<Face<R>> {
    // A particle is put out of bodies by less than a cell.
    let reach = R::of(TO_MIDDLE + 1.5) + constants.max_displacement;
    let mut faces = Vec::new();
    for c in near.iter().map(|near| &colliders[near.collider]).filter(|c| c.faces != 0) {
        let lane = |v: [R::V; 3]| v.map(|v| v.to4()[0]);
        let [x_axis, y_axis, z_axis] = c.axes.map(|axis| lane(axis).map(R::abs));
        let [size, position] = [lane(c.size), lane(c.position)];
        let half = add(add(scale(x_axis, size[0]), scale(y_axis, size[1])), scale(z_axis, size[2]));
        let [lo, hi] = [sub(position, half), add(position, half)];
        let extent = (c.kind == BOX).then_some([lo, hi]);
        let [above, below] = if c.kind == BOX | INVERTED { [lo, hi] } else { [hi, lo] };
        for axis in 0..3 {
            let middle = R::of(f64::from(origin[axis])) + R::of(TO_MIDDLE);
            for (side, at) in [(ABOVE, above[axis]), (BELOW, below[axis])] {
                if c.faces >> (2 * axis) & side != 0 && (at - middle).abs() <= reach {
                    faces.push(Face { axis, side, at, node: node(at), extent });
                }
            }
        }
    }
    faces
}

/// What is noted for a particle at `x`.
#[inline(always)]
pub(super) fn beside<R: Real>(x: [R; 3], faces: &[Face<R>]) -> R {
    let nearest = x.map(node);
    let mut found = [0; 3];
    for &Face { axis: a, side, at, node, extent } in faces {
        let before = if side == ABOVE { at <= x[a] } else { x[a] <= at };
        let within = |b: usize| extent.is_none_or(|[lo, hi]| lo[b] <= x[b] && x[b] <= hi[b]);
        if node == nearest[a] && before && within((a + 1) % 3) && within((a + 2) % 3) {
            found[a] = side;
        }
    }
    R::of(f64::from(found[0] | found[1] << 2 | found[2] << 4) / 64.0)
}

/// The particle's distance along an axis from the face that is noted `beside` its material.
#[inline(always)]
pub(super) fn distance<R: Real>(axis: usize, x: R, beside: R) -> R {
    match (beside * R::of(64.0)).floor_index() >> (2 * axis) & (ABOVE | BELOW) {
        ABOVE => x - node(x),
        BELOW => node(x) - x,
        _ => R::of(FAR),
    }
}

/// The node nearest to a place.
#[inline(always)]
pub(super) fn node<R: Real>(x: R) -> R {
    R::of(f64::from((x + R::of(0.5)).floor_index()))
}
