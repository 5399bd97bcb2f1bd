//! The measurements.

use crate::suite::origin::Origin;
use crate::suite::outcome::Cost;
use crate::suite::setup::Setup;
use serde::{Deserialize, Serialize};

/// A point of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    pub problem: String,
    pub scheme: String,
    /// Steps per simulated second.
    pub hertz: f64,
    pub iterations: u32,
    pub tolerance: f64,
    pub refine: f64,
    pub error: f64,
    pub passes: f64,
    pub seconds: f64,
    pub particles: usize,
    pub faults: u64,
    pub state: String,
    pub backend: String,
    pub device: String,
    pub commit: String,
}

impl Record {
    pub fn new(problem: &str, setup: &Setup, error: f64, cost: &Cost, origin: &Origin) -> Record {
        Record {
            problem: problem.to_owned(),
            scheme: setup.scheme.name().to_owned(),
            hertz: (cost.steps as f64 / cost.simulated).round(),
            iterations: setup.iterations,
            tolerance: setup.tolerance,
            refine: setup.refine,
            error,
            passes: cost.passes,
            seconds: (cost.seconds * 1e3).round() / 1e3,
            particles: cost.particles,
            faults: cost.faults,
            state: format!("{:016x}", cost.hash),
            backend: setup.backend.name().to_owned(),
            device: origin.device.clone(),
            commit: origin.commit.clone(),
        }
    }

    /// Passes times particles, which makes cell sizes comparable, or time, s.
    pub fn work(&self, seconds: bool) -> f64 {
        if seconds { self.seconds } else { self.passes * self.particles as f64 }
    }
}
