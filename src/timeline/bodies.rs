//! Walls and bodies as inputs of a step.

use super::{ColliderInput, Timeline};
use crate::collider::Collider;
use crate::load;
use crate::math::distance_grid::DistanceGrid;
use crate::math::sdf;
use crate::shape::{Pose, Shape};
use crate::stages::faces;
use crate::units::MARGIN;
use crate::world::World;
use glam::{DMat3, DQuat, DVec3};
use std::sync::Arc;

impl Timeline {
    pub(super) fn collider_input(&self, collider: &Collider, pose: &Pose, load: u32) -> ColliderInput {
        let dt = self.dt;
        let (shift, turn) = match &collider.motion {
            Some(_) => {
                let end = self.end_pose(collider, pose);
                let turn = end.rotation * pose.rotation.inverse();
                // A body that does not turn has exact zeros, without rounding.
                let turn = if end.rotation == pose.rotation { DQuat::IDENTITY } else { turn.normalize() };
                (self.units.way_in(end.position - pose.position), turn)
            }
            None => (
                self.units.velocity_in(collider.linear_velocity, dt),
                DQuat::from_scaled_axis(self.units.turn_in(collider.angular_velocity, dt)),
            ),
        };
        let input = ColliderInput {
            load,
            friction: collider.acting_boundary().coefficient(),
            shift,
            turn: DMat3::from_quat(turn) - DMat3::IDENTITY,
            ..self.body(&collider.shape, collider.inverted, pose)
        };
        ColliderInput { faces: faces::on_nodes(&input), ..input }
    }

    /// A frictionless body at rest.
    pub(super) fn body(&self, shape: &Shape, inverted: bool, pose: &Pose) -> ColliderInput {
        let (kind, size) = match *shape {
            Shape::Mesh(_) | Shape::Heightfield(_) => (sdf::GRID, DVec3::ZERO),
            Shape::Box { half_size } => (sdf::BOX, half_size),
            Shape::Sphere { radius } => (sdf::SPHERE, DVec3::splat(radius)),
            Shape::Capsule { radius, half_height } => (sdf::CAPSULE, DVec3::new(radius, half_height, radius)),
            Shape::Cylinder { radius, half_height } => (sdf::CYLINDER, DVec3::new(radius, half_height, radius)),
            Shape::HalfSpace => (sdf::HALF_SPACE, DVec3::ZERO),
        };
        let grid = shape.grid().and_then(|grid| {
            let known = |(_, known): &(usize, &Arc<DistanceGrid>)| Arc::ptr_eq(&known.values, &grid.values);
            self.grids.iter().enumerate().find(known)
        });
        ColliderInput {
            kind: if inverted { kind | sdf::INVERTED } else { kind },
            load: load::NONE,
            position: self.units.position_in(pose.position),
            size: grid.map_or(self.units.way_in(size), |(number, _)| DVec3::X * number as f64),
            grid: grid.map(|(_, grid)| grid.clone()),
            friction: 0.0,
            axes: DMat3::from_quat(pose.rotation.normalize()),
            shift: DVec3::ZERO,
            turn: DMat3::ZERO,
            faces: 0,
            joints: 0,
        }
    }
}

/// The domain's closed sides as half-spaces, and the mask of the open ones.
pub(super) fn sides(world: &World) -> (Vec<ColliderInput>, u32) {
    let extent = world.domain.extent_cells();
    let mut open = 0;
    let mut closed = Vec::new();
    for (axis, upper, wall, _) in world.domain.walls.sides() {
        let Some(boundary) = wall.boundary() else {
            open |= 1 << (2 * axis + usize::from(upper));
            continue;
        };
        // Exact, as a rotation computed from the normal would not be: nodes on a side are at a distance of 0 from it.
        let normal = DVec3::AXES[axis] * if upper { -1.0 } else { 1.0 };
        let across = DVec3::AXES[(axis + 2) % 3];
        let position = DVec3::splat(MARGIN) + if upper { extent } else { DVec3::ZERO };
        closed.push(ColliderInput {
            kind: sdf::HALF_SPACE,
            load: load::NONE,
            position,
            size: DVec3::ZERO,
            grid: None,
            friction: boundary.coefficient(),
            axes: DMat3::from_cols(across, normal, across.cross(normal)),
            shift: DVec3::ZERO,
            turn: DMat3::ZERO,
            faces: 0,
            joints: 0,
        });
    }
    (closed, open)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Motion;

    /// The motion in a step's input leads from the pose at its beginning to that at its end, scripted or not, for steps
    /// of any lengths.
    #[test]
    fn steps_lead_from_pose_to_pose() {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
        let steady = Collider {
            linear_velocity: DVec3::new(0.3, 0.1, -0.2),
            angular_velocity: DVec3::new(2.0, -1.0, 0.5),
            ..Collider::new(Shape::Sphere { radius: 0.1 }, DVec3::splat(0.5))
        };
        let still = Collider::new(Shape::Sphere { radius: 0.1 }, DVec3::splat(0.4));
        let rotation = DQuat::from_rotation_x(0.4);
        let oscillate = Motion::Oscillate {
            amplitude: DVec3::new(0.1, 0.2, 0.0),
            frequency: 1.5,
            phase: 0.1,
            angular_amplitude: DVec3::new(0.0, 2.0, 1.0),
        };
        let turns = [0.0, 1.5, 3.0].map(DQuat::from_rotation_z);
        let keyframes = |rotations: &[DQuat]| Motion::Keyframes {
            times: vec![0.05, 0.11, 0.3],
            positions: vec![DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1],
            rotations: rotations.to_vec(),
            repeat: false,
        };
        world.colliders = vec![
            steady,
            Collider { motion: Some(oscillate), rotation, ..still.clone() },
            Collider { motion: Some(keyframes(&turns)), rotation, ..still.clone() },
            Collider { motion: Some(keyframes(&[])), rotation, inverted: true, ..still },
        ];
        let mut timeline = Timeline::new(&world, &[]).unwrap();
        for (k, dt) in [0.01, 0.013, 0.002, 0.03].into_iter().cycle().take(30).enumerate() {
            timeline.set_dt(dt).unwrap();
            let (input, before) = (timeline.input(), timeline.now().poses.clone());
            timeline.advance(&input);
            let now = timeline.now();
            for (i, c) in input.colliders.iter().skip(6).enumerate() {
                let position = timeline.units.position_out(c.position + c.shift);
                assert!(position.distance(now.poses[i].position) < 1e-12, "body {i}, step {k}");
                let axes = (c.turn + DMat3::IDENTITY) * c.axes - DMat3::from_quat(now.poses[i].rotation);
                assert!(axes.to_cols_array().iter().all(|x| x.abs() < 1e-12), "body {i}, step {k}");
                assert!(i != 3 || c.turn == DMat3::ZERO, "what does not turn has no turn");
                if let Some(motion) = &world.colliders[i].motion {
                    let exact = motion.pose(&world.colliders[i].stated_pose(), now.time);
                    assert_eq!(exact, now.poses[i], "body {i}, step {k}");
                }
            }
            assert!(before != now.poses);
        }
        // A host's motion for a body ends its script, from where the body is.
        let at = timeline.now().poses[1];
        timeline.set_collider(1, None, DVec3::X, DVec3::ZERO).unwrap();
        let input = timeline.input();
        timeline.advance(&input);
        let moved = timeline.now().poses[1];
        assert!(moved.position.distance(at.position + DVec3::X * timeline.dt) < 1e-12);
        assert!(moved.rotation.angle_between(at.rotation) < 1e-7);
    }
}
