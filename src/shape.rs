//! Solid shapes with a pose, shared by colliders and spawns.

use crate::error::{Check, Result};
use crate::math::distance_grid::DistanceGrid;
use crate::mesh::{Heightfield, Mesh};
use glam::{DMat3, DQuat, DVec2, DVec3};

/// The largest length accepted anywhere in a world, m.
pub(crate) const MAX_LENGTH: f64 = 1e6;

/// A shape in its own frame, centred at the origin.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum Shape {
    /// A cuboid.
    Box {
        /// Half the edge lengths, m.
        #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
        half_size: DVec3,
    },
    /// A ball.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A cylinder with a half ball on both ends, along the local y axis.
    Capsule {
        /// Radius of cylinder and balls, m.
        radius: f64,
        /// Half the distance between the balls' centres, m: the capsule is `2 · (half_height + radius)` long.
        half_height: f64,
    },
    /// A solid cylinder along the local y axis, with flat ends.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half the distance between the ends, m.
        half_height: f64,
    },
    /// Everything below the plane through the origin whose outward normal is the local +y axis.
    HalfSpace,
    /// A solid bounded by triangles.
    Mesh(Mesh),
    /// Ground with a height for each point of a grid.
    Heightfield(Heightfield),
}

impl Shape {
    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        let length =
            |name: &str, value| check.range(name, value, f64::MIN_POSITIVE, MAX_LENGTH, "above 0, at most 1e6 m");
        match *self {
            Shape::Box { half_size } => {
                check.vector("box.half_size", half_size, MAX_LENGTH, "finite, at most 1e6 m")?;
                check.that(
                    half_size.min_element() > 0.0,
                    "box.half_size",
                    half_size.to_array(),
                    "above 0 m on each axis",
                )
            }
            Shape::Sphere { radius } => length("sphere.radius", radius),
            Shape::Capsule { radius, half_height } => {
                length("capsule.radius", radius)?;
                length("capsule.half_height", half_height)
            }
            Shape::Cylinder { radius, half_height } => {
                length("cylinder.radius", radius)?;
                length("cylinder.half_height", half_height)
            }
            Shape::HalfSpace => Ok(()),
            Shape::Mesh(ref mesh) => mesh.validate(&format!("{path}.mesh")),
            Shape::Heightfield(ref field) => field.validate(&format!("{path}.heightfield")),
        }
    }

    /// Reads a mesh or heightfield that a scene only names, and builds its distance grid; returns whether the shape is
    /// one. `path` is the shape's.
    #[cfg(feature = "scene")]
    pub(crate) fn build(&mut self, path: &str, folder: Option<&std::path::Path>, cell_size: f64) -> Result<bool> {
        match self {
            Shape::Mesh(mesh) => mesh.build(&format!("{path}.mesh"), folder, cell_size)?,
            Shape::Heightfield(field) => field.build(&format!("{path}.heightfield"), folder, cell_size)?,
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Whether both are meshes, or heightfields, with equal statements in a scene.
    #[cfg(feature = "snapshot")]
    pub(crate) fn is_stated_as(&self, other: &Shape) -> bool {
        match (self, other) {
            (Shape::Mesh(a), Shape::Mesh(b)) => a.is_stated_as(b),
            (Shape::Heightfield(a), Shape::Heightfield(b)) => a.is_stated_as(b),
            _ => false,
        }
    }

    /// The distance grid that represents a shape of triangles.
    pub(crate) fn grid(&self) -> Option<&DistanceGrid> {
        match self {
            Shape::Mesh(mesh) => mesh.grid(),
            Shape::Heightfield(field) => field.grid(),
            _ => None,
        }
    }

    /// Signed distance in the shape's own frame, m; negative inside. For meshes and heightfields it is interpolated on
    /// their grids; far from these it is a lower bound.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        match *self {
            Shape::Box { half_size } => {
                let q = p.abs() - half_size;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
            }
            Shape::Sphere { radius } => p.length() - radius,
            Shape::Capsule { radius, half_height } => {
                let on_axis = DVec3::Y * p.y.max(-half_height).min(half_height);
                (p - on_axis).length() - radius
            }
            Shape::Cylinder { radius, half_height } => {
                let q = DVec2::new(p.x.hypot(p.z) - radius, p.y.abs() - half_height);
                q.max(DVec2::ZERO).length() + q.max_element().min(0.0)
            }
            Shape::HalfSpace => p.y,
            Shape::Mesh(ref mesh) => mesh.signed_distance(p),
            Shape::Heightfield(ref field) => field.signed_distance(p),
        }
    }

    /// Half the edges of the smallest box around the origin of the shape's own frame that holds it, m; `None` for an
    /// unbounded shape.
    pub fn half_extent(&self) -> Option<DVec3> {
        match *self {
            Shape::Box { half_size } => Some(half_size),
            Shape::Sphere { radius } => Some(DVec3::splat(radius)),
            Shape::Capsule { radius, half_height } => Some(DVec3::new(radius, half_height + radius, radius)),
            Shape::Cylinder { radius, half_height } => Some(DVec3::new(radius, half_height, radius)),
            Shape::HalfSpace => None,
            Shape::Mesh(ref mesh) => Some(mesh.half_extent()),
            Shape::Heightfield(ref field) => Some(field.half_extent()),
        }
    }

    /// The speed of the point farthest from the middle, m/s, from the speeds of the middle, m/s, and of turning, rad/s.
    pub(crate) fn outermost(&self, [linear, angular]: [f64; 2]) -> f64 {
        linear + angular * self.half_extent().map_or(0.0, DVec3::length)
    }

    /// The half extent of the turned shape along the world's axes.
    pub(crate) fn half_extent_turned(&self, rotation: DQuat) -> Option<DVec3> {
        self.half_extent().map(|half| turned(rotation.normalize(), half))
    }
}

