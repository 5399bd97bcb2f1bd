//! Matter that comes into being while the world runs.

use crate::error::{Check, Result};
use crate::motion::{Motion, validate_placement};
use crate::shape::{Pose, Shape};
use glam::{DQuat, DVec3};

/// How fast an emitter emits.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum Rate {
    /// Particles per second, 0 … 1e7, at most 1e7 of all emitters together, whatever their times.
    Particles(f64),
    /// Litres (10⁻³ m³) of matter at rest per second, 0 … 1e12; at most 1e7 particles per second, of all emitters
    /// together, whatever their times.
    Litres(f64),
}

/// A region in which particles come into being at a steady rate, evenly spread in space and time: a quasi-random
/// sequence places them, so that equal worlds emit equal particles whatever the machine.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Emitter {
    /// Name, for people; may be empty.
    #[cfg_attr(feature = "scene", serde(default))]
    pub name: String,
    /// Name of the material.
    pub material: String,
    /// The region in which particles appear; bounded. What falls outside the domain or into a body is withheld. Places
    /// are found by trial in the box around it: from a shape that fills less than 1/64 of its box, such as the mesh of a
    /// thin net, particles come later than the rate states where many are due in a step.
    pub shape: Shape,
    /// Position of the shape's centre, m. With a `motion`, the position that the motion is relative to.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Rotation from the shape's frame to the world, quaternion `[x, y, z, w]`. Default none.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 4]"), serde(default = "crate::shape::no_rotation"))]
    pub rotation: DQuat,
    /// A motion over time about `position` and `rotation`. Default none.
    #[cfg_attr(feature = "scene", serde(default))]
    pub motion: Option<Motion>,
    /// How fast.
    pub rate: Rate,
    /// Velocity relative to the emitter, in its own axes (which turn with it), m/s. Default 0.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
    pub velocity: DVec3,
    /// How many particles make up a cell of matter at rest: each has a cell's volume divided by this. 0.01 … 1000,
    /// default 8.
    #[cfg_attr(feature = "scene", serde(default = "usual_per_cell"))]
    pub per_cell: f64,
    /// Over-pressure gate: no particle appears where the grid holds, of whatever matter, more than this multiple of the
    /// mass of a cell of the emitter's own material at rest. Such a particle is withheld for good and counted in
    /// [`StepReport::withheld`](crate::StepReport::withheld). Above 0, at most 1e6, default 1.2; below the surface of a
    /// liquid most is withheld unless it is about 2.
    #[cfg_attr(feature = "scene", serde(default = "usual_fill_limit"))]
    pub fill_limit: f64,
    /// When it begins, s. 0 … 1e9, default 0.
    #[cfg_attr(feature = "scene", serde(default))]
    pub start: f64,
    /// When it ends, s; not before `start`, at most 1e9. Default never.
    #[cfg_attr(feature = "scene", serde(default))]
    pub end: Option<f64>,
    /// Seed of the places. Default 0.
    #[cfg_attr(feature = "scene", serde(default))]
    pub seed: u64,
}

#[cfg(feature = "scene")]
fn usual_per_cell() -> f64 {
    8.0
}

#[cfg(feature = "scene")]
fn usual_fill_limit() -> f64 {
    1.2
}

/// The most particles that emitters may emit per second, each and all together.
pub(crate) const MAX_RATE: f64 = 1e7;

/// Fails for emitters at these rates, in particles per second, that emit too much together, beyond rounding.
pub(crate) fn check_sum(rates: impl Iterator<Item = f64>) -> Result<()> {
    let sum: f64 = rates.sum();
    Check { path: "" }.that(
        sum <= MAX_RATE * (1.0 + 1e-9),
        "emitters",
        sum,
        "at most 1e7 particles per second together",
    )
}

impl Emitter {
    /// One at rest, unturned, with 8 particles per cell.
    pub fn new(material: impl Into<String>, shape: Shape, position: DVec3, rate: Rate) -> Self {
        Emitter {
            name: String::new(),
            material: material.into(),
            shape,
            position,
            rotation: DQuat::IDENTITY,
            motion: None,
            rate,
            velocity: DVec3::ZERO,
            per_cell: 8.0,
            fill_limit: 1.2,
            start: 0.0,
            end: None,
            seed: 0,
        }
    }

    /// Particles per second in a world with cells of `cell_size` m.
    pub fn particles_per_second(&self, cell_size: f64) -> f64 {
        match self.rate {
            Rate::Particles(n) => n,
            Rate::Litres(l) => l * 1e-3 / self.particle_volume(cell_size),
        }
    }

    /// Volume of a particle at rest, m³.
    pub(crate) fn particle_volume(&self, cell_size: f64) -> f64 {
        cell_size.powi(3) / self.per_cell
    }

    /// Where it is at `time` s.
    pub fn pose(&self, time: f64) -> Pose {
        Motion::posed(self.motion.as_ref(), Pose { position: self.position, rotation: self.rotation }, time)
    }

    /// The largest speed of emitted particles, m/s, including the emitter's own motion.
    pub(crate) fn fastest(&self) -> f64 {
        self.velocity.length() + self.motion.as_ref().map_or(0.0, |motion| motion.fastest_of(&self.shape))
    }

    pub(crate) fn validate(&self, path: &str, cell_size: f64) -> Result<()> {
        let check = Check { path };
        self.shape.validate(&format!("{path}.shape"))?;
        let bounded = self.shape.half_extent().is_some();
        check.that(bounded, "shape", &self.shape, "a bounded shape, which all but half-spaces are")?;
        validate_placement(path, self.position, self.rotation, self.motion.as_ref())?;
        check.vector("velocity", self.velocity, 1e6, "finite, at most 1e6 m/s")?;
        check.range("per_cell", self.per_cell, 0.01, 1000.0, "0.01 to 1000")?;
        check.range("fill_limit", self.fill_limit, f64::MIN_POSITIVE, 1e6, "above 0, at most 1e6")?;
        check.range("start", self.start, 0.0, 1e9, "0 to 1e9 s")?;
        if let Some(end) = self.end {
            check.range("end", end, self.start, 1e9, "from `start` to 1e9 s")?;
        }
        match self.rate {
            Rate::Particles(n) => check.range("rate.particles", n, 0.0, MAX_RATE, "0 to 1e7 per second"),
            Rate::Litres(l) => {
                check.range("rate.litres", l, 0.0, 1e12, "0 to 1e12 per second")?;
                let few = self.particles_per_second(cell_size) <= MAX_RATE;
                check.that(few, "rate.litres", l, "low enough for at most 1e7 particles per second")
            }
        }
    }
}
