//! The solver as a guest: the test owns instance, device, encoder, submission and waiting, as a renderer does.

use crate::backends::{Backend, NATIVE, Tests};
use crate::worlds::{after, block, busy, empty, larger};
use pbmpm::{CpuSolver, DVec3, Error, GpuOptions, GpuSolver, Simulate, SnapshotFault, Wall, World};
use std::time::Duration;

pub fn add(tests: &mut Tests) {
    tests.each("guest", NATIVE, "two_steps_in_a_foreign_submission", two_steps_in_a_foreign_submission);
    tests.each("guest", NATIVE, "a_full_ring_is_an_error_and_drains", a_full_ring_is_an_error_and_drains);
    tests.each("guest", NATIVE, "frames_fit_the_ring", frames_fit_the_ring);
    tests.each("guest", NATIVE, "steady_state_creates_nothing", steady_state_creates_nothing);
    tests.each("guest", NATIVE, "reports_arrive_by_polling", reports_arrive_by_polling);
    tests.each("guest", NATIVE, "an_encoder_that_is_dropped_is_told", an_encoder_that_is_dropped_is_told);
    let told = steps_dropped_before_a_full_grid_are_told;
    tests.each("guest", NATIVE, "steps_dropped_before_a_full_grid_are_told", told);
    tests.each(
        "guest",
        NATIVE,
        "frames_whose_encoders_were_dropped_are_told",
        frames_whose_encoders_were_dropped_are_told,
    );
    tests.each("guest", NATIVE, "two_solvers_share_a_device", two_solvers_share_a_device);
    tests.each("guest", NATIVE, "validation_finds_no_fault", validation_finds_no_fault);
}

/// A host's device, opened without any request on the solver's behalf.
pub struct Host {
    pub instance: wgpu::Instance,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

impl Host {
    pub fn new(backend: Backend, limits: wgpu::Limits) -> Host {
        Host::of(wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle()), backend, limits)
    }

    /// Another device of the same instance.
    pub fn sibling(&self, backend: Backend) -> Host {
        Host::of(self.instance.clone(), backend, wgpu::Limits::default())
    }

    fn of(instance: wgpu::Instance, backend: Backend, limits: wgpu::Limits) -> Host {
        let wanted = backend.adapter().get_info();
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
        let same = |info: wgpu::AdapterInfo| (info.name, info.backend) == (wanted.name.clone(), wanted.backend);
        let adapter = adapters.into_iter().find(|a| same(a.get_info())).expect("it was there a moment ago");
        let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
        Host { instance, device, queue }
    }

    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    pub fn submit(&self, encoder: wgpu::CommandEncoder) {
        let index = self.queue.submit([encoder.finish()]);
        let wait = wgpu::PollType::Wait { submission_index: Some(index), timeout: Some(Duration::from_secs(60)) };
        self.device.poll(wait).expect("the device answers");
    }

    /// The contents of a buffer of four floats per item.
    pub fn read(&self, buffer: &wgpu::Buffer, mut encoder: wgpu::CommandEncoder) -> Vec<[f32; 4]> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test readback"),
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
        encoder.map_buffer_on_submit(&staging, wgpu::MapMode::Read, .., |result| result.expect("mapped"));
        self.submit(encoder);
        bytemuck::pod_collect_to_vec(&staging.get_mapped_range(..).expect("mapped"))
    }
}

/// A block of liquid on its way through a small domain.
pub fn small() -> World {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns.push(block([4.0, 4.0, 4.0], [7.0, 7.0, 7.0], [0.4, -0.3, 0.2]));
    world
}

/// On WebGPU's default limits, two steps recorded between a host's own commands; the host then reads the particles,
/// and the solver reads nothing.
fn two_steps_in_a_foreign_submission(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let world = busy();
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &GpuOptions::default()).unwrap();
    let particles = solver.particle_buffers();
    for buffer in [particles.position, particles.displacement, particles.gradient] {
        let usage = buffer.usage();
        assert!(usage.contains(wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::STORAGE), "a host draws from it");
    }
    let mut encoder = host.encoder();
    solver.encode_step(&mut encoder).unwrap();
    solver.encode_step(&mut encoder).unwrap();
    assert_eq!((solver.step(), solver.poll_report()), (2, Ok(None)));
    let position = host.read(solver.particle_buffers().position, encoder);
    assert_eq!(solver.poll_report(), Ok(None), "no report was asked for");

    let mut cpu = CpuSolver::<f32>::new(&world).unwrap();
    cpu.steps(2).unwrap();
    let pbmpm::ParticleArrays { position: expected, displacement, gradient, .. } = cpu.gpu_layout();
    assert_eq!(position.len(), expected.len());
    // In free flight, in cells: the same formulas in f32.
    let largest = |a: &[[f32; 4]], b: &[[f32; 4]]| {
        let lanes = a.as_flattened().iter().zip(b.as_flattened());
        lanes.map(|(a, b)| (a - b).abs()).fold(0.0, larger)
    };
    assert!(largest(&position, &expected) < 1e-5);
    let found = host.read(solver.particle_buffers().displacement, host.encoder());
    assert!(largest(&found, &displacement) < 1e-5);
    let found = host.read(solver.particle_buffers().gradient, host.encoder());
    assert!(largest(&found, gradient.as_flattened()) < 1e-5);
    assert_eq!((solver.time(), solver.poses()), (cpu.time(), cpu.poses()));
}

