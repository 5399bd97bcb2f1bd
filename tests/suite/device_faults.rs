//! Faults of a device are errors: there is no panic, and no endless wait.

use crate::alike::{assert_states, rounds_by_itself};
use crate::backends::{Backend, NATIVE, SOFTWARE, Tests};
use crate::guest::Host;
use crate::worlds::{busy, particles};
use pbmpm::{AdapterChoice, CpuSolver, Error, GpuOptions, GpuSolver, Headless, Simulate};
use std::time::{Duration, Instant};

pub fn add(tests: &mut Tests) {
    tests.each("device_faults", NATIVE, "a_device_that_is_lost", a_device_that_is_lost);
    tests.each("device_faults", NATIVE, "a_guests_device_that_is_lost", a_guests_device_that_is_lost);
    tests.each("device_faults", NATIVE, "another_devices_encoder", another_devices_encoder);
    tests.each("device_faults", NATIVE, "an_encoder_made_invalid", an_encoder_made_invalid);
    tests.each("device_faults", NATIVE, "a_mistake_on_the_device", a_mistake_on_the_device);
    tests.each("device_faults", SOFTWARE, "more_than_the_adapter_has", more_than_the_adapter_has);
    tests.once("device_faults", "no_such_adapter", no_such_adapter);
}

fn is_device(result: Result<impl std::fmt::Debug, Error>) {
    assert!(matches!(result, Err(Error::Device(_))), "{result:?}");
}

/// Every call that needs the device returns the error, immediately and again; an earlier snapshot can be resumed
/// elsewhere.
fn a_device_that_is_lost(backend: Backend) {
    let world = busy();
    let mut solver = Headless::new(&world, &backend.choice(), &GpuOptions::default()).unwrap();
    solver.steps(4).unwrap();
    let snapshot = solver.save().unwrap();
    let begin = Instant::now();
    solver.device().destroy();
    for _ in 0..2 {
        is_device(solver.step());
        is_device(solver.steps(40));
        is_device(solver.particles());
        is_device(solver.report());
        is_device(solver.loads());
        is_device(solver.sensors());
        is_device(solver.advance(0.1));
        is_device(solver.save());
    }
    assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
    let mut elsewhere = CpuSolver::<f32>::new(&world).unwrap();
    elsewhere.restore(&snapshot).unwrap();
    elsewhere.steps(4).unwrap();
    let mut whole = CpuSolver::<f32>::new(&world).unwrap();
    whole.steps(8).unwrap();
    let (a, b) = (particles(&mut elsewhere), particles(&mut whole));
    if rounds_by_itself(backend) {
        // The device has taken half of its steps.
        assert_states(backend, &a, &b, "gone on elsewhere");
    } else {
        assert!(a == b);
    }
}

/// A guest notices it by missing reports, at the latest when its ring is full.
fn a_guests_device_that_is_lost(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let mut solver = GpuSolver::new(&host.device, &host.queue, &busy(), &GpuOptions::default()).unwrap();
    let mut encoder = host.encoder();
    solver.encode_step(&mut encoder).unwrap();
    solver.encode_report(&mut encoder);
    solver.encode_snapshot(&mut encoder).unwrap();
    host.device.destroy();
    host.queue.submit([encoder.finish()]);
    let _ = host.device.poll(wgpu::PollType::Poll);
    is_device(solver.poll_snapshot());
    let mut found = None;
    for _ in 0..40 {
        let mut encoder = host.encoder();
        if let Err(error) = solver.encode_step(&mut encoder) {
            found = Some(error);
            break;
        }
        host.queue.submit([encoder.finish()]);
        let _ = host.device.poll(wgpu::PollType::Poll);
    }
    assert!(matches!(found, Some(Error::Device(_) | Error::StepsInFlight { .. })), "{found:?}");
}

