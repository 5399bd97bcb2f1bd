//! What a guest's solver does when it needs more room, and when the device has no more.

use crate::alike::assert_positions;
use crate::backends::{Backend, NATIVE, Tests};
use crate::guest::{Host, small};
use crate::worlds::{DX, ball, block, body, busy, cuboid};
use pbmpm::{
    Action, CpuSolver, DQuat, DVec3, Emitter, Error, Fill, GpuOptions, GpuSolver, Pose, Rate, Region, Scheme, Simulate,
    Spawn, StepReport, Tool, UVec3,
};
use std::time::Duration;

/// The longest step asked for, s.
const DT: f64 = 1.0 / 120.0;

pub fn add(tests: &mut Tests) {
    tests.each(
        "guest_growth",
        NATIVE,
        "a_grid_grows_as_far_as_the_device_allows",
        a_grid_grows_as_far_as_the_device_allows,
    );
    tests.each("guest_growth", NATIVE, "small_limits_are_named", small_limits_are_named);
    tests.each("guest_growth", NATIVE, "what_fits_a_device_can_be_added", what_fits_a_device_can_be_added);
    tests.each(
        "guest_growth",
        NATIVE,
        "a_grid_grows_while_steps_are_in_flight",
        a_grid_grows_while_steps_are_in_flight,
    );
    tests.each("guest_growth", NATIVE, "steps_are_taken_again_as_asked", steps_are_taken_again_as_asked);
}

/// Where there is no room for twice the blocks, the grid grows by what there is room for.
fn a_grid_grows_as_far_as_the_device_allows(backend: Backend) {
    let mut world = busy();
    world.settings.scheme = Scheme::Implicit;
    let mut cpu = CpuSolver::<f32>::new(&world).unwrap();
    cpu.steps(3).unwrap();
    let needed = cpu.report().unwrap().active_blocks;
    // Too few, but so many that the table of blocks keeps its size.
    let few = (1 << (needed - 1).ilog2()) + 1;
    assert!(few < needed, "{needed}");
    let first = GpuOptions { grid_blocks: Some(few), ..GpuOptions::default() };
    // A node takes 32 bytes in the implicit scheme; there is room for what is needed, and no more.
    let room = 32 * 64 * u64::from(needed);
    let limits = wgpu::Limits { max_storage_buffer_binding_size: room, ..wgpu::Limits::default() };
    let host = Host::new(backend, limits);
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &first).unwrap();
    let mut taken = 0;
    for _ in 0..12 {
        let mut encoder = host.encoder();
        if solver.step() < 3 {
            solver.encode_step(&mut encoder).unwrap();
        }
        solver.encode_report(&mut encoder);
        host.submit(encoder);
        taken = solver.poll_report().unwrap().map_or(taken, |report| report.step);
    }
    assert_eq!(taken, 3);
    let position = host.read(solver.particle_buffers().position, host.encoder());
    assert_positions(backend, &position, &cpu.gpu_layout().position);
}

