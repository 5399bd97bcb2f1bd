//! Regions in which something happens to the matter, or is measured of it.

use crate::error::Result;
use crate::motion::{Motion, validate_placement};
use crate::shape::{Pose, Shape};
use glam::{DQuat, DVec3};

/// A region of space. As a drain it deletes the particles that are in it at the end of a step, and their slots are used again; what
/// passes through a thin one within a step is not caught, so that it is to be thicker than the way of a step. As a sensor it
/// has them counted and weighed.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Region {
    /// Name, for people; may be empty.
    #[cfg_attr(feature = "scene", serde(default))]
    pub name: String,
    /// What it covers.
    pub shape: Shape,
    /// Position of the shape's centre (a half-space: of a point on its plane), m. With a `motion`, of what that is about.
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
        let stated = Pose { position: self.position, rotation: self.rotation };
        self.motion.as_ref().map_or(stated, |motion| motion.pose(&stated, time))
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        self.shape.validate(&format!("{path}.shape"))?;
        validate_placement(path, self.position, self.rotation, self.motion.as_ref())
    }
}
