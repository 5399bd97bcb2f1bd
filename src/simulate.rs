//! The interface of every blocking solver.

use crate::emitter::Rate;
use crate::error::Result;
use crate::load::Loads;
use crate::region::Region;
use crate::report::{Memory, Particle, Spent, State, StepReport};
use crate::sensor::Reading;
use crate::shape::Pose;
use crate::snapshot::Snapshot;
use crate::spawn::Spawn;
use crate::tool::Tool;
use crate::units::Units;
use glam::DVec3;

/// Mean time of a stage in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct StageTime {
    /// The stage's name.
    pub stage: &'static str,
    /// s per step.
    pub seconds: f64,
}

/// What advancing by a frame took.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Advanced {
    /// Steps taken.
    pub steps: u32,
    /// Their iterations.
    pub iterations: u64,
    /// Those of the implicit scheme whose iterations ended at their cap, not at the tolerance.
    pub capped: u64,
    /// The state of the solver; [`StepReport::solved`] has the remaining error of the last step.
    pub report: StepReport,
}

/// A solver that steps and returns results synchronously: [`CpuSolver`](crate::CpuSolver) and `Headless`.
pub trait Simulate {
    /// Takes one step.
    ///
    /// # Errors
    /// Only a GPU can fail here: [`Error::Device`](crate::Error::Device), and
    /// [`Error::Unsupported`](crate::Error::Unsupported) where the grid would outgrow it.
    fn step(&mut self) -> Result<()>;

    /// Takes `count` steps; a GPU takes many in one submission.
    ///
    /// # Errors
    /// As [`Simulate::step`].
    fn steps(&mut self, count: u32) -> Result<()> {
        (0..count).try_for_each(|_| self.step())
    }

    /// Divides a frame of `frame` seconds into equal steps by [`Settings::substeps`](crate::Settings::substeps) and the
    /// present largest speed. The steps to come have that length; returns how many make up the frame, one at least
    /// unless `frame` is 0: put frames that are much shorter than [`dt`](Self::dt) together.
    ///
    /// A frame costs as much as its steps: a program that measures its frames has to bound them, say to 0.1 s, lest
    /// each take longer than the one before.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) unless `frame` is 0 or 1e-5 … 60.
    fn plan_frame(&mut self, frame: f64) -> Result<u32>;

    /// Takes the steps of a frame, as [`plan_frame`](Self::plan_frame) divides it, and says what was spent.
    ///
    /// # Errors
    /// As [`plan_frame`](Self::plan_frame) and [`steps`](Self::steps).
    fn advance(&mut self, frame: f64) -> Result<Advanced> {
        let Spent { iterations, capped, .. } = self.report()?.spent;
        let steps = self.plan_frame(frame)?;
        self.steps(steps)?;
        let report = self.report()?;
        let (iterations, capped) = (report.spent.iterations - iterations, report.spent.capped - capped);
        Ok(Advanced { steps, iterations, capped, report })
    }

    /// Every slot for a particle, used or not: those spawned in the order of their making, then the rest of the
    /// [capacity](crate::Settings::capacity). A particle keeps its slot; once it is gone, another may get it.
    ///
    /// # Errors
    /// As [`Simulate::step`].
    fn particles(&mut self) -> Result<Vec<Particle>>;

    /// Counts and faults.
    ///
    /// # Errors
    /// As [`Simulate::step`].
    fn report(&mut self) -> Result<StepReport>;

    /// Sums over the particles.
    ///
    /// # Errors
    /// As [`Simulate::step`].
    fn state(&mut self) -> Result<State> {
        Ok(State::of(&self.particles()?, self.gravity()))
    }

    /// What the matter has exerted since the start on the colliders that ask for it.
    ///
    /// # Errors
    /// As [`Simulate::step`].
    fn loads(&mut self) -> Result<Loads>;

    /// What was in each of the world's sensors at the end of the last step, in their order; zeros before the first.
    ///
    /// # Errors
    /// As [`Simulate::step`].
    fn sensors(&mut self) -> Result<Vec<Reading>>;

    /// Bytes owned by the solver.
    fn memory(&self) -> Memory;

    /// Where the world's colliders are now.
    fn poses(&self) -> &[Pose];

    /// The conversion between the solver's cells and metres.
    fn units(&self) -> Units;

    /// Acceleration of free fall now, m/s².
    fn gravity(&self) -> DVec3;

    /// Simulated time, s.
    fn time(&self) -> f64;

    /// Length of the next step, s: as [`set_dt`](Self::set_dt) has set it, or the last [`plan_frame`](Self::plan_frame)
    /// or [`advance`](Self::advance).
    fn dt(&self) -> f64;

