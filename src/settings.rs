//! How the simulation is stepped.

use crate::error::{Check, Result};
use crate::material::{Material, Model};
use glam::DVec3;

/// The shortest step, s.
pub(crate) const SHORTEST: f64 = 1e-5;
/// The longest, s.
pub(crate) const LONGEST: f64 = 0.2;
/// The largest stiffness of liquids in the implicit scheme, as the square of the cells that sound travels in a step.
/// After an impact of stiffer matter the pressures left behind would throw it up in the next step, with more energy
/// than it had.
const STIFFEST: f64 = 32.0;
/// The same bound for the pressure that the liquids of a block share.
pub(crate) const STIFFEST_BLOCK: f64 = 128.0;
/// The largest pressure under which liquid particles keep their places, as a share of their stiffness.
const MOST_BORNE: f64 = 0.08;
/// The largest factor by which the fastest particles may multiply the steps that [`Settings::dt`] alone gives a frame.
const MAX_SUBSTEPS: f64 = 16.0;

/// How a step is solved. See `docs/method.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case"))]
pub enum Scheme {
    /// PB-MPM as published. Each iteration scatters the motion to the grid and gathers it again. Stiffness follows from
    /// [`Material::relaxation`](crate::Material::relaxation), the step and the number of iterations.
    Published,
    /// Momentum is scattered once per step. Conjugate gradients then find the stresses at the end of the step, up to a
    /// tolerance. Stiffness follows from the materials' moduli, up to what the iterations can resolve. Supports every
    /// material but sand.
    #[default]
    Implicit,
    /// Momentum is scattered once per step, together with the stress at the beginning of the step; there are no
    /// iterations. Stiffness follows from the materials' moduli. A step must be short enough for the solids
    /// ([`World::stable_dt`](crate::World::stable_dt)); liquids are softened to what the step allows.
    Explicit,
}

impl Scheme {
    /// Whether the scheme supports matter of this model.
    pub fn takes(self, model: Model) -> bool {
        self != Scheme::Implicit || !matches!(model, Model::Sand { .. })
    }
}

