//! Steps a small mixed scene for a long time and checks whether anything grows: memory, wgpu's objects, energy.
//!
//! ```text
//! cargo run --release --example soak                                   a million steps on the CPU path
//! cargo run --release --example soak -- --adapter llvmpipe --steps 100000
//! ```

use clap::Parser;
use pbmpm::{
    Action, Collider, CpuSolver, DVec3, Emitter, GpuOptions, GpuSolver, Material, Rate, Region, Scheme, ScriptedTool,
    Shape, Simulate, Spawn, State, StepReport, World,
};
use std::time::{Duration, Instant};

type Failure = Box<dyn std::error::Error>;

/// Steps a small mixed scene for a long time and fails if anything grows.
#[derive(Debug, Parser)]
struct Args {
    /// Steps to take
    #[arg(long, default_value_t = 1_000_000)]
    steps: u64,
    /// Part of the name of the graphics adapter to use [default: the CPU path]
    #[arg(long)]
    adapter: Option<String>,
}

/// Number of checks.
const SAMPLES: u64 = 20;
/// Samples until the state is steady: buffers have grown, the matter has settled.
const WARM: usize = 4;

/// Quantities that may not grow.
struct Sample {
    step: u64,
    report: StepReport,
    /// Bytes of the solver, and of the whole process if the system reports them.
    solver: u64,
    process: u64,
    /// Objects that wgpu keeps.
    objects: usize,
    /// J; 0 on a device, whose particles are not read.
    kinetic: f64,
}

/// Water, rubber and sand in a stirred tank with an emitter that drips water and a drain.
fn world() -> World {
    let cell = 0.02;
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) * cell;
    let mut world = World::new(DVec3::ZERO, DVec3::splat(12.0 * cell), cell);
    world.settings.scheme = Scheme::Published;
    world.settings.dt = 1.0 / 120.0;
    world.settings.iterations = 2;
    world.settings.capacity = Some(1500);
    world.materials = vec![Material::liquid("water"), Material::elastic("rubber"), Material::sand("sand", 30.0)];
    world.spawns = vec![
        Spawn::cuboid("water", at(0.5, 1.0, 0.5), at(5.5, 5.0, 5.5)),
        Spawn::cuboid("rubber", at(7.0, 6.0, 7.0), at(9.0, 8.0, 9.0)),
        Spawn::cuboid("sand", at(7.0, 2.0, 1.0), at(10.0, 4.0, 4.0)),
    ];
    let mut rotor = Collider::new(Shape::Box { half_size: at(2.5, 0.75, 0.5) }, at(6.0, 1.5, 6.0));
    rotor.angular_velocity = DVec3::Y * 3.0;
    world.colliders.push(rotor);
    let tap = Shape::Sphere { radius: cell };
    world.emitters.push(Emitter::new("water", tap, at(3.0, 10.0, 9.0), Rate::Particles(60.0)));
    world.drains.push(Region::new(Shape::Sphere { radius: 1.5 * cell }, at(11.0, 0.5, 11.0)));
    let stir = Action::Stir { angular_velocity: DVec3::Y * 4.0, time: 0.2 };
    world.tools.push(ScriptedTool::new(stir, 3.0 * cell, at(6.0, 4.0, 6.0)));
    world
}

fn main() -> Result<(), Failure> {
    let args = Args::parse();
    let start = Instant::now();
    let samples = match &args.adapter {
        None => on_cpu(args.steps)?,
        Some(name) => on_device(args.steps, name)?,
    };
    for s in &samples {
        let Sample { step, solver, process, objects, kinetic, report } = s;
        let (alive, faults) = (report.alive, report.faults);
        println!(
            "{step:9}: {alive} alive, {kinetic:.3e} J, {solver} B, process {process} B, {objects} objects, {faults:?}"
        );
    }
    judge(&samples)?;
    println!("nothing grew in {} steps, {:.0} s", args.steps, start.elapsed().as_secs_f64());
    Ok(())
}

