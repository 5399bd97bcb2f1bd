//! What was measured, as a CSV file.

use crate::suite::outcome::Cost;
use crate::suite::setup::{Backend, Setup};
use std::path::Path;
use std::process::Command;

type Failure = Box<dyn std::error::Error>;

/// Where and of what a measurement is.
#[derive(Debug, Clone)]
pub struct Origin {
    device: String,
    commit: String,
}

impl Origin {
    pub fn find(backend: Backend, adapter: &str) -> Origin {
        let device = match backend {
            Backend::Cpu | Backend::Cpu64 => {
                let threads = std::thread::available_parallelism().map_or(0, usize::from);
                format!("{} {threads} threads", std::env::consts::ARCH)
            }
            Backend::Gpu => pbmpm::choose_adapter(&pbmpm::AdapterChoice { name: adapter.to_owned() })
                .map_or_else(|_| "none".to_owned(), |adapter| adapter.get_info().name),
        };
        let git = Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).output();
        let commit = git.ok().filter(|o| o.status.success()).and_then(|o| String::from_utf8(o.stdout).ok());
        Origin {
            device: device.replace(',', " "),
            commit: commit.map_or_else(|| "unknown".to_owned(), |c| c.trim().to_owned()),
        }
    }
}

/// A point of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    pub problem: String,
    pub scheme: String,
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

const HEADER: &str = "problem,scheme,hertz,iterations,tolerance,refine,error,passes,seconds,particles,faults,state,backend,device,commit";

impl Record {
    pub fn new(problem: &str, setup: &Setup, error: f64, cost: &Cost, origin: &Origin) -> Record {
        Record {
            problem: problem.to_owned(),
            scheme: setup.scheme.name().to_owned(),
            hertz: 1.0 / setup.dt,
            iterations: setup.iterations,
            tolerance: setup.tolerance,
            refine: setup.refine,
            error,
            passes: cost.passes,
            seconds: cost.seconds,
            particles: cost.particles,
            faults: cost.faults,
            state: format!("{:016x}", cost.hash),
            backend: setup.backend.name().to_owned(),
            device: origin.device.clone(),
            commit: origin.commit.clone(),
        }
    }

    /// Passes times particles, which makes cell sizes comparable, or wall time, s.
    pub fn work(&self, seconds: bool) -> f64 {
        if seconds { self.seconds } else { self.passes * self.particles as f64 }
    }

    fn line(&self) -> String {
        format!(
            "{},{},{},{},{},{},{},{},{:.3},{},{},{},{},{},{}",
            self.problem,
            self.scheme,
            self.hertz.round(),
            self.iterations,
            self.tolerance,
            self.refine,
            self.error,
            self.passes.round(),
            self.seconds,
            self.particles,
            self.faults,
            self.state,
            self.backend,
            self.device,
            self.commit
        )
    }

    fn parse(line: &str) -> Option<Record> {
        let fields: Vec<&str> = line.split(',').collect();
        let [
            problem,
            scheme,
            hertz,
            iterations,
            tolerance,
            refine,
            error,
            passes,
            seconds,
            particles,
            faults,
            rest @ ..,
        ] = &fields[..]
        else {
            return None;
        };
        let [state, backend, device, commit] = rest else {
            return None;
        };
        Some(Record {
            problem: (*problem).to_owned(),
            scheme: (*scheme).to_owned(),
            hertz: hertz.parse().ok()?,
            iterations: iterations.parse().ok()?,
            tolerance: tolerance.parse().ok()?,
            refine: refine.parse().ok()?,
            error: error.parse().ok()?,
            passes: passes.parse().ok()?,
            seconds: seconds.parse().ok()?,
            particles: particles.parse().ok()?,
            faults: faults.parse().ok()?,
            state: (*state).to_owned(),
            backend: (*backend).to_owned(),
            device: (*device).to_owned(),
            commit: (*commit).to_owned(),
        })
    }
}

pub fn write(path: &Path, records: &[Record]) -> Result<(), Failure> {
    let lines: Vec<String> = records.iter().map(Record::line).collect();
    Ok(std::fs::write(path, format!("{HEADER}\n{}\n", lines.join("\n")))?)
}

pub fn read(path: &Path) -> Result<Vec<Record>, Failure> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut lines = text.lines();
    if lines.next() != Some(HEADER) {
        return Err(format!("{}: not a file of this bench", path.display()).into());
    }
    let parsed = lines.enumerate().map(|(k, line)| {
        Record::parse(line).ok_or_else(|| format!("{}: line {}: {line}", path.display(), k + 2).into())
    });
    parsed.collect()
}
