//! Time of one step of the thesis basin at the baseline of its sweeps (30 Hz, one iteration, 31,250 particles, 1 m
//! cells), stirred: after 100 steps. All backends run in this one process, so that their ratios are valid on a noisy
//! machine. Each line is preceded by the hash of the state that was reached, which reveals a faster but wrong result.
//!
//! `cargo bench --bench steps`; with `-- basin/cpu` only what matches.

use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main, measurement::WallTime};
use pbmpm::{AdapterChoice, CpuSolver, GpuOptions, Headless, Simulate, World, state_hash};
use std::path::Path;
use std::time::{Duration, Instant};

const WARM_UP_STEPS: u32 = 100;

fn basin() -> World {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/thesis_basin.json");
    pbmpm::scene::from_file(&path).unwrap_or_else(|error| panic!("{error}"))
}

fn measure(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, solver: &mut dyn Simulate) {
    let failed = |error| panic!("{name}: {error}");
    solver.steps(WARM_UP_STEPS).unwrap_or_else(failed);
    let particles = solver.particles().unwrap_or_else(|error| panic!("{name}: {error}"));
    let memory = solver.memory().total() as f64 / f64::from(1 << 20);
    println!("basin/{name}: state {:016x} after {WARM_UP_STEPS} steps, {memory:.2} MiB", state_hash(&particles));
    group.bench_function(name, |bencher| {
        bencher.iter_custom(|steps| {
            let start = Instant::now();
            solver.steps(steps as u32).unwrap_or_else(failed);
            start.elapsed()
        });
    });
}

fn steps(criterion: &mut Criterion) {
    let world = basin();
    let mut group = criterion.benchmark_group("basin");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(5));
    measure(&mut group, "cpu", &mut CpuSolver::<f32>::new(&world).unwrap_or_else(|error| panic!("{error}")));
    measure(&mut group, "cpu64", &mut CpuSolver::<f64>::new(&world).unwrap_or_else(|error| panic!("{error}")));
    for adapter in pbmpm::adapters() {
        let info = adapter.get_info();
        let choice = AdapterChoice { name: format!("{} ({}, {:?})", info.name, info.driver, info.backend) };
        let name = format!("{:?} {}", info.backend, info.name);
        match Headless::new(&world, &choice, &GpuOptions::default()) {
            Ok(mut solver) => measure(&mut group, &name, &mut solver),
            Err(error) => println!("basin/{name}: not measured: {error}"),
        }
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
