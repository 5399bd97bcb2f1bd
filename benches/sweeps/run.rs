//! The devices that take the steps, and how steps are timed.

use crate::report::record::Row;
use crate::suite::file::Failure;
use crate::suite::origin::Origin;
use crate::suite::setup;
use cpu_time::ProcessTime;
use pbmpm::{AdapterChoice, CpuSolver, Faults, GpuOptions, Headless, Simulate, Snapshot, World, state_hash};
use std::time::{Duration, Instant};
use wgpu::DeviceType;

/// Steps that a solver takes after it has restored a state, before it is timed.
const RUN_IN: u32 = 2;
/// Time that a graphics processor works before it is timed: an idle one is at a fraction of its clock.
const WARM_UP: Duration = Duration::from_millis(300);

/// The CPU path or an adapter, with its names.
#[derive(Debug, Clone)]
pub struct Place {
    /// Name used for its record, in lower case.
    pub name: String,
    /// `None` is the CPU path.
    adapter: Option<String>,
    /// Whether a processor does the work: the CPU path, or a software adapter.
    pub on_processor: bool,
    device: String,
    driver: String,
    threads: usize,
    commit: String,
}

impl Place {
    /// `cpu`, or part of the name of an adapter.
    pub fn find(asked: &str) -> Result<Place, Failure> {
        let cpu = asked == "cpu";
        let origin = Origin::find(if cpu { setup::Backend::Cpu } else { setup::Backend::Gpu }, asked);
        let threads = std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
        let threads = threads.or(std::thread::available_parallelism().map(usize::from).ok()).unwrap_or(1);
        let known = Place {
            name: "cpu".to_owned(),
            adapter: None,
            on_processor: true,
            device: origin.device,
            driver: "none".to_owned(),
            threads,
            commit: origin.commit,
        };
        if cpu {
            return Ok(known);
        }
        let info = pbmpm::choose_adapter(&AdapterChoice { name: asked.to_owned() })?.get_info();
        let words = info.name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
        // The part in brackets is the driver's.
        let brief = info.name.split('(').next().unwrap_or_default().trim().len();
        let words = words.take_while(|w| w.as_ptr() as usize - (info.name.as_ptr() as usize) < brief);
        Ok(Place {
            name: words.collect::<Vec<_>>().join("-").to_lowercase(),
            adapter: Some(asked.to_owned()),
            on_processor: info.device_type == DeviceType::Cpu,
            driver: format!("{} {}, {:?}", info.driver, info.driver_info, info.backend),
            ..known
        })
    }

    pub fn is_cpu(&self) -> bool {
        self.adapter.is_none()
    }

    /// A solver of `world`, which on a device measures its stages if requested and supported.
    pub fn solver(&self, world: &World, stages: bool) -> Result<Box<dyn Simulate>, Failure> {
        let Some(name) = &self.adapter else {
            return Ok(Box::new(CpuSolver::<f32>::new(world)?));
        };
        let mut solver = Headless::new(world, &AdapterChoice { name: name.clone() }, &GpuOptions::default())?;
        if stages && !solver.measure_stages() {
            return Err("the adapter has no timestamps".into());
        }
        Ok(Box::new(solver))
    }

    /// A solver that resumes `state`.
    pub fn resumed(&self, world: &World, state: &Snapshot, stages: bool) -> Result<Box<dyn Simulate>, Failure> {
        let mut solver = self.solver(world, stages)?;
        if !self.on_processor {
            warm_up(&mut *solver)?;
        }
        solver.restore(state)?;
        solver.steps(RUN_IN)?;
        Ok(solver)
    }

    /// A solver of `world` at its start, ready to be timed.
    pub fn warmed(&self, world: &World) -> Result<Box<dyn Simulate>, Failure> {
        if !self.on_processor {
            warm_up(&mut *self.solver(world, false)?)?;
        }
        self.solver(world, false)
    }

    /// The properties of a solver and its world, without times.
    pub fn row(&self, sweep: &str, point: &str, world: &World, solver: &mut dyn Simulate) -> Result<Row, Failure> {
        let report = solver.report()?;
        let memory = solver.memory();
        let Faults { saturated_nodes, speed_clamped, gradient_clamped, escaped, quarantined, .. } = report.faults;
        let faults = [saturated_nodes, speed_clamped, gradient_clamped, escaped, quarantined];
        Ok(Row {
            sweep: sweep.to_owned(),
            point: point.to_owned(),
            particles: report.alive as usize,
            iterations: f64::from(world.settings.iterations),
            cell_size: world.domain.cell_size,
            hertz: 1.0 / world.settings.dt,
            active_blocks: f64::from(report.active_blocks),
            particle_bytes: memory.particles,
            grid_bytes: memory.grid,
            bin_bytes: memory.bins,
            other_bytes: memory.other,
            faults: faults.into_iter().sum(),
            state: format!("{:016x}", state_hash(&solver.particles()?)),
            backend: self.name.clone(),
            device: self.device.clone(),
            driver: self.driver.clone(),
            threads: self.threads,
            commit: self.commit.clone(),
            ..Row::default()
        })
    }
}

/// Lets a graphics processor work for a while.
fn warm_up(solver: &mut dyn Simulate) -> Result<(), Failure> {
    let begin = Instant::now();
    while begin.elapsed() < WARM_UP {
        solver.steps(8)?;
    }
    Ok(())
}

/// The state after this many steps, taken on the CPU path, so that every device begins with the same.
pub fn state_after(world: &World, steps: u32) -> Result<Snapshot, Failure> {
    let mut solver = CpuSolver::<f32>::new(world)?;
    solver.steps(steps.saturating_sub(RUN_IN))?;
    Ok(solver.save()?)
}

/// Times of steps, ms: elapsed, and of the processor over all threads, which other programs affect less.
#[derive(Debug, Clone, Default)]
pub struct Times {
    pub wall: Vec<f64>,
    pub processor: Vec<f64>,
}

impl Times {
    pub fn len(&self) -> usize {
        self.wall.len()
    }

    /// Times an operation of this many steps as one measurement.
    pub fn add(&mut self, steps: u32, what: impl FnOnce() -> pbmpm::Result<()>) -> Result<(), Failure> {
        let (processor, start) = (ProcessTime::now(), Instant::now());
        what()?;
        let ms = |time: Duration| time.as_secs_f64() * 1e3 / f64::from(steps);
        self.wall.push(ms(start.elapsed()));
        self.processor.push(ms(processor.elapsed()));
        Ok(())
    }

    /// Fills the columns of a row.
    pub fn fill(self, row: &mut Row, on_processor: bool) {
        row.steps = self.len();
        row.min_ms = self.wall.iter().copied().fold(f64::INFINITY, f64::min);
        row.max_ms = self.wall.iter().copied().fold(0.0, f64::max);
        row.mean_ms = self.wall.iter().sum::<f64>() / self.len() as f64;
        row.median_ms = median(self.wall);
        row.processor_ms = on_processor.then(|| median(self.processor));
    }
}

pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let n = numbers.len();
    0.5 * (numbers[(n - 1) / 2] + numbers[n / 2])
}

/// The thesis' measurement: each step by itself, waited for, in five windows of this many steps.
pub fn windows(solver: &mut dyn Simulate, steps: u32) -> Result<(Times, f64), Failure> {
    const WINDOWS: u32 = 5;
    let mut times = Times::default();
    let mut blocks = 0.0;
    for _ in 0..WINDOWS {
        for _ in 0..steps {
            times.add(1, || solver.step())?;
        }
        blocks += f64::from(solver.report()?.active_blocks) / f64::from(WINDOWS);
    }
    Ok((times, blocks))
}
