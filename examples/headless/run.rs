//! The run: steps, and samples and pictures in between.

use crate::Failure;
use crate::args::{Args, Dump};
use crate::engine::Engine;
use crate::output::{Artist, write_ply};
use indicatif::{ProgressBar, ProgressStyle};
use pbmpm::{Loads, Particle, Settings, Simulate, State, World};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Steps at the end of a GPU run in which the stages are timed one by one.
const MEASURED_STEPS: u32 = 32;

/// The results of a run.
#[derive(Default)]
pub struct Record {
    /// Time of each step, ms, without those in which the stages were measured.
    pub step_ms: Vec<f64>,
    /// Time spent in steps, measured ones included.
    pub stepping: Duration,
    pub series: Vec<Sample>,
    /// Loads of the bodies at the last sample.
    loads: Loads,
    /// The particles at the end.
    pub particles: Vec<Particle>,
    pub pictures: Vec<PathBuf>,
    pub dumps: Vec<PathBuf>,
}

/// The state at one time.
#[derive(Clone, serde::Serialize)]
pub struct Sample {
    /// Steps of `dt`, however many shorter ones were taken instead.
    pub step: u32,
    pub time_s: f64,
    pub state: State,
    /// For colliders that are measured: the mean load exerted by the matter since the previous sample.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loads: Vec<BodyLoad>,
    /// At the end of the last step; none before the first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sensors: Vec<Sensed>,
}

/// A mean since the previous sample.
#[derive(Clone, serde::Serialize)]
pub struct BodyLoad {
    pub collider: String,
    /// N
    pub force: [f64; 3],
    /// About the collider's position, N m.
    pub torque: [f64; 3],
}

/// The contents of a sensor.
#[derive(Clone, serde::Serialize)]
pub struct Sensed {
    pub sensor: String,
    pub particles: u32,
    pub mass_kg: f64,
    pub velocity_m_s: [f64; 3],
}

/// The name, or the index of something that has no name.
fn named(name: &str, index: usize) -> String {
    if name.is_empty() { index.to_string() } else { name.to_owned() }
}

/// When samples, pictures and measurements are due.
struct Plan {
    total: u32,
    every: u32,
    /// Steps after which there is a picture, ascending.
    frames: Vec<u32>,
    measure_from: u32,
}

impl Plan {
    fn new(args: &Args, total: u32) -> Self {
        let count = u64::from(args.frames);
        let mut frames: Vec<u32> = (1..=count).map(|k| (k * u64::from(total) / count) as u32).collect();
        frames.dedup();
        Plan {
            total,
            every: args.every.unwrap_or((total / 60).max(1)),
            frames,
            // Short runs keep half of their steps for the plain times.
            measure_from: total - MEASURED_STEPS.min(total / 2),
        }
    }

    fn is_frame(&self, step: u32) -> bool {
        self.frames.binary_search(&step).is_ok()
    }

    fn is_sample(&self, step: u32) -> bool {
        step == self.total || step.is_multiple_of(self.every)
    }

    /// The first step after `step` at which one of them is due.
    fn stop_after(&self, step: u32) -> u32 {
        let sample = (step / self.every).saturating_add(1).saturating_mul(self.every);
        let frame = self.frames.get(self.frames.partition_point(|f| *f <= step)).copied();
        let measure = Some(self.measure_from).filter(|m| *m > step);
        [Some(sample), frame, measure].into_iter().flatten().fold(self.total, u32::min)
    }
}

/// Takes `total` steps, or shorter ones over the same time.
pub fn run(
    engine: &mut Engine,
    artist: Option<&Artist>,
    world: &World,
    args: &Args,
    total: u32,
) -> Result<Record, Failure> {
    let plan = Plan::new(args, total);
    let bar = progress_bar(args, total);
    let mut record = Record::default();
    let (mut step, mut measuring) = (0, false);
    loop {
        if plan.is_sample(step) {
            sample(&mut record, engine, world, args, step)?;
        }
        if let Some(artist) = artist.filter(|_| plan.is_frame(step)) {
            let path = args.out.join(format!("frame_{step:06}.png"));
            artist.draw(engine, &path)?;
            record.pictures.push(path);
        }
        if step == total {
            break;
        }
        if step == plan.measure_from {
            measuring = engine.measure_stages();
        }
        let count = (plan.stop_after(step) - step).min(engine.batch(&world.settings));
        let start = Instant::now();
        let taken = take(engine.solver_mut(), &world.settings, count)?;
        let elapsed = start.elapsed();
        record.stepping += elapsed;
        if !measuring {
            let each = elapsed.as_secs_f64() * 1e3 / f64::from(taken);
            record.step_ms.extend((0..taken).map(|_| each));
        }
        step += count;
        bar.set_position(step.into());
    }
    bar.finish_and_clear();
    Ok(record)
}

/// Advances by the time of `count` steps of `dt`, in shorter ones where the settings divide them; returns how many were
/// taken.
fn take(solver: &mut dyn Simulate, settings: &Settings, count: u32) -> Result<u32, Failure> {
    if settings.courant > 0.0 {
        return Ok(solver.advance(f64::from(count) * settings.dt)?.steps);
    }
    solver.steps(count)?;
    Ok(count)
}

fn sample(record: &mut Record, engine: &mut Engine, world: &World, args: &Args, step: u32) -> Result<(), Failure> {
    let solver = engine.solver_mut();
    record.particles = solver.particles()?;
    let state = State::of(&record.particles, solver.gravity());
    let loads = if world.colliders.iter().any(|c| c.measure) { solver.loads()? } else { Loads::default() };
    let means = world.colliders.iter().enumerate().filter_map(|(i, collider)| {
        let mean = loads.mean_since(&record.loads, i)?;
        let (force, torque) = (mean.force.to_array(), mean.torque.to_array());
        Some(BodyLoad { collider: named(&collider.name, i), force, torque })
    });
    let means = means.collect();
    // Each reading waits for a device; before the first step there are none.
    let read = !world.sensors.is_empty() && (step > 0 || args.restore.is_some());
    let readings = if read { solver.sensors()? } else { Vec::new() };
    let sensed = world.sensors.iter().zip(readings).enumerate().map(|(i, (sensor, reading))| Sensed {
        sensor: named(&sensor.name, i),
        particles: reading.count,
        mass_kg: reading.mass,
        velocity_m_s: reading.velocity().to_array(),
    });
    let sensors = sensed.collect();
    record.series.push(Sample { step, time_s: solver.time(), state, loads: means, sensors });
    record.loads = loads;
    if args.dump == Some(Dump::Ply) {
        let path = args.out.join(format!("particles_{step:06}.ply"));
        write_ply(&path, world, &record.particles)?;
        record.dumps.push(path);
    }
    Ok(())
}

/// Shows nothing where standard error is not a terminal.
fn progress_bar(args: &Args, total: u32) -> ProgressBar {
    if args.quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} steps, {eta} left");
    let bar = ProgressBar::new(total.into());
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