/// A device whose limits are too small is refused with the name of the limit, before anything is created.
fn small_limits_are_named(backend: Backend) {
    let defaults = wgpu::Limits::default;
    let cases = [
        ("max_storage_buffers_per_shader_stage", wgpu::Limits::downlevel_defaults()),
        (
            "max_storage_buffers_per_shader_stage",
            wgpu::Limits { max_storage_buffers_per_shader_stage: 7, ..defaults() },
        ),
        ("max_compute_workgroup_storage_size", wgpu::Limits { max_compute_workgroup_storage_size: 1024, ..defaults() }),
        (
            "max_compute_invocations_per_workgroup",
            wgpu::Limits { max_compute_invocations_per_workgroup: 32, ..defaults() },
        ),
        ("max_bindings_per_bind_group", wgpu::Limits { max_bindings_per_bind_group: 8, ..defaults() }),
        (
            "max_uniform_buffers_per_shader_stage",
            wgpu::Limits { max_uniform_buffers_per_shader_stage: 2, ..defaults() },
        ),
        (
            "max_dynamic_uniform_buffers_per_pipeline_layout",
            wgpu::Limits { max_dynamic_uniform_buffers_per_pipeline_layout: 1, ..defaults() },
        ),
        (
            "max_compute_workgroups_per_dimension",
            wgpu::Limits { max_compute_workgroups_per_dimension: 1024, ..defaults() },
        ),
        ("max_uniform_buffer_binding_size", wgpu::Limits { max_uniform_buffer_binding_size: 128, ..defaults() }),
        ("max_storage_buffer_binding_size", wgpu::Limits { max_storage_buffer_binding_size: 4096, ..defaults() }),
        ("max_buffer_size", wgpu::Limits { max_buffer_size: 8192, ..defaults() }),
    ];
    for (expected, limits) in cases {
        let host = Host::new(backend, limits);
        let error = GpuSolver::new(&host.device, &host.queue, &small(), &GpuOptions::default()).unwrap_err();
        match &error {
            Error::Unsupported { what, available, needed, .. } => {
                assert_eq!(*what, expected, "{error}");
                assert!(available < needed, "{error}");
            }
            other => panic!("{expected}: {other}"),
        }
        assert!(error.to_string().contains(expected), "{error}");
    }
    let needed = GpuSolver::required_limits(&small(), &GpuOptions::default()).unwrap();
    assert_eq!(needed, wgpu::Limits::default(), "a small world needs nothing above the defaults");
    let large = GpuOptions { grid_blocks: Some(1 << 20), ..GpuOptions::default() };
    let needed = GpuSolver::required_limits(&small(), &large).unwrap();
    assert_eq!(needed.max_buffer_size, 1 << 30, "a million blocks of 64 nodes of 16 bytes");
    // The space for many bodies in all steps in flight.
    let mut crowd = small();
    crowd.colliders = vec![body(ball(0.1), [1.0; 3]); 4096];
    let many = GpuOptions { steps_in_flight: 1024, ..GpuOptions::default() };
    let needed = GpuSolver::required_limits(&crowd, &many).unwrap();
    assert!(needed.max_buffer_size > 500 << 20, "{}", needed.max_buffer_size);
    let host = Host::new(backend, defaults());
    let error = GpuSolver::new(&host.device, &host.queue, &crowd, &many).unwrap_err();
    assert!(matches!(&error, Error::Unsupported { what: "max_buffer_size", .. }), "{error}");
    assert!(error.to_string().contains("fewer steps in flight"), "{error}");
}

/// If twice the room for the added particles would exceed the device's limits, there is just enough, step after step.
fn what_fits_a_device_can_be_added(backend: Backend) {
    let limits = wgpu::Limits { max_storage_buffer_binding_size: 48 * 20_000, ..wgpu::Limits::default() };
    let host = Host::new(backend, limits);
    let mut world = small();
    world.settings.scheme = Scheme::Published;
    world.settings.capacity = Some(20_000);
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &GpuOptions::default()).unwrap();
    let mut encoder = host.encoder();
    let fine = Spawn { fill: Fill::PerCell(64.0), ..block([1.0; 3], [7.0, 6.0, 6.0], [0.0; 3]) };
    let count = solver.add(&fine).unwrap();
    assert!(count > 9_000, "{count}");
    solver.encode_step(&mut encoder).unwrap();
    // The first ones have not been read yet.
    assert_eq!(solver.add(&block([8.0; 3], [10.0; 3], [0.0; 3])), Ok(64));
    solver.encode_step(&mut encoder).unwrap();
    assert_eq!(solver.add(&Spawn { fill: Fill::PerCell(27.0), ..fine.clone() }).map(|n| n > 3_000), Ok(true));
    solver.encode_step(&mut encoder).unwrap();
    assert!(solver.encode_report(&mut encoder));
    host.submit(encoder);
    let report = solver.poll_report().unwrap().expect("it was waited for");
    assert_eq!((report.step, report.faults.refused), (3, 0));
    assert!(report.emitted > 12_000 + 64, "{}", report.emitted);

    // Emitters need room in the same step.
    let tap = Emitter::new("water", ball(1.0), DVec3::splat(9.0) * DX, Rate::Particles(12_000.0));
    world.emitters.push(tap);
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &GpuOptions::default()).unwrap();
    let filled = |x: u32| Spawn { fill: Fill::Inclusive(UVec3::new(x, 25, 20)), ..fine.clone() };
    let error = solver.add(&filled(40)).expect_err("exactly what the device has room for");
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    assert_eq!(solver.add(&filled(39)), Ok(19_500));
    assert_eq!(solver.encode_step(&mut host.encoder()), Ok(true));
}