/// Solver settings of a world. The defaults are fixed numbers. [`Quality`](crate::Quality) chooses step, scheme and the
/// other settings of accuracy and cost by what is in the world; scene files that state nothing get that choice.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct Settings {
    /// Time step, s. Where `courant` divides frames into steps of varying length, this is the longest. Default 1/240.
    /// Allowed 1e-5 … 0.2. The explicit scheme allows at most [`World::stable_dt`](crate::World::stable_dt). The
    /// implicit scheme with liquids allows steps in which gravity moves matter by at most `iterations`²/4 cells, and by
    /// at most 16.
    pub dt: f64,
    /// How a step is solved. Default implicit, which does not support sand.
    pub scheme: Scheme,
    /// Iterations per step. In the implicit scheme this is the maximum, and it also bounds stiffness: sound travels at
    /// most 0.7 cells per step for each iteration, and never more than 5.7. The explicit scheme has no iterations.
    /// Default 4. Allowed 1 … 1000.
    pub iterations: u32,
    /// Implicit scheme only. Iterations end when the last one has changed the grid's velocities by less than this share
    /// of them, less their mean (root mean square, weighted by mass). In a material whose sound travels less than one
    /// cell per step, the share is multiplied by the square of the cells that it travels. Default 0.01. Allowed 0 …
    /// 0.05; 0: all iterations are taken.
    pub tolerance: f64,
    /// Implicit and explicit schemes. The largest bulk modulus of liquids, Pa, whatever
    /// [`Material::bulk_modulus`](crate::Material::bulk_modulus) says. A liquid that is stiffer than its scene needs is
    /// also more viscous than it should be, increasingly so with shorter steps. With a limit of ρ c² sound travels at
    /// c, and at depth h a share of g h/c² of the height is lost; a c of ten times the fastest motion is enough.
    /// Default: as stiff as the iterations can resolve, or as is stable in an explicit step; in short explicit steps
    /// columns may then gain energy as they collapse. What the liquid of a block shares is not limited
    /// ([`block_pressure`](Self::block_pressure)). Allowed 1e-3 … 1e12.
    pub bulk_limit: Option<f64>,
    /// Implicit scheme only. Adds one shared pressure per block of 4³ cells, which responds to the block's mean
    /// compression with [`Material::bulk_modulus`](crate::Material::bulk_modulus), whatever `bulk_limit` says, bounded
    /// by sound that travels 11 cells per step. Differences within a block keep the stiffness that `bulk_limit` and the
    /// iterations allow. With the same iterations, liquids 32 cells deep then lose 0.4 of the height that they lose
    /// without it, those 64 cells deep a quarter (`docs/method.md`).
    /// Without effect where very viscous matter (8 η Δt/(ρ Δx²) > 64) is solved for beside bodies, and where matter is
    /// so deep that it would boil: where g h (Δt/Δx)² exceeds I²/25 or 2.56, with I iterations and h the height of the
    /// spawned matter stacked up (with emitters or a stated capacity, the height of the domain), times the ratio of the
    /// densities of the densest and the lightest liquid.
    /// Default false; [`Quality`](crate::Quality) chooses it.
    pub block_pressure: bool,
    /// Whether each step restores the particle motion that the transfers to and from the grid smooth away. The
    /// numerical viscosity of liquids falls to a third or a quarter, and waves, impacts and running sand lose less
    /// (`docs/method.md`, (19)). It costs one more pass per step: 15 % of the time of the implicit scheme with four
    /// iterations, 50 % or more of the time of the explicit one. Without effect in the published scheme. Default false;
    /// [`Quality`](crate::Quality) chooses it.
    pub sharpen: bool,
    /// How far the fastest particle should move in a step, in cells (the CFL number).
    /// [`Simulate::advance`](crate::Simulate::advance) and [`GpuSolver::plan_frame`](crate::GpuSolver::plan_frame)
    /// divide a frame into as many steps as that needs, up to 16 times as many as `dt` alone would give, with what
    /// appears, and with what gravity and tools add, within the frame. They also keep bodies to three quarters of
    /// `max_displacement` per step. 1 is enough for most scenes, 0.5 is accurate. Default 0: every step is as long as
    /// `dt`. Allowed 0, and 0.05 … 16.
    pub courant: f64,
    /// Largest displacement of a particle in one step, cells. Faster particles are slowed to it and counted in
    /// [`Faults::speed_clamped`](crate::Faults::speed_clamped). Nodes of the grid that gravity, tools or stresses make
    /// faster within a step are slowed to it without being counted. In the published scheme it sets the fixed-point
    /// scale, so that smaller is more precise. Default 4. Allowed 0.5 … 16.
    pub max_displacement: f64,
    /// How much matter a grid node can hold, in rest masses of a cell. Nodes that reach the next power of two (or half
    /// of what 256 of the heaviest particles bring to a node, where that is more) are counted in
    /// [`Faults::saturated_nodes`](crate::Faults::saturated_nodes). Smaller is more precise. Default 16.
    /// Allowed 2 … 4096.
    pub max_fill: f64,
    /// Time constant, s, with which a particle's volume ratio follows the density that the grid measures where this
    /// density shows compression. A shorter one corrects drift faster but agitates the matter more. Default 0.05;
    /// [`Quality`](crate::Quality) chooses it by cells and gravity. Allowed 1e-4 … 1e3.
    pub volume_correction_time: f64,
    /// Volume ratio up to which a liquid resists being stretched. Beyond it the liquid comes apart freely, and resists
    /// again once it has closed up. 1: no tension at all. Default 1.1. Allowed 1 … 4.
    pub tension_limit: f64,
    /// Room for this many particles at a time. Particles beyond it are not made, and are counted in
    /// [`Faults::refused`](crate::Faults::refused). At least the number of particles spawned, at most 2²⁶. Default: the
    /// particles spawned, plus those that emitters emit in their first 30 s (at most 2²² of these). If it is stated,
    /// all materials take part, so that hosts may add particles of any of them.
    pub capacity: Option<u32>,
    /// Whether, and when, matter that has come to rest is put to sleep. Default: never.
    pub sleep: Option<Sleep>,
}