fn judge(samples: &[Sample]) -> Result<(), Failure> {
    let (warm, last) = (&samples[WARM], samples.last().ok_or("no sample")?);
    let later = || samples[WARM..].iter();
    let middle = samples.len() / 2;
    let most = |of: &[Sample]| of.iter().map(|s| s.kinetic).fold(0.0, f64::max);
    let fastest = |of: &[Sample]| of.iter().map(|s| s.report.max_speed).fold(0.0, f64::max);
    let spawned = world().particle_count()? as u64;
    let accounted = samples.iter().map(|s| &s.report).all(|r| {
        let gone = r.drained + r.faults.escaped + r.faults.quarantined;
        spawned + r.emitted == u64::from(r.alive) + gone
    });
    let rules = [
        ("a particle is not accounted for", accounted),
        ("a particle is not made of numbers", last.report.faults.quarantined == 0),
        ("wgpu keeps more objects", later().all(|s| s.objects == warm.objects)),
        ("the solver takes more memory", later().all(|s| s.solver <= warm.solver + warm.solver / 4)),
        ("the process takes more memory", later().all(|s| s.process <= warm.process + (16 << 20))),
        ("there is more energy", most(&samples[middle..]) <= 2.0 * most(&samples[1..middle])),
        ("the fastest are faster", fastest(&samples[middle..]) <= 2.0 * fastest(&samples[1..middle])),
    ];
    match rules.into_iter().find(|(_, kept)| !kept) {
        None => Ok(()),
        Some((broken, _)) => Err(broken.into()),
    }
}

fn on_cpu(steps: u64) -> Result<Vec<Sample>, Failure> {
    let mut solver = CpuSolver::<f32>::new(&world())?;
    let mut samples = Vec::new();
    for k in 0..=SAMPLES {
        while solver.report()?.step < steps * k / SAMPLES {
            solver.step()?;
        }
        let kinetic = State::of(&solver.particles()?, solver.gravity()).kinetic_j;
        let report = solver.report()?;
        let bytes = solver.memory().total();
        samples.push(Sample {
            step: report.step,
            report,
            solver: bytes,
            process: process_bytes(),
            objects: 0,
            kinetic,
        });
    }
    Ok(samples)
}

fn on_device(steps: u64, name: &str) -> Result<Vec<Sample>, Failure> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let named = |a: &wgpu::Adapter| a.get_info().name.to_lowercase().contains(&name.to_lowercase());
    let adapter = adapters.into_iter().find(named).ok_or_else(|| format!("no adapter is called {name}"))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default()))?;
    let mut solver = GpuSolver::new(&device, &queue, &world(), &GpuOptions::default())?;
    let mut samples = Vec::new();
    let mut report = StepReport::default();
    for k in 0..=SAMPLES {
        let target = steps * k / SAMPLES;
        loop {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            for _ in 0..8.min(target.saturating_sub(solver.step())) {
                solver.encode_step(&mut encoder)?;
            }
            solver.encode_report(&mut encoder);
            let submission_index = Some(queue.submit([encoder.finish()]));
            device.poll(wgpu::PollType::Wait { submission_index, timeout: Some(Duration::from_secs(60)) })?;
            report = solver.poll_report()?.unwrap_or(report);
            if report.step >= target && solver.step() == report.step {
                break;
            }
        }
        let hub = instance.generate_report().ok_or("wgpu tells nothing")?;
        let hub = hub.hub_report();
        let objects = [&hub.buffers, &hub.bind_groups, &hub.textures, &hub.compute_pipelines, &hub.shader_modules];
        let objects = objects.iter().map(|kind| kind.num_allocated).sum();
        let bytes = solver.memory().total();
        let sample =
            Sample { step: report.step, report, solver: bytes, process: process_bytes(), objects, kinetic: 0.0 };
        samples.push(sample);
    }
    Ok(samples)
}

/// Resident memory of this process; 0 if the system does not report it.
fn process_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or("0 kB");
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap_or(0) * 1024
}
