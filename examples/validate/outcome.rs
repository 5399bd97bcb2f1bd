//! The result of a case.

use super::chart::Chart;

/// The reference of a number. Kinds must not be mixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// An exact or analytic result.
    Exact,
    /// The same equations, finer.
    Converged,
    /// An experiment, which has errors and physics of its own.
    Experiment,
}

impl Kind {
    pub fn letter(self) -> &'static str {
        match self {
            Kind::Exact => "E",
            Kind::Converged => "C",
            Kind::Experiment => "X",
        }
    }
}

/// How a number stands against its gate and target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It meets the target.
    Target,
    /// It meets the gate.
    Gate,
    /// It does not meet the gate.
    Fail,
}

impl Verdict {
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Target => "target",
            Verdict::Gate => "gate",
            Verdict::Fail => "FAIL",
        }
    }
}

/// One number of a case.
#[derive(Debug, Clone)]
pub struct Metric {
    pub name: &'static str,
    pub kind: Kind,
    /// The value that it should have.
    pub reference: f64,
    /// The value measured.
    pub measured: f64,
    /// The error, 0 at best; relative unless the name has a unit.
    pub error: f64,
    /// Bound that the error must not exceed.
    pub gate: f64,
    /// Bound that it should not exceed.
    pub target: f64,
}

impl Metric {
    /// A number whose error is relative to the reference.
    pub fn relative(name: &'static str, kind: Kind, reference: f64, measured: f64, gate: f64, target: f64) -> Metric {
        Metric { name, kind, reference, measured, error: (measured / reference - 1.0).abs(), gate, target }
    }

    /// A number that should be 0.
    pub fn zero(name: &'static str, kind: Kind, measured: f64, gate: f64, target: f64) -> Metric {
        Metric { name, kind, reference: 0.0, measured, error: measured.abs(), gate, target }
    }

    /// A number whose error is in its own unit.
    pub fn absolute(name: &'static str, kind: Kind, reference: f64, measured: f64, gate: f64, target: f64) -> Metric {
        Metric { name, kind, reference, measured, error: (measured - reference).abs(), gate, target }
    }

    pub fn verdict(&self) -> Verdict {
        if self.error <= self.target {
            Verdict::Target
        } else if self.error <= self.gate {
            Verdict::Gate
        } else {
            Verdict::Fail // also if it is NaN
        }
    }
}

/// The cost of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cost {
    /// Particle-to-grid and grid-to-particle sweeps that were not skipped.
    pub passes: f64,
    pub steps: u64,
    /// Time of the steps, s: that during which all cores of a processor were at work, or the elapsed time on a graphics
    /// adapter.
    pub seconds: f64,
    /// Simulated time, s.
    pub simulated: f64,
    /// Particles of the largest run.
    pub particles: usize,
    /// Saturated nodes, clamped and lost particles.
    pub faults: u64,
    /// Of the last state; combined over several runs.
    pub hash: u64,
}

impl Cost {
    pub fn add(&mut self, other: Cost) {
        self.passes += other.passes;
        self.steps += other.steps;
        self.seconds += other.seconds;
        self.simulated += other.simulated;
        self.particles = self.particles.max(other.particles);
        self.faults += other.faults;
        self.hash = self.hash.rotate_left(1) ^ other.hash;
    }
}

/// The result of a case.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    pub metrics: Vec<Metric>,
    pub cost: Cost,
    pub charts: Vec<Chart>,
}

impl Outcome {
    /// The error of the metric of this name; NaN if there is none.
    pub fn error(&self, name: &str) -> f64 {
        self.metrics.iter().find(|m| m.name == name).map_or(f64::NAN, |m| m.error)
    }

    /// The value of the metric of this name; NaN if there is none.
    pub fn measured(&self, name: &str) -> f64 {
        self.metrics.iter().find(|m| m.name == name).map_or(f64::NAN, |m| m.measured)
    }
}
