//! Regions in which matter ceases to be.

use crate::error::Result;
use crate::motion::{Motion, validate_placement};
use crate::shape::{Pose, Shape};
use glam::{DQuat, DVec3};

/// A region that deletes the particles that are in it at the end of a step; their slots are used again. A particle that
/// passes through a thin region within a step is not caught: make it thicker than the way of a step.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Drain {
    /// Name, for people; may be empty.
    #[cfg_attr(feature = "scene", serde(default))]
    pub name: String,
    /// The region.
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
    /// It deletes everything outside of its shape instead. Default false.
    #[cfg_attr(feature = "scene", serde(default))]
    pub inverted: bool,
}

impl Drain {
    /// One at rest, unturned.
    pub fn new(shape: Shape, position: DVec3) -> Self {
        Drain { name: String::new(), shape, position, rotation: DQuat::IDENTITY, motion: None, inverted: false }
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