/// When matter falls asleep. Sleeping matter stays where it is and costs next to nothing. Moving matter meets it as a
/// wall, and wakes it. See `docs/method.md`.
///
/// What is lost is motion slower than `speed`: slower waves die at the edge of sleeping matter, and slower creep stops.
/// A body does not feel the weight of matter asleep on it, so that [`Collider::measure`](crate::Collider::measure) is
/// refused in worlds with sleep.
///
/// Nothing sleeps around moving bodies, drains, emitters and tools at work, or where hosts add or remove matter. A step
/// keeps up to 32 boxes around such places; if there are more, neighbouring ones share a box.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Sleep {
    /// Speed up to which a particle counts as at rest, m/s. A good choice is 0.03 to 0.1 √(g Δx), which is 2 to 7 cm/s
    /// on cells of 5 cm. Noise of the published scheme can be ten times as fast. Allowed 0 … 100; with 0 only matter
    /// that does not move at all sleeps.
    pub speed: f64,
    /// How long all particles of a block of 4³ cells and of the 26 blocks around it must be at rest, s. Allowed 0 …
    /// 1000; 0.5 suits most scenes.
    pub time: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            dt: 1.0 / 240.0,
            scheme: Scheme::default(),
            iterations: 4,
            tolerance: 0.01,
            bulk_limit: None,
            block_pressure: false,
            sharpen: false,
            courant: 0.0,
            max_displacement: 4.0,
            max_fill: 16.0,
            volume_correction_time: 0.05,
            tension_limit: 1.1,
            capacity: None,
            sleep: None,
        }
    }
}

