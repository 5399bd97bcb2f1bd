//! What a case gives.

use super::chart::Chart;

/// What a number is compared with. Kinds are not to be mixed.
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
    /// As good as is aimed at.
    Target,
    /// As good as it must be.
    Gate,
    /// Not good enough.
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
    /// What it should be.
    pub reference: f64,
    /// What it is.
    pub measured: f64,
    /// How far off, 0 at best; relative unless the name has a unit.
    pub error: f64,
    /// What the error must not exceed.
    pub gate: f64,
    /// What it should not exceed.
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

    /// A number and how far it is off in its own unit.
    pub fn absolute(name: &'static str, kind: Kind, reference: f64, measured: f64, gate: f64, target: f64) -> Metric {
        Metric { name, kind, reference, measured, error: (measured - reference).abs(), gate, target }
    }

    pub fn verdict(&self) -> Verdict {
        if self.error <= self.target {
            Verdict::Target
        } else if self.error <= self.gate {
            Verdict::Gate
        } else {
            Verdict::Fail // also where it is not a number
        }
    }
}

/// What a run has cost.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cost {
    /// Particle-to-grid and grid-to-particle sweeps that were not spared.
    pub passes: f64,
    pub steps: u64,
    /// Of the steps, s: time that all cores of a processor were at work, or the time that has passed on a graphics adapter.
    pub seconds: f64,
    /// Simulated time, s.
    pub simulated: f64,
    /// Particles of the largest run.
    pub particles: usize,
    /// Saturated nodes, clamped and lost particles.
    pub faults: u64,
    /// Of the last state; combined where there are several runs.
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

/// What a case gives.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    pub metrics: Vec<Metric>,
    pub cost: Cost,
    pub charts: Vec<Chart>,
}

impl Outcome {
    /// The error of the metric of this name; not a number where there is none.
    pub fn error(&self, name: &str) -> f64 {
        self.metrics.iter().find(|m| m.name == name).map_or(f64::NAN, |m| m.error)
    }

    /// The value of the metric of this name; not a number where there is none.
    pub fn measured(&self, name: &str) -> f64 {
        self.metrics.iter().find(|m| m.name == name).map_or(f64::NAN, |m| m.measured)
    }
}
