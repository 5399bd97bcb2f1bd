//! Nodes that are stopped by more than the nearest side of a body. Twin: `shaders/lib/sides.wgsl`.

use super::contact::{Friction, LEAST_SHARE, Resolved, rubbed};
use super::matter::ON_SURFACE;
use super::seam::Seam;
use crate::cpu::constants::ColliderConstants;
use crate::math::kernel::KERNEL_REACH;
use crate::math::linear::{add, dot, scale, sub, transform, transform_transposed};
use crate::math::real::{Lanes, Real};
use crate::math::sdf;

/// A point inside a body is held by each side that is deeper than the nearest by at most this, in cells.
pub const EDGE_REACH: f64 = 0.5;

/// Nodes that are stopped by more than the nearest side of a body.
pub(super) struct Beside<V> {
    /// Their positions in the body's frame.
    at: [V; 3],
    /// Which of them are within `reach` of more than one side, or at a seam.
    held: V,
    /// Largest depth below a side at which it holds them.
    reach: V,
    seam: Seam<V>,
}

/// Which nodes are stopped by more than the nearest side: those inside by sides that are not much deeper, those at a
/// seam by all sides that kernels reach.
#[inline(always)]
pub(super) fn beside<R: Real>(
    c: &ColliderConstants<R::V>,
    at: [R::V; 3],
    distance: R::V,
    seam: Seam<R::V>,
) -> Option<Beside<R::V>> {
    let inside = distance.below(R::V::all(R::of(-ON_SURFACE)));
    if sdf::walls(c.kind) < 2 || !(inside.any() || seam.between.any()) {
        return None;
    }
    let reach = R::V::all(R::of(EDGE_REACH)) - distance;
    let far = R::V::all(R::of(f32::MAX.into()));
    let (mut nearest, mut second) = (far, far);
    for side in 0..sdf::walls(c.kind) {
        let (depth, _) = sdf::wall_distance_normal::<R>(c.kind, side, c.size, at);
        second = second.min(nearest.max(depth));
        nearest = nearest.min(depth);
    }
    let held = inside.and(second.at_most(reach));
    let held = seam.between.pick(seam.between, held);
    let reach = seam.between.pick(R::V::all(R::of(KERNEL_REACH)), reach);
    held.any().then_some(Beside { at, held, reach, seam })
}

/// For nodes that the nearest side has stopped up to a remaining gap, their motions `relative` to the body, also
/// stopped by the other sides within their reach. By the nearest side alone, liquid that presses on a face would escape
/// past its edges, half a cell all around. At a seam, where there is no gap, enclosed nodes are held in all directions.
#[inline(never)]
pub(super) fn resolve_sides<R: Real>(
    c: &ColliderConstants<R::V>,
    beside: &Beside<R::V>,
    gap: R::V,
    relative: [R::V; 3],
    friction: Friction,
) -> Resolved<R::V> {
    let zero = R::V::all(R::of(0.0));
    let &Beside { at, held, reach, seam: Seam { between, enclosed } } = beside;
    let gap = between.pick(zero, gap);
    let mut relative = transform_transposed(&c.axes, relative);
    let least = dot(relative, relative).sqrt() * R::V::all(R::of(LEAST_SHARE));
    let mut touched = zero.below(zero);
    for side in 0..sdf::walls(c.kind) {
        let (depth, inward) = sdf::wall_distance_normal::<R>(c.kind, side, c.size, at);
        let along = dot(relative, inward);
        let stopped = along - gap;
        let hit = held.and(depth.at_most(reach)).and(least.below(stopped));
        if !hit.any() {
            continue;
        }
        let tangent = rubbed::<R>(c, sub(relative, scale(inward, along)), stopped, friction);
        let kept = add(tangent, scale(inward, gap));
        relative = [0, 1, 2].map(|a| hit.pick(kept[a], relative[a]));
        touched = hit.pick(hit, touched);
    }
    let relative = transform(&c.axes, relative).map(|axis| enclosed.pick(zero, axis));
    Resolved { u: relative, touched: enclosed.pick(enclosed, touched), stuck: enclosed, more: false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::contact::STICKING;
    use crate::timeline::ColliderInput;
    use glam::{DMat3, DQuat, DVec3};

    /// What the sides of a box turned by `degrees` leave of a motion, in the box's frame, of a node in it near an edge
    /// that the nearest side, along x, has stopped.
    fn left<R: Real>(degrees: f64, friction: f64, motion: DVec3) -> DVec3 {
        let axes =
            DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), degrees.to_radians()));
        let input = ColliderInput {
            kind: sdf::BOX,
            load: 0,
            position: DVec3::ZERO,
            size: DVec3::splat(2.0),
            grid: None,
            friction,
            axes,
            shift: DVec3::ZERO,
            turn: DMat3::ZERO,
            faces: 0,
            joints: 0,
        };
        let lanes = |x: f64| R::V::all(R::of(x));
        let vector = |v: DVec3| v.to_array().map(lanes);
        let c = ColliderConstants::new(&input, lanes);
        let none = lanes(0.0).below(lanes(0.0));
        let seam = Seam { between: none, enclosed: none };
        let sides = beside::<R>(&c, vector(DVec3::new(1.8, 1.7, 0.0)), lanes(-0.2), seam).expect("near two sides");
        let made = resolve_sides::<R>(&c, &sides, lanes(0.0), vector(axes * motion), Friction::Full);
        axes.transpose() * DVec3::from_array(made.u.map(|lanes| lanes.to4()[0].f64()))
    }

    /// A node that sticks to neither side goes on along the other side, up to rounding.
    #[test]
    fn what_a_rounding_presses_on_holds_nothing() {
        for degrees in 0..180 {
            for friction in [0.5, 2.0 * STICKING] {
                let out = DVec3::X * 0.1;
                let [free, pressed] =
                    [out, out - DVec3::Y * 1e-3].map(|motion| left::<f32>(f64::from(degrees), friction, motion));
                assert!((free - out).length() < 1e-6, "{degrees}°, friction {friction}: {free}");
                let slower = out * (1.0 - friction.min(100.0) * 1e-2);
                assert!((pressed - slower).length() < 1e-6, "{degrees}°, friction {friction}: {pressed}");
            }
        }
    }
}