impl Settings {
    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        validate_dt(&check, self.dt)?;
        check.that((1..=1000).contains(&self.iterations), "iterations", self.iterations, "1 to 1000")?;
        // If a solve ends sooner, the stresses carried over outweigh those that it finds: matter at rest gains energy.
        check.range("tolerance", self.tolerance, 0.0, 0.05, "0 to 0.05")?;
        if let Some(limit) = self.bulk_limit {
            check.range("bulk_limit", limit, 1e-3, 1e12, "1e-3 to 1e12 Pa")?;
        }
        let off = self.courant == 0.0;
        check.that(off || (0.05..=16.0).contains(&self.courant), "courant", self.courant, "0, or 0.05 to 16 cells")?;
        check.range("max_displacement", self.max_displacement, 0.5, 16.0, "0.5 to 16 cells")?;
        check.range("max_fill", self.max_fill, 2.0, 4096.0, "2 to 4096")?;
        check.range("volume_correction_time", self.volume_correction_time, 1e-4, 1e3, "1e-4 to 1000 s")?;
        check.range("tension_limit", self.tension_limit, 1.0, 4.0, "1 to 4")?;
        let Some(Sleep { speed, time }) = self.sleep else { return Ok(()) };
        check.range("sleep.speed", speed, 0.0, 100.0, "0 to 100 m/s")?;
        check.range("sleep.time", time, 0.0, 1000.0, "0 to 1000 s")
    }

    /// The number of equal steps into which to divide a frame of `frame` seconds. None is longer than `dt`. With
    /// `courant`, none moves a particle of `speed` m/s, accelerated by gravity (m/s²) during the frame, farther than
    /// that, unless this takes more than 16 times as many steps as `dt` alone gives. `cell_size` in m. 0 for a frame
    /// that is not above 0.
    ///
    /// ```
    /// # use pbmpm::{DVec3, Settings};
    /// let settings = Settings { dt: 0.01, courant: 0.5, ..Settings::default() };
    /// let steps = |speed| settings.substeps(1.0 / 60.0, 0.02, DVec3::ZERO, speed);
    /// assert_eq!([steps(0.5), steps(5.0)], [2, 9]);
    /// ```
    pub fn substeps(&self, frame: f64, cell_size: f64, gravity: DVec3, speed: f64) -> u32 {
        if frame <= 0.0 || frame.is_nan() {
            return 0;
        }
        // A frame that is longer than its steps by a rounding error does not need another step.
        let fewest = (frame / self.dt - 1e-9).ceil().max(1.0);
        let cells = (speed + gravity.length() * frame) * frame / cell_size;
        let wanted = if self.courant > 0.0 { (cells / self.courant).ceil() } else { fewest };
        let most = (MAX_SUBSTEPS * fewest).min((frame / SHORTEST).floor());
        wanted.min(most).max(fewest) as u32
    }

    /// How far a body may move in a step, in cells: matter that moves no farther than `max_displacement` has to keep
    /// ahead of it.
    pub(crate) fn largest_sweep(&self) -> f64 {
        0.75 * self.max_displacement
    }

    /// The material with its bulk modulus limited by these settings.
    pub(crate) fn softened(&self, material: &Material) -> Material {
        let limit = self.bulk_limit.unwrap_or(f64::INFINITY);
        Material { bulk_modulus: material.bulk_modulus.min(limit), ..material.clone() }
    }

    /// Whether motion that the transfers smooth away is restored.
    pub(crate) fn sharpens(&self) -> bool {
        self.sharpen && self.scheme != Scheme::Published
    }

    /// The largest stiffness of liquids in the implicit scheme, as the square of their speed of sound in cells per
    /// step.
    pub(crate) fn stiffest(&self) -> f64 {
        (0.5 * f64::from(self.iterations).powi(2)).min(STIFFEST)
    }

    /// Whether liquids of this `stiffness` hold their particles in place under `deepest` cells of matter along each
    /// axis, where gravity moves matter by `fall` cells in a step.
    pub(crate) fn bears(stiffness: f64, deepest: DVec3, fall: DVec3) -> bool {
        deepest.dot(fall.abs()) <= MOST_BORNE * stiffness
    }

    /// Fails if the step is too long: in the explicit scheme for one of these solids, in the implicit one for the
    /// stiffness that the iterations give liquids, which the weight of one cell may compress by at most half.
    pub(crate) fn check_stable<'m>(
        &self,
        mut materials: impl Iterator<Item = (usize, &'m Material)>,
        cell_size: f64,
        gravity: DVec3,
    ) -> Result<()> {
        let check = Check { path: "settings" };
        match self.scheme {
            Scheme::Published => Ok(()),
            Scheme::Implicit if materials.all(|(_, m)| m.model != Model::Liquid) => Ok(()),
            Scheme::Implicit => {
                let most = (0.5 * self.stiffest() * cell_size / gravity.length()).sqrt();
                let allowed = format!(
                    "at most {most:.3e} s in the implicit scheme, for liquids under this gravity in so few iterations"
                );
                check.that(self.dt <= most, "dt", self.dt, &allowed)
            }
            Scheme::Explicit => materials.try_for_each(|(i, material)| {
                let most = material.stable_dt(cell_size);
                let of = format!("materials[{i}]");
                let soft = "so small that the explicit scheme bears steps of 1e-5 s on these cells, with this density";
                Check { path: &of }.that(SHORTEST <= most, "youngs_modulus", material.youngs_modulus, soft)?;
                let allowed = format!("at most {most:.3e} s in the explicit scheme, for the stiffness of {of}");
                check.that(self.dt <= most, "dt", self.dt, &allowed)
            }),
        }
    }
}

pub(crate) fn validate_dt(check: &Check<'_>, dt: f64) -> Result<()> {
    check.range("dt", dt, SHORTEST, LONGEST, "1e-5 to 0.2 s")
}
