//! Readings of sensors.

use crate::units::Units;
use glam::DVec3;

/// What was in a sensor at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Reading {
    /// Particles.
    pub count: u32,
    /// kg
    pub mass: f64,
    /// From the mean velocities over the step, kg m/s.
    pub momentum: DVec3,
}

impl Reading {
    /// Mean velocity of the matter, m/s; 0 where there is none.
    pub fn velocity(&self) -> DVec3 {
        if self.mass > 0.0 { self.momentum / self.mass } else { DVec3::ZERO }
    }

    /// Mass flow through a sensor that is `length` m long, kg/s: along an axis n of the sensor, flow · n is what passes
    /// through its cross-sections per second, on average over the length. Exact for boxes and cylinders along their
    /// axes.
    pub fn flow(&self, length: f64) -> DVec3 {
        self.momentum / length
    }
}

/// Sums of a sensor: particles, mass, momentum.
pub(crate) const SUMS: usize = 5;
/// Units of a sum per mass unit.
pub(crate) const MASS_SCALE: f64 = crate::load::SCALE;

/// The reading that sums amount to. `dt` is the length of a step at the start, the unit of time of the summed momentum.
pub(crate) fn reading(sums: [i64; SUMS], units: &Units, dt: f64) -> Reading {
    let [count, mass, x, y, z] = sums.map(|sum| sum as f64);
    let momentum = units.velocity_out(DVec3::new(x, y, z) / crate::load::SCALE, dt);
    Reading { count: count as u32, mass: units.mass_out(mass / MASS_SCALE), momentum: momentum * units.mass_out(1.0) }
}
