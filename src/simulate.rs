//! What every blocking solver can do.

use crate::error::Result;
use crate::report::{Memory, Particle, State, StepReport};
use crate::shape::Pose;
use crate::units::Units;
use glam::DVec3;

/// Mean time of a stage in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageTime {
    /// The stage's name.
    pub stage: &'static str,
    /// s per step.
    pub seconds: f64,
}

/// A solver that steps and answers at once: [`CpuSolver`](crate::CpuSolver) and `Headless`.
pub trait Simulate {
    /// Takes one step.
    ///
    /// # Errors
    /// Only a GPU can fail here: [`Error::Device`](crate::Error::Device).
    fn step(&mut self) -> Result<()>;

    /// Takes `count` steps; a GPU takes many in one submission.
    ///
    /// # Errors
    /// As [`Simulate::step`].
    fn steps(&mut self, count: u32) -> Result<()> {
        (0..count).try_for_each(|_| self.step())
    }

    /// Every particle ever made, in the order of their making.
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

    /// Length of the next step, s.
    fn dt(&self) -> f64;

    /// Changes the length of the steps to come, s; velocities stay.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) outside 1e-5 … 0.2, or if a collider would turn more than half a turn.
    fn set_dt(&mut self, dt: f64) -> Result<()>;

    /// Changes gravity for the steps to come, m/s².
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) unless finite and at most 1e6.
    fn set_gravity(&mut self, gravity: DVec3) -> Result<()>;

    /// Changes a collider's motion from now on: its pose, if one is given, its velocity (m/s) and its angular velocity
    /// (rad/s). A [`Motion`](crate::Motion) of the collider ends for good; without a pose it goes on from where it is.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if there is no such collider or a value is out of range.
    fn set_collider(&mut self, index: usize, pose: Option<Pose>, linear: DVec3, angular: DVec3) -> Result<()>;

    /// Mean time of each stage in a step, as far as it was measured.
    fn stage_times(&self) -> Vec<StageTime>;
}