/// Recording into an encoder of another device is an error of that device, which its host receives; the solver takes no
/// step, and reports that.
fn another_devices_encoder(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let other = host.sibling(backend);
    let mut solver = GpuSolver::new(&host.device, &host.queue, &busy(), &GpuOptions::default()).unwrap();
    let scope = other.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let mut encoder = other.encoder();
    solver.encode_step(&mut encoder).unwrap();
    drop(encoder.finish());
    let error = pollster::block_on(scope.pop());
    assert!(matches!(error, Some(wgpu::Error::Validation { .. })), "{error:?}");
    let mut encoder = host.encoder();
    solver.encode_report(&mut encoder);
    host.submit(encoder);
    assert_eq!(solver.poll_report(), Err(Error::StepsLost { lost: 1 }));
    assert_eq!(solver.poll_report().unwrap().map(|r| r.step), Some(0));
}

/// What a host's mistake in the same encoder has made invalid is no snapshot of nothing, nor a report.
fn an_encoder_made_invalid(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let mut solver = GpuSolver::new(&host.device, &host.queue, &busy(), &GpuOptions::default()).unwrap();
    // The second time, the report's buffer holds that of the first.
    for taken in 0..2 {
        let mut encoder = host.encoder();
        for _ in 0..taken {
            solver.encode_step(&mut encoder).unwrap();
        }
        host.submit(encoder);
        let scope = host.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let mut encoder = host.encoder();
        assert!(solver.encode_report(&mut encoder));
        solver.encode_snapshot(&mut encoder).unwrap();
        let position = solver.particle_buffers().position;
        encoder.copy_buffer_to_buffer(position, 0, position, 0, position.size());
        host.queue.submit([encoder.finish()]);
        let _ = host.device.poll(wgpu::PollType::Poll);
        let error = pollster::block_on(scope.pop());
        assert!(matches!(error, Some(wgpu::Error::Validation { .. })), "{error:?}");
        assert!(matches!(solver.poll_snapshot(), Err(Error::Snapshot { .. })), "a snapshot of nothing");
        assert_eq!(solver.poll_report(), Ok(None));
        let mut encoder = host.encoder();
        assert!(solver.encode_report(&mut encoder));
        solver.encode_snapshot(&mut encoder).unwrap();
        host.submit(encoder);
        assert_eq!(solver.poll_report().unwrap().map(|r| (r.alive, r.step)), Some((1640, taken)));
        assert!(solver.poll_snapshot().unwrap().is_some());
    }
}

/// A renderer's mistake on the solver's own device is reported by the next step instead of ending the program, and has
/// no further effect.
fn a_mistake_on_the_device(backend: Backend) {
    let mut solver = Headless::new(&busy(), &backend.choice(), &GpuOptions::default()).unwrap();
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::STORAGE;
    let mistake = wgpu::BufferDescriptor { label: Some("mistaken"), size: 16, usage, mapped_at_creation: false };
    drop(solver.device().create_buffer(&mistake));
    match solver.step() {
        Err(Error::Device(words)) => assert!(words.contains("mistaken"), "{words}"),
        other => panic!("{other:?}"),
    }
    solver.step().unwrap();
}

/// A grid of 2²⁴ blocks, 16 GiB.
fn more_than_the_adapter_has(backend: Backend) {
    let options = GpuOptions { grid_blocks: Some(1 << 24), ..GpuOptions::default() };
    let error = Headless::new(&busy(), &backend.choice(), &options).expect_err("no adapter here has that");
    assert!(matches!(error, Error::NoAdapter(_) | Error::Unsupported { .. } | Error::Device(_)), "{error:?}");
    let host = Host::new(backend, wgpu::Limits::default());
    let error = GpuSolver::new(&host.device, &host.queue, &busy(), &options).expect_err("nor this device");
    assert!(matches!(error, Error::Unsupported { .. }), "{error:?}");
}

fn no_such_adapter() {
    let choice = AdapterChoice { name: "no adapter has this name".to_owned() };
    let error = Headless::new(&busy(), &choice, &GpuOptions::default()).expect_err("there is none");
    assert!(matches!(&error, Error::NoAdapter(words) if words.contains("no adapter has this name")), "{error}");
}
