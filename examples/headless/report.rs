//! The results of a run: a JSON report, and a table for people.

use crate::Failure;
use crate::args::Args;
use crate::engine::Engine;
use crate::run::{BodyLoad, Record, Sample, Sensed};
use pbmpm::{Faults, Memory, Scheme, Solved, Spent, State, World};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[derive(serde::Serialize)]
pub struct Report {
    engine: &'static str,
    scene: String,
    scene_name: String,
    overrides: Vec<String>,
    backend: &'static str,
    /// The solver's adapter; the CPU paths have none.
    adapter: Option<String>,
    particles: Particles,
    settings: Settings,
    /// Steps taken.
    steps: u64,
    /// Number of iterations, and the largest error that they left.
    spent: Spent,
    sim_seconds: f64,
    /// From the start of the program, including files and pictures.
    wall_seconds: f64,
    stepping_seconds: f64,
    step_ms: Option<StepMs>,
    step_ms_method: &'static str,
    #[serde(serialize_with = "as_object")]
    stage_ms: Vec<(&'static str, f64)>,
    memory_bytes: MemoryBytes,
    state: State,
    series: Vec<Sample>,
    faults: Faults,
    /// Of the last step, in the implicit scheme.
    solved: Option<Solved>,
    state_hash: String,
    pictures: Vec<PathBuf>,
    dumps: Vec<PathBuf>,
}

#[derive(serde::Serialize)]
struct Particles {
    alive: u32,
    escaped: u64,
    quarantined: u64,
    emitted: u64,
    drained: u64,
    withheld: u64,
    asleep: u32,
}

#[derive(serde::Serialize)]
struct Settings {
    /// The longest, where `courant_cells` is not 0.
    dt_s: f64,
    scheme: Scheme,
    iterations: u32,
    tolerance: f64,
    courant_cells: f64,
    cell_size_m: f64,
}

#[derive(serde::Serialize)]
struct StepMs {
    min: f64,
    median: f64,
    mean: f64,
    max: f64,
}

#[derive(serde::Serialize)]
struct MemoryBytes {
    #[serde(flatten)]
    parts: Memory,
    total: u64,
}

fn as_object<S: serde::Serializer>(pairs: &[(&'static str, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().copied())
}

impl StepMs {
    fn of(times: &[f64]) -> Option<Self> {
        let mut sorted = times.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let middle = |i: usize| sorted[i.min(sorted.len() - 1)];
        let median = 0.5 * (middle((sorted.len() - 1) / 2) + middle(sorted.len() / 2));
        Some(StepMs { min, median, mean: sorted.iter().sum::<f64>() / sorted.len() as f64, max })
    }
}

impl Report {
    pub fn new(
        engine: &mut Engine,
        world: &World,
        scene: &Path,
        args: &Args,
        record: Record,
        wall: Duration,
    ) -> Result<Self, Failure> {
        let solver = engine.solver_mut();
        let end = solver.report()?;
        let stages = solver.stage_times();
        let memory = solver.memory();
        Ok(Report {
            engine: concat!("pbmpm ", env!("CARGO_PKG_VERSION")),
            scene: scene.display().to_string(),
            scene_name: world.name.clone(),
            overrides: args.overrides.clone(),
            backend: engine.backend(),
            adapter: engine.adapter(),
            particles: Particles {
                alive: end.alive,
                escaped: end.faults.escaped,
                quarantined: end.faults.quarantined,
                emitted: end.emitted,
                drained: end.drained,
                withheld: end.withheld,
                asleep: end.asleep,
            },
            settings: Settings {
                dt_s: world.settings.dt,
                scheme: world.settings.scheme,
                iterations: world.settings.iterations,
                tolerance: world.settings.tolerance,
                courant_cells: world.settings.courant,
                cell_size_m: world.domain.cell_size,
            },
            steps: end.step,
            spent: end.spent,
            sim_seconds: end.time,
            wall_seconds: wall.as_secs_f64(),
            stepping_seconds: record.stepping.as_secs_f64(),
            step_ms: StepMs::of(&record.step_ms),
            step_ms_method: engine.timing(),
            stage_ms: stages.into_iter().map(|s| (s.stage, s.seconds * 1e3)).collect(),
            memory_bytes: MemoryBytes { parts: memory, total: memory.total() },
            state: record.series.last().map(|s| s.state).unwrap_or_default(),
            series: record.series,
            faults: end.faults,
            solved: end.solved,
            state_hash: format!("{:016x}", pbmpm::state_hash(&record.particles)),
            pictures: record.pictures,
            dumps: record.dumps,
        })
    }

    pub fn to_json(&self) -> Result<String, Failure> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Two columns: names and values.
    pub fn table(&self, report: &Path) -> String {
        let mut rows: Vec<(&str, String)> = Vec::new();
        let mut row = |name, value| rows.push((name, value));
        row("scene", self.scene.clone());
        row("", self.scene_name.clone());
        row("engine", self.engine.to_owned());
        row("backend", self.backend.to_owned());
        row("adapter", self.adapter.clone().unwrap_or_else(|| "none".to_owned()));
        let p = &self.particles;
        row("particles", format!("{} ({} escaped, {} quarantined)", p.alive, p.escaped, p.quarantined));
        if p.asleep > 0 {
            row("", format!("{} asleep", p.asleep));
        }
        if p.emitted + p.drained + p.withheld > 0 {
            row("", format!("{} emitted, {} drained, {} withheld", p.emitted, p.drained, p.withheld));
        }
        let s = &self.settings;
        let iterations = if s.iterations == 1 { "iteration" } else { "iterations" };
        let each = format!("{} ms, {} {iterations}, cells of {} m", brief(s.dt_s * 1e3), s.iterations, s.cell_size_m);
        let most = if s.courant_cells > 0.0 { "at most " } else { "" };
        row("steps", format!("{} of {most}{each}", self.steps));
        row("simulated time", format!("{} s", brief(self.sim_seconds)));
        let stepping = brief(self.stepping_seconds);
        row("wall time", format!("{} s, {stepping} s of it in steps", brief(self.wall_seconds)));
        if let Some(t) = &self.step_ms {
            let [min, median, mean, max] = [t.min, t.median, t.mean, t.max].map(brief);
            row("ms per step", format!("min {min}, median {median}, mean {mean}, max {max}"));
        }
        self.stage_rows(&mut row);
        let m = &self.memory_bytes;
        let [particles, grid, bins, other] = [m.parts.particles, m.parts.grid, m.parts.bins, m.parts.other].map(mib);
        row(
            "memory, MiB",
            format!("{} = particles {particles} + grid {grid} + bins {bins} + other {other}", mib(m.total)),
        );
        let state = &self.state;
        row("centre of mass", format!("{} m", state.centre_of_mass_m.map(brief).join(", ")));
        row("kinetic energy", format!("{} J", brief(state.kinetic_j)));
        row("maximum speed", format!("{} m/s", brief(state.max_speed_m_s)));
        let [min, mean, max] = [state.volume_ratio.min, state.volume_ratio.mean, state.volume_ratio.max].map(brief);
        row("volume ratio", format!("min {min}, mean {mean}, max {max}"));
        if let Some(Solved { iterations, change, .. }) = self.solved {
            let Spent { iterations: all, capped, worst_change, .. } = self.spent;
            let worst = brief(worst_change);
            row("solves", format!("{all} iterations, {capped} ended by their number, worst {worst} of the velocities"));
            row("last solve", format!("{iterations} iterations, the last for {} of the velocities", brief(change)));
        }
        if let Some(sample) = self.series.last() {
            for BodyLoad { collider, force, .. } in &sample.loads {
                row(
                    "force",
                    format!("{} N on collider {collider}, mean of the last sample", force.map(brief).join(", ")),
                );
            }
            for Sensed { sensor, particles, mass_kg, .. } in &sample.sensors {
                row("sensor", format!("{} kg, {particles} particles in sensor {sensor}", brief(*mass_kg)));
            }
        }
        row("faults", self.faults_text());
        row("state hash", self.state_hash.clone());
        for (name, files) in [("pictures", &self.pictures), ("particle files", &self.dumps)] {
            match files.as_slice() {
                [] => {}
                [only] => row(name, only.display().to_string()),
                [first, .., last] => {
                    row(name, format!("{} … {} ({})", first.display(), last.display(), files.len()));
                }
            }
        }
        row("report", report.display().to_string());
        rows.iter().filter(|(_, value)| !value.is_empty()).fold(String::new(), |mut text, (name, value)| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name:<16}{value}");
            text
        })
    }

    fn stage_rows(&self, row: &mut impl FnMut(&'static str, String)) {
        let all: f64 = self.stage_ms.iter().map(|(_, ms)| ms).sum();
        let width = self.stage_ms.iter().map(|(stage, _)| stage.len()).max().unwrap_or(0);
        for (i, (stage, ms)) in self.stage_ms.iter().enumerate() {
            let name = if i == 0 { "ms by stage" } else { "" };
            row(name, format!("{stage:width$} {:>8} {:>4.0} %", brief(*ms), 100.0 * ms / all));
        }
    }

    fn faults_text(&self) -> String {
        let f = &self.faults;
        let counts: [(_, u64); 8] = [
            ("saturated nodes", f.saturated_nodes),
            ("speeds clamped", f.speed_clamped),
            ("gradients clamped", f.gradient_clamped),
            ("strains clamped", f.strain_clamped),
            ("escaped", f.escaped),
            ("quarantined", f.quarantined),
            ("refused", f.refused),
            ("steps deferred", f.steps_deferred),
        ];
        let found: Vec<_> = counts.iter().filter(|(_, n)| *n > 0).map(|(name, n)| format!("{n} {name}")).collect();
        if found.is_empty() { "none".to_owned() } else { found.join(", ") }
    }
}

/// Four digits.
fn brief(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        size if (1e-3..1e6).contains(&size) => format!("{x:.*}", (3.0 - size.log10().floor()).clamp(0.0, 6.0) as usize),
        _ => format!("{x:.3e}"),
    }
}

fn mib(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / f64::from(1 << 20))
}