/// Half the edges of the smallest box along the world's axes around one that is turned.
pub(crate) fn turned(rotation: DQuat, half: DVec3) -> DVec3 {
    let axes = DMat3::from_quat(rotation);
    axes.x_axis.abs() * half.x + axes.y_axis.abs() * half.y + axes.z_axis.abs() * half.z
}

/// Where a shape is and how it is turned.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub struct Pose {
    /// Position of the shape's origin, m.
    pub position: DVec3,
    /// Rotation from the shape's frame to the world.
    pub rotation: DQuat,
}

impl Pose {
    /// Where a point of the world is in the shape's frame, in which [`Shape::signed_distance`] takes it, m.
    pub fn local(&self, point: DVec3) -> DVec3 {
        unit(self.rotation).inverse() * (point - self.position)
    }

    /// The pose after turning by `angular_velocity · dt` about its own centre and moving by `linear_velocity · dt`.
    #[must_use]
    pub fn advanced(&self, linear_velocity: DVec3, angular_velocity: DVec3, dt: f64) -> Pose {
        let turn = DQuat::from_scaled_axis(angular_velocity * dt);
        Pose { position: self.position + linear_velocity * dt, rotation: (turn * self.rotation).normalize() }
    }
}

#[cfg(feature = "scene")]
pub(crate) fn no_rotation() -> DQuat {
    DQuat::IDENTITY
}

/// A rotation that may be off length 1 by more than rounding, which would stretch what it turns.
pub(crate) fn unit(rotation: DQuat) -> DQuat {
    if (rotation.length_squared() - 1.0).abs() > 1e-12 { rotation.normalize() } else { rotation }
}

pub(crate) fn validate_rotation(check: &Check<'_>, name: &str, rotation: DQuat) -> Result<()> {
    let unit = rotation.is_finite() && (rotation.length() - 1.0).abs() < 1e-3;
    check.that(unit, name, rotation.to_array(), "a quaternion [x, y, z, w] of length 1 (±0.001)")
}