/// Steps recorded without submission fill the ring, which is an error; after the device has caught up stepping
/// continues.
fn a_full_ring_is_an_error_and_drains(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let world = small();
    let options = GpuOptions { steps_in_flight: 4, ..GpuOptions::default() };
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &options).unwrap();
    let mut encoder = host.encoder();
    for _ in 0..4 {
        solver.encode_step(&mut encoder).unwrap();
    }
    assert_eq!(solver.encode_step(&mut encoder), Err(Error::StepsInFlight { max: 4 }));
    assert_eq!(solver.encode_step(&mut encoder), Err(Error::StepsInFlight { max: 4 }));
    assert_eq!(solver.step(), 4, "a refused step is not counted");
    host.submit(encoder);
    for _ in 0..3 {
        let mut encoder = host.encoder();
        solver.encode_step(&mut encoder).unwrap();
        solver.encode_step(&mut encoder).unwrap();
        host.submit(encoder);
    }
    let mut cpu = CpuSolver::<f32>::new(&world).unwrap();
    cpu.steps(10).unwrap();
    let position = host.read(solver.particle_buffers().position, host.encoder());
    let expected = cpu.gpu_layout().position;
    let lanes = position.as_flattened().iter().zip(expected.as_flattened());
    assert!(lanes.map(|(a, b)| (a - b).abs()).fold(0.0, larger) < 1e-4, "no step was lost or doubled");
}

/// A host that records the steps that a frame is divided into never meets a full ring, however many frames the device
/// is behind and however fast the matter is.
fn frames_fit_the_ring(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let mut world = small();
    world.settings.courant = 0.25;
    world.spawns[0].velocity = DVec3::Y * -6.0;
    let options = GpuOptions { steps_in_flight: 16, ..GpuOptions::default() };
    let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &options).unwrap();
    let mut waiting = Vec::new();
    let mut planned = Vec::new();
    for _ in 0..3 {
        let steps = solver.plan_frame(1.0 / 60.0).unwrap();
        let mut encoder = host.encoder();
        for _ in 0..steps {
            assert!(solver.encode_step(&mut encoder).unwrap());
        }
        solver.encode_report(&mut encoder);
        waiting.push(encoder);
        planned.push(steps);
    }
    assert_eq!(planned.iter().sum::<u32>(), 16, "{planned:?}");
    assert_eq!(planned[2], 0, "{planned:?}");
    waiting.into_iter().for_each(|encoder| host.submit(encoder));
    assert!(solver.plan_frame(1.0 / 60.0).unwrap() > 0);
    assert_eq!(solver.step(), 16);
}

/// A host that asks for no reports and drops its encoders, as one whose window is hidden may, does not wait for ever
/// for room in the ring.
fn frames_whose_encoders_were_dropped_are_told(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let mut solver = GpuSolver::new(&host.device, &host.queue, &small(), &GpuOptions::default()).unwrap();
    let mut errors = Vec::new();
    for frame in 0..80 {
        let mut encoder = host.encoder();
        let steps = solver.plan_frame(1.0 / 60.0).unwrap();
        errors.extend((0..steps).find_map(|_| solver.encode_step(&mut encoder).err()));
        if frame >= 70 {
            host.submit(encoder);
            errors.extend(solver.poll_report().err());
        }
        if errors.last() == Some(&Error::StepsLost { lost: 64 }) {
            return;
        }
    }
    panic!("{errors:?}");
}