/// For a host that waits only for the fourth last submission: while the grid is being enlarged, further counters that
/// report it as full are in flight.
fn a_grid_grows_while_steps_are_in_flight(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let world = small();
    let options = GpuOptions { grid_blocks: Some(8), ..GpuOptions::default() };
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &options).unwrap();
    let (mut submitted, mut taken, mut waits) = (Vec::new(), 0, 0);
    for frame in 0..100 {
        let mut encoder = host.encoder();
        if solver.step() < 12 {
            let before = solver.step();
            let recorded = solver.encode_step(&mut encoder).unwrap();
            waits += u32::from(!recorded);
            assert!(recorded || solver.step() <= before, "the clock goes on without a step");
        }
        solver.encode_report(&mut encoder);
        submitted.push(host.queue.submit([encoder.finish()]));
        if frame >= 3 {
            let index = Some(submitted[frame - 3].clone());
            let wait = wgpu::PollType::Wait { submission_index: index, timeout: Some(Duration::from_secs(60)) };
            host.device.poll(wait).expect("the device answers");
        }
        taken = solver.poll_report().unwrap().map_or(taken, |report| report.step);
        if taken == 12 {
            break;
        }
    }
    assert_eq!((taken, solver.step()), (12, 12));
    assert!(waits > 0, "the host was not told that nothing was recorded");
    let mut cpu = CpuSolver::<f32>::new(&world).unwrap();
    cpu.steps(12).unwrap();
    let position = host.read(solver.particle_buffers().position, host.encoder());
    assert_positions(backend, &position, &cpu.gpu_layout().position);
}

/// Asks a solver for something else of everything in a step.
macro_rules! ask {
    ($solver:expr, $step:expr) => {{
        let x = $step as f64;
        let acceleration = DVec3::new(10.0 * x.sin(), 20.0, 5.0 * ($step % 3) as f64);
        let (action, velocity) = (Action::Push { acceleration }, DVec3::ZERO);
        let tool = Tool { action, radius: 0.1, position: DVec3::new(0.1, 0.1, 0.12), velocity };
        $solver.set_tools(&[tool]).unwrap();
        $solver.set_dt(DT * (1.0 - 0.02 * x)).unwrap();
        $solver.set_gravity(DVec3::new(x.cos(), -9.81, 0.0)).unwrap();
        $solver.set_emission(0, Rate::Particles(500.0 * x)).unwrap();
        let at = DVec3::new(8.0, 3.0 + 0.1 * x, 5.0) * DX;
        let pose = ($step % 2 == 0).then_some(Pose { position: at, rotation: DQuat::IDENTITY });
        $solver.set_collider(0, pose, DVec3::X * (0.1 * x), DVec3::Y * x).unwrap();
        $solver.add(&block([3.0 + 0.5 * x, 9.0, 3.0], [3.5 + 0.5 * x, 9.5, 5.0], [0.0, -1.0, 0.0])).unwrap();
        $solver.remove(&Region::new(cuboid([0.4, 4.0, 0.5]), DVec3::new(3.0 + 0.4 * x, 6.0, 6.0) * DX)).unwrap();
    }};
}

/// The grid is too small from the first step on, which the host learns only after it has recorded and submitted several,
/// each with other requests. They are taken as they were asked for, and what the host asks for meanwhile comes after
/// them.
fn steps_are_taken_again_as_asked(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let mut world = small();
    world.settings.capacity = Some(4000);
    world.colliders.push(body(cuboid([1.0; 3]), [8.0, 3.0, 5.0]));
    world.emitters.push(Emitter::new("water", ball(0.5), DVec3::new(9.0, 9.0, 9.0) * DX, Rate::Particles(0.0)));
    let mut cpu = CpuSolver::<f32>::new(&world).unwrap();
    for step in 0..12 {
        ask!(cpu, step);
        cpu.step().unwrap();
    }
    let options = GpuOptions { grid_blocks: Some(8), ..GpuOptions::default() };
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &options).unwrap();
    let mut encoder = host.encoder();
    for step in 0..6 {
        ask!(solver, step);
        solver.encode_step(&mut encoder).unwrap();
    }
    solver.encode_report(&mut encoder);
    host.submit(encoder);
    let (mut deferred, mut said) = (0, 5);
    for _ in 0..100 {
        if solver.step() == 12 {
            break;
        }
        // Each once. Step 6 is asked for before the host can know that the steps so far were not taken.
        if solver.step() > said {
            said = solver.step();
            ask!(solver, said);
        }
        let mut encoder = host.encoder();
        solver.encode_step(&mut encoder).unwrap();
        solver.encode_report(&mut encoder);
        host.submit(encoder);
        let report = solver.poll_report().unwrap().expect("it was waited for");
        deferred = report.faults.steps_deferred;
    }
    assert!(deferred >= 6, "{deferred}");
    let counts = |report: StepReport| (report.step, report.time, report.emitted, report.drained, report.withheld);
    assert_eq!(counts(*solver.report()), counts(cpu.report().unwrap()));
    assert_eq!(solver.poses(), cpu.poses());
    assert!(cpu.report().unwrap().drained > 0 && cpu.report().unwrap().emitted > 0);
    let position = host.read(solver.particle_buffers().position, host.encoder());
    assert_positions(backend, &position, &cpu.gpu_layout().position);
}
