//! A solver at work, and its cost.

use super::outcome::Cost;
use super::setup::{Backend, Scheme, Setup};
use cpu_time::ProcessTime;
use pbmpm::{DVec3, Fate, Particle, Result, Simulate, State, World, state_hash};
use std::time::Instant;

/// For a processor, the time that all its cores were at work, which does not depend on other programs; otherwise
/// elapsed time.
enum Clock {
    Busy(ProcessTime),
    Wall(Instant),
}

impl Clock {
    fn start(on_cpu: bool) -> Clock {
        if on_cpu { Clock::Busy(ProcessTime::now()) } else { Clock::Wall(Instant::now()) }
    }

    fn seconds(&self) -> f64 {
        let elapsed = match self {
            Clock::Busy(start) => start.elapsed(),
            Clock::Wall(start) => start.elapsed(),
        };
        elapsed.as_secs_f64()
    }
}

/// A solver that counts its cost.
pub struct Run {
    pub solver: Box<dyn Simulate>,
    scheme: Scheme,
    transfers_per_step: u32,
    on_cpu: bool,
    steps: u64,
    seconds: f64,
    count: usize,
}

impl Run {
    pub fn new(setup: &Setup, world: &World) -> Result<Run> {
        let mut solver = setup.solver(world)?;
        let count = solver.report()?.alive as usize;
        Ok(Run {
            solver,
            scheme: setup.scheme,
            transfers_per_step: setup.transfers_per_step(),
            on_cpu: setup.backend != Backend::Gpu,
            steps: 0,
            seconds: 0.0,
            count,
        })
    }

    pub fn time(&self) -> f64 {
        self.solver.time()
    }

    pub fn steps(&mut self, count: u32) -> Result<()> {
        let start = Clock::start(self.on_cpu);
        self.solver.steps(count)?;
        self.seconds += start.seconds();
        self.steps += u64::from(count);
        Ok(())
    }

    /// Steps to the end of the step nearest to `time`, s.
    pub fn to(&mut self, time: f64) -> Result<()> {
        let steps = ((time - self.time()) / self.solver.dt()).round();
        self.steps(steps.max(0.0) as u32)
    }

    /// Increases gravity linearly to `gravity` over this many seconds.
    pub fn ramp_gravity(&mut self, gravity: DVec3, seconds: f64) -> Result<()> {
        let steps = (seconds / self.solver.dt()).round().max(1.0) as u32;
        for k in 1..=steps {
            self.solver.set_gravity(gravity * (f64::from(k) / f64::from(steps)))?;
            self.steps(1)?;
        }
        Ok(())
    }

    /// Particles that are alive; in the order in which they were made, as long as none is deleted.
    pub fn particles(&mut self) -> Result<Vec<Particle>> {
        let mut all = self.solver.particles()?;
        all.retain(|p| p.fate == Fate::Alive);
        Ok(all)
    }

    pub fn state(&mut self) -> Result<State> {
        self.solver.state()
    }

    /// The results of a function at about `count` evenly spaced times from now to `end`, s, with the times. The
    /// shortest interval is a step.
    pub fn sample<T>(
        &mut self,
        end: f64,
        count: u32,
        mut look: impl FnMut(&mut Run) -> Result<T>,
    ) -> Result<Vec<(f64, T)>> {
        let steps = ((end - self.time()) / self.solver.dt()).round().max(1.0) as u64;
        let first = self.steps;
        let mut found = Vec::new();
        for k in 1..=u64::from(count) {
            let goal = first + (k * steps).div_ceil(u64::from(count));
            if goal > self.steps {
                self.steps((goal - self.steps) as u32)?;
                let value = look(self)?;
                found.push((self.time(), value));
            }
        }
        Ok(found)
    }

    pub fn cost(&mut self) -> Result<Cost> {
        let report = self.solver.report()?;
        let faults = report.faults;
        // The implicit scheme's iterations are additional to its transfers; the published scheme's are the same.
        let solved = if self.scheme == Scheme::Implicit { report.spent.iterations as f64 } else { 0.0 };
        let lost = [faults.saturated_nodes, faults.speed_clamped, faults.gradient_clamped, faults.escaped];
        Ok(Cost {
            passes: f64::from(self.transfers_per_step) * self.steps as f64 + solved,
            steps: self.steps,
            seconds: self.seconds,
            simulated: self.time(),
            particles: self.count,
            faults: lost.iter().sum::<u64>() + faults.quarantined + faults.refused,
            hash: state_hash(&self.solver.particles()?),
        })
    }
}
