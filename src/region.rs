//! Regions in which matter is deleted or measured.

use crate::error::Result;
use crate::motion::{Motion, validate_placement};
use crate::shape::{Pose, Shape};
use glam::{DQuat, DVec3};

/// A region of space. As a drain it deletes the particles that are inside at the end of a step, and their slots are
/// used again. Particles that pass through within a step are not caught: make it thicker than the distance that matter
/// moves in a step. As a sensor it counts and weighs the particles inside.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Region {
    /// Name, for people; may be empty.
    #[cfg_attr(feature = "scene", serde(default))]
    pub name: String,
    /// What it covers.
    pub shape: Shape,
    /// Position of the shape's centre (a half-space: of a point on its plane), m. With a `motion`, the position that
    /// the motion is relative to.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Rotation from the shape's frame to the world, quaternion `[x, y, z, w]`. Default none.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 4]"), serde(default = "crate::shape::no_rotation"))]
    pub rotation: DQuat,
    /// A motion over time about `position` and `rotation`. Default none.
    #[cfg_attr(feature = "scene", serde(default))]
    pub motion: Option<Motion>,
    /// It covers everything outside of its shape instead. Default false.
    #[cfg_attr(feature = "scene", serde(default))]
    pub inverted: bool,
}

impl Region {
    /// One at rest, unturned.
    pub fn new(shape: Shape, position: DVec3) -> Self {
        Region { name: String::new(), shape, position, rotation: DQuat::IDENTITY, motion: None, inverted: false }
    }

    /// Where it is at `time` s.
    pub fn pose(&self, time: f64) -> Pose {
        Motion::posed(self.motion.as_ref(), Pose { position: self.position, rotation: self.rotation }, time)
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        self.shape.validate(&format!("{path}.shape"))?;
        validate_placement(path, self.position, self.rotation, self.motion.as_ref())
    }
}