    /// Changes the length of the steps to come, s, and the longest step that frames are divided into; velocities stay.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) outside 1e-5 … 0.2, if a collider would turn more than half a turn, or
    /// if the step is too long for the scheme ([`Settings::dt`](crate::Settings::dt)).
    fn set_dt(&mut self, dt: f64) -> Result<()>;

    /// Changes gravity for the steps to come, m/s². Step and stiffness stay those that a
    /// [`Quality`](crate::Quality) has chosen for the world's gravity: make the world with the strongest that will act.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) unless finite and at most 1e6, or if the steps are too long for it
    /// ([`Settings::dt`](crate::Settings::dt)).
    fn set_gravity(&mut self, gravity: DVec3) -> Result<()>;

    /// Changes a collider's motion from now on: its pose, if one is given, its velocity (m/s) and its angular velocity
    /// (rad/s). A [`Motion`](crate::Motion) of the collider ends for good; without a pose the collider continues from
    /// where it is.
    ///
    /// A pose is a jump, which carries no matter along: what is then inside is moved out slowly. For a body that goes
    /// from a to b within a frame, state the pose a and the velocity (b − a) over the frame's time. It keeps that
    /// velocity until it is set again.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if there is no such collider or a value is out of range.
    fn set_collider(&mut self, index: usize, pose: Option<Pose>, linear: DVec3, angular: DVec3) -> Result<()>;

    /// Adds the particles of `spawn` at the end of the next step, with the velocity that the spawn states for that
    /// time, whether or not there is matter in their places, except those that would then be inside a body. Returns
    /// how many are asked for. Of these, the ones in whose places a body is set before the step are withheld
    /// ([`StepReport::withheld`]). Those for which no slot is free then are not made and counted in
    /// [`Faults::refused`](crate::Faults::refused): where [`Settings::capacity`](crate::Settings::capacity) is not
    /// stated, there are no slots beyond what is spawned and emitted.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if the spawn is not valid in this world, any of its particles is outside
    /// the domain, or there are more, together with those already to be added in that step, than the
    /// [capacity](crate::Settings::capacity); [`Error::Unsupported`](crate::Error::Unsupported) if they need larger
    /// buffers than the device has. Then none is added.
    fn add(&mut self, spawn: &Spawn) -> Result<usize>;

    /// Deletes what is in `region` at the end of the next step, before anything is added there.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if the region is not valid, [`MAX_REGIONS`](crate::MAX_REGIONS) are to
    /// be emptied in that step already, or there are [`MAX_MESHES`](crate::MAX_MESHES) different meshes already, those
    /// of regions emptied so far included; [`Error::Unsupported`](crate::Error::Unsupported) if its mesh does not fit the
    /// device.
    fn remove(&mut self, region: &Region) -> Result<()>;

    /// The whole state between two steps. A solver of the same world that restores it continues as this one does, bit
    /// for bit.
    ///
    /// # Errors
    /// As [`Simulate::step`].
    fn save(&mut self) -> Result<Snapshot>;

    /// Replaces the state by that of a snapshot, with all that hosts set: tools, rates, step length, gravity, the motion of
    /// bodies, and what is to be added and removed. After an error nothing has changed.
    ///
    /// # Errors
    /// [`Error::Snapshot`](crate::Error::Snapshot) if it is of another world or precision, or contradicts itself;
    /// [`Error::Invalid`](crate::Error::Invalid) where it holds what no host can have asked for.
    fn restore(&mut self, snapshot: &Snapshot) -> Result<()>;

    /// Frees the slots of quarantined particles at the end of the next step, before anything is added; if their state
    /// is of interest, read it before. [`Faults::quarantined`](crate::Faults::quarantined) goes on counting them.
    fn release_quarantined(&mut self);

    /// Changes the rate of an emitter, counted from 0 in the order of the world. The slots that there are do not
    /// change: without a stated [`Settings::capacity`](crate::Settings::capacity) they follow from the rates at the
    /// start.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if there is no such emitter, the rate is out of range, or all
    /// emitters together would emit more than 1e7 particles per second.
    fn set_emission(&mut self, emitter: usize, rate: Rate) -> Result<()>;

    /// Replaces the host's tools from the next step on; the world's own tools stay beside them. They act until they are
    /// replaced, and each moves on by its velocity from step to step.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if there are more than [`MAX_TOOLS`](crate::MAX_TOOLS) or one is not
    /// valid.
    fn set_tools(&mut self, tools: &[Tool]) -> Result<()>;

    /// Mean time of each stage in a step, as far as it was measured.
    fn stage_times(&self) -> Vec<StageTime>;
}