/// 50 steps on a warm solver leave no more objects of any kind on the device than before; while a step is being
/// recorded there is only one more, the host's own encoder.
fn steady_state_creates_nothing(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let mut solver = GpuSolver::new(&host.device, &host.queue, &busy(), &GpuOptions::default()).unwrap();
    let counts = || {
        let report = host.instance.generate_report().expect("wgpu-core");
        let hub = report.hub_report();
        [
            ("buffers", hub.buffers.num_allocated),
            ("bind groups", hub.bind_groups.num_allocated),
            ("bind group layouts", hub.bind_group_layouts.num_allocated),
            ("pipeline layouts", hub.pipeline_layouts.num_allocated),
            ("compute pipelines", hub.compute_pipelines.num_allocated),
            ("shader modules", hub.shader_modules.num_allocated),
            ("query sets", hub.query_sets.num_allocated),
            ("textures", hub.textures.num_allocated),
        ]
    };
    let mut step = |report: bool| {
        let mut encoder = host.encoder();
        solver.encode_step(&mut encoder).unwrap();
        if report {
            solver.encode_report(&mut encoder);
        }
        let during = counts();
        host.submit(encoder);
        solver.poll_report().unwrap();
        during
    };
    (0..10).for_each(|i| {
        step(i % 2 == 0);
    });
    let before = counts();
    assert!(before[0].1 > 10 && before[4].1 > 10, "the counts mean something: {before:?}");
    for i in 0..50 {
        assert_eq!(step(i % 3 == 0), before, "while step {i} was recorded");
    }
    assert_eq!(counts(), before);
}

/// A host that only submits and polls receives reports, each of a later step than the previous one.
fn reports_arrive_by_polling(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let options = GpuOptions { steps_in_flight: 8, ..GpuOptions::default() };
    let mut solver = GpuSolver::new(&host.device, &host.queue, &small(), &options).unwrap();
    let mut seen = Vec::new();
    for _ in 0..12 {
        let mut encoder = host.encoder();
        solver.encode_step(&mut encoder).unwrap();
        host.submit(encoder);
        seen.extend(solver.poll_report().unwrap());
    }
    // Without requests: one every quarter of the ring.
    assert_eq!(seen.iter().map(|r| r.step).collect::<Vec<_>>(), [2, 4, 6, 8, 10, 12]);
    for report in &seen {
        assert!((report.time - report.step as f64 / 120.0).abs() < 1e-12, "{report:?}");
        assert_eq!(report.alive, 27 * 8);
        assert!(report.occupied_blocks > 0 && report.active_blocks >= report.occupied_blocks, "{report:?}");
    }
    let mut encoder = host.encoder();
    solver.encode_step(&mut encoder).unwrap();
    assert!(solver.encode_report(&mut encoder));
    host.submit(encoder);
    assert_eq!(solver.poll_report().unwrap().map(|r| r.step), Some(13));
}

/// Steps that were dropped before the grid had no room are told as well.
fn steps_dropped_before_a_full_grid_are_told(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let options = GpuOptions { grid_blocks: Some(8), ..GpuOptions::default() };
    let mut solver = GpuSolver::new(&host.device, &host.queue, &busy(), &options).unwrap();
    let mut dropped = host.encoder();
    (0..3).for_each(|_| assert!(solver.encode_step(&mut dropped).unwrap()));
    drop(dropped);
    let mut encoder = host.encoder();
    (0..2).for_each(|_| assert!(solver.encode_step(&mut encoder).unwrap()));
    assert!(solver.encode_report(&mut encoder));
    host.submit(encoder);
    assert_eq!(solver.poll_report(), Err(Error::StepsLost { lost: 3 }));
    // On the grid that is still too small the run resumes, and it grows.
    let mut cpu = CpuSolver::<f32>::new(&busy()).unwrap();
    cpu.steps(2).unwrap();
    solver.restore(&cpu.save().unwrap()).unwrap();
    for _ in 0..12 {
        let mut encoder = host.encoder();
        solver.encode_step(&mut encoder).unwrap();
        solver.encode_report(&mut encoder);
        host.submit(encoder);
    }
    let report = solver.poll_report().unwrap().expect("it was waited for");
    assert!(report.step > 2 && report.faults.steps_deferred > 0, "{report:?}");
}

