//! Regions in which matter is counted and weighed.

use crate::error::Result;
use crate::motion::{Motion, validate_placement};
use crate::shape::{Pose, Shape};
use crate::units::Units;
use glam::{DQuat, DVec3};

/// A region whose matter is summed up at the end of every step; see [`Reading`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Sensor {
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
    /// It sums up everything outside of its shape instead. Default false.
    #[cfg_attr(feature = "scene", serde(default))]
    pub inverted: bool,
}

impl Sensor {
    /// One at rest, unturned.
    pub fn new(shape: Shape, position: DVec3) -> Self {
        Sensor { name: String::new(), shape, position, rotation: DQuat::IDENTITY, motion: None, inverted: false }
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

/// What was in a sensor at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
pub struct Reading {
    /// Particles.
    pub count: u32,
    /// kg
    pub mass: f64,
    /// Of the mean velocities over the step, kg m/s.
    pub momentum: DVec3,
}

impl Reading {
    /// Mean velocity of the matter, m/s; 0 where there is none.
    pub fn velocity(&self) -> DVec3 {
        if self.mass > 0.0 { self.momentum / self.mass } else { DVec3::ZERO }
    }

    /// Mass flow through a sensor that is `length` m long, kg/s: along an axis n of the sensor, flow · n is what passes through
    /// its cross-sections per second, on average over the length. Exact for boxes and cylinders along their axes.
    pub fn flow(&self, length: f64) -> DVec3 {
        self.momentum / length
    }
}

/// Sums of a sensor: particles, mass, momentum.
pub(crate) const SUMS: usize = 5;
/// Units of a sum per mass unit.
pub(crate) const MASS_SCALE: f64 = crate::load::SCALE;

/// What sums say. `dt` is the length of a step at the start, in which momentum is counted.
pub(crate) fn reading(sums: [i64; SUMS], units: &Units, dt: f64) -> Reading {
    let [count, mass, x, y, z] = sums.map(|sum| sum as f64);
    let momentum = units.velocity_out(DVec3::new(x, y, z) / crate::load::SCALE, dt);
    Reading { count: count as u32, mass: units.mass_out(mass / MASS_SCALE), momentum: momentum * units.mass_out(1.0) }
}