/// Steps that never reach the device are lost, and this is detected; restoring a snapshot starts anew.
fn an_encoder_that_is_dropped_is_told(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let mut solver = GpuSolver::new(&host.device, &host.queue, &small(), &GpuOptions::default()).unwrap();
    let step = |solver: &mut GpuSolver| {
        let mut encoder = host.encoder();
        solver.encode_step(&mut encoder).unwrap();
        assert!(solver.encode_report(&mut encoder));
        host.submit(encoder);
        solver.poll_report().map(|report| report.map(|r| r.step))
    };
    assert_eq!(step(&mut solver), Ok(Some(1)));
    let mut dropped = host.encoder();
    solver.encode_step(&mut dropped).unwrap();
    solver.encode_step(&mut dropped).unwrap();
    drop(dropped);
    assert_eq!(step(&mut solver), Err(Error::StepsLost { lost: 2 }));
    // A state whose clock and matter are apart is none to keep.
    assert_eq!(solver.encode_snapshot(&mut host.encoder()), Err(Error::StepsLost { lost: 2 }));
    let mut cpu = CpuSolver::<f32>::new(&small()).unwrap();
    cpu.steps(3).unwrap();
    let snapshot = cpu.save().unwrap();
    solver.restore(&snapshot).unwrap();
    assert_eq!(step(&mut solver), Ok(Some(4)));

    // A host that asks for nothing but snapshots learns of it as well.
    solver.encode_step(&mut host.encoder()).unwrap();
    for _ in 0..2 {
        let mut encoder = host.encoder();
        solver.encode_snapshot(&mut encoder).unwrap();
        host.submit(encoder);
        assert_eq!(solver.poll_snapshot(), Err(Error::StepsLost { lost: 1 }));
    }
    solver.restore(&snapshot).unwrap();
    assert_eq!(step(&mut solver), Ok(Some(4)));

    // Reports and snapshots are dropped with their encoders; new ones can be recorded.
    for _ in 0..20 {
        let mut dropped = host.encoder();
        assert!(solver.encode_report(&mut dropped));
        solver.encode_snapshot(&mut dropped).unwrap();
        drop(dropped.finish());
        let fault = SnapshotFault::Dropped;
        assert_eq!(solver.poll_snapshot(), Err(Error::Snapshot { path: "in memory".to_owned(), fault }));
        assert_eq!(solver.poll_snapshot(), Ok(None));
    }
    assert_eq!(step(&mut solver), Ok(Some(5)), "nothing was lost");
    let mut encoder = host.encoder();
    solver.encode_snapshot(&mut encoder).unwrap();
    host.submit(encoder);
    assert_eq!(solver.poll_snapshot().unwrap().map(|s| s.step()), Some(5));

    // All that a ring holds, together with their reports.
    let error = (0..100).find_map(|_| solver.encode_step(&mut host.encoder()).err());
    assert_eq!(error, Some(Error::StepsInFlight { max: 64 }));
    let mut encoder = host.encoder();
    assert_eq!(solver.encode_step(&mut encoder), Err(Error::StepsInFlight { max: 64 }));
    host.submit(encoder);
    assert_eq!(solver.poll_report(), Err(Error::StepsLost { lost: 64 }));

    // Out of order, between two reports.
    solver.restore(&snapshot).unwrap();
    let [mut first, mut second] = [host.encoder(), host.encoder()];
    solver.encode_step(&mut first).unwrap();
    assert!(solver.encode_report(&mut first));
    solver.encode_step(&mut second).unwrap();
    host.submit(second);
    host.submit(first);
    assert_eq!(solver.poll_report(), Err(Error::StepsLost { lost: 1 }));
    assert_eq!(step(&mut solver), Err(Error::StepsLost { lost: 1 }));
}

/// Two worlds on one device, recorded alternately into the same submissions, do not affect each other.
fn two_solvers_share_a_device(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let worlds = [small(), busy()];
    let mut solvers: Vec<_> = worlds
        .iter()
        .map(|world| GpuSolver::new(&host.device, &host.queue, world, &GpuOptions::default()).unwrap())
        .collect();
    for _ in 0..4 {
        let mut encoder = host.encoder();
        for solver in &mut solvers {
            solver.encode_step(&mut encoder).unwrap();
            solver.encode_step(&mut encoder).unwrap();
        }
        host.submit(encoder);
    }
    for (world, solver) in worlds.iter().zip(&solvers) {
        let alone = after(&mut *backend.solver(world), 8);
        let units = solver.units();
        let together = host.read(solver.particle_buffers().position, host.encoder());
        for (p, x) in alone.iter().zip(&together) {
            let x = units.position_out(DVec3::new(x[0].into(), x[1].into(), x[2].into()));
            assert_eq!(p.position, x);
        }
    }
}

/// Nothing that the solver creates, records or destroys violates the rules of WebGPU, also when it grows.
fn validation_finds_no_fault(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let scopes = [wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Internal]
        .map(|filter| host.device.push_error_scope(filter));
    let options = GpuOptions { grid_blocks: Some(8), ..GpuOptions::default() };
    for world in [busy(), empty([4.0, 4.0, 4.0], Wall::Open)] {
        let mut solver = GpuSolver::new(&host.device, &host.queue, &world, &options).unwrap();
        let mut steps = 0;
        while steps < 5 {
            let mut encoder = host.encoder();
            solver.encode_step(&mut encoder).unwrap();
            solver.encode_report(&mut encoder);
            host.submit(encoder);
            steps = solver.poll_report().unwrap().map_or(steps, |r| r.step);
        }
        drop(solver);
    }
    for scope in scopes.into_iter().rev() {
        let error = pollster::block_on(scope.pop());
        assert!(error.is_none(), "{error:?}");
    }
}
