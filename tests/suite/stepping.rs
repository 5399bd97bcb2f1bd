//! Steps of different lengths: what stays unchanged, and how many make up a frame.

use crate::backends::{Backend, CPUS, DEVICES, MOST, NATIVE, Tests};
use crate::guest::Host;
use crate::worlds::{DX, after, assert_sound, ball, block, empty, flowing, larger, particles, report, state};
use pbmpm::{
    Action, Advanced, DVec3, Emitter, GpuOptions, GpuSolver, Motion, Quality, Rate, Scheme, Settings, Simulate, Spawn,
    Tool, Wall, World, state_hash,
};
use std::collections::VecDeque;

pub fn add(tests: &mut Tests) {
    tests.once("stepping", "substeps_follow_the_speed", substeps_follow_the_speed);
    tests.each("stepping", CPUS, "a_pool_at_rest_bears_steps_of_any_length", a_pool_at_rest_bears_steps_of_any_length);
    tests.each("stepping", MOST, "reports_know_the_fastest_particle", reports_know_the_fastest_particle);
    tests.each("stepping", MOST, "steps_get_shorter_for_an_impact", steps_get_shorter_for_an_impact);
    tests.each("stepping", CPUS, "what_comes_into_being_is_expected", what_comes_into_being_is_expected);
    tests.each("stepping", MOST, "what_has_just_appeared_is_expected", what_has_just_appeared_is_expected);
    tests.each("stepping", NATIVE, "what_appears_in_flight_is_expected", what_appears_in_flight_is_expected);
    tests.each("stepping", MOST, "tools_do_not_lose_to_the_clamp", tools_do_not_lose_to_the_clamp);
    tests.each("stepping", DEVICES, "frames_are_divided_alike", frames_are_divided_alike);
    tests.each("stepping", CPUS, "frames_tell_what_was_spent", frames_tell_what_was_spent);
}

fn settings(dt: f64, courant: f64) -> Settings {
    Settings { dt, courant, ..Settings::default() }
}

fn substeps_follow_the_speed() {
    let steps = |settings: &Settings, frame, gravity, speed| settings.substeps(frame, 0.02, DVec3::Y * gravity, speed);
    let fixed = settings(1.0 / 1200.0, 0.0);
    // Rounding errors do not add a step to a frame.
    for n in 1..200 {
        assert_eq!(steps(&fixed, f64::from(n) / 1200.0, -9.81, 100.0), n);
    }
    assert_eq!(steps(&fixed, 1e-4, 0.0, 0.0), 1);
    for nothing in [0.0, -1.0, f64::NAN] {
        assert_eq!(steps(&fixed, nothing, 0.0, 1.0), 0);
    }
    let half = settings(0.02, 0.5);
    // 0.1 m are 5 cells, ten times half a cell; gravity's part counts; the limit is 16 times the steps of dt.
    assert_eq!(steps(&half, 0.02, 0.0, 4.99), 10);
    assert_eq!(steps(&half, 0.02, -50.0, 3.99), 10);
    assert_eq!(steps(&half, 0.02, 0.0, 1e9), 16);
    assert_eq!(steps(&half, 0.05, 0.0, f64::INFINITY), 48);
    // NaN counts as any speed.
    assert_eq!(steps(&half, 0.05, 0.0, f64::NAN), 48);
    // No step is shorter than 1e-5 s.
    assert_eq!(steps(&settings(1e-4, 0.5), 5e-5, 0.0, 1e9), 5);
}

/// A column, compressed by its weight, whose steps become short and long again: it is not thrown up, as would happen if
/// its pressures or its modulus were kept as in steps of the other length. It oscillates slightly, as it does without
/// changes.
fn a_pool_at_rest_bears_steps_of_any_length(backend: Backend) {
    for (scheme, dt) in [(Scheme::Implicit, 0.01), (Scheme::Explicit, 1.0 / 600.0)] {
        let mut world = empty([4.0, 16.0, 4.0], Wall::Slip);
        world.settings = Settings { scheme, iterations: 8, dt, ..world.settings };
        world.spawns.push(block([0.0; 3], [4.0, 12.0, 4.0], [0.0; 3]));
        let highest = |made: f64, shares: [f64; 4]| {
            let mut solver = backend
                .solver(&World { settings: Settings { dt: made * dt, ..world.settings.clone() }, ..world.clone() });
            solver.set_dt(dt).unwrap();
            solver.steps((1.0 / dt) as u32).unwrap();
            let speeds = shares.map(|share| {
                solver.set_dt(share * dt).unwrap();
                let speeds = (0..(20.0 / share) as u32).map(|_| {
                    solver.steps(1).unwrap();
                    let state = state(&mut *solver);
                    state.momentum[1].abs() / state.mass_kg
                });
                speeds.fold(0.0, larger)
            });
            speeds.into_iter().fold(0.0, larger)
        };
        // Also where the world was made with a shorter step than it then takes: liquids then stiffen in short steps,
        // and give way as the steps become long again.
        for (made, gives) in [(1.0, 0.002), (0.2, 0.02)] {
            let (steady, changed) = (highest(made, [1.0; 4]), highest(made, [0.5, 0.13, 1.0, 0.5]));
            assert!(changed < 1.1 * steady + gives, "{scheme:?}, {made}: {changed} m/s, {steady} without");
        }
    }
}

/// A drop over a pool, thrown down.
fn drop(speed: f64) -> World {
    let mut world = empty([8.0, 30.0, 8.0], Wall::Slip);
    world.spawns = vec![
        block([0.0, 0.0, 0.0], [8.0, 3.0, 8.0], [0.0; 3]),
        block([2.5, 22.0, 2.5], [5.5, 25.0, 5.5], [0.0, -speed, 0.0]),
    ];
    world.settings = Settings { courant: 0.5, dt: 0.01, ..Quality::Realtime.settings(&world) };
    world
}

fn reports_know_the_fastest_particle(backend: Backend) {
    let mut solver = backend.solver(&drop(2.0));
    assert!((report(&mut *solver).max_speed - 2.0).abs() < 1e-6);
    for steps in [1, 3, 9] {
        let all = after(&mut *solver, steps);
        let fastest = all.iter().map(|p| p.velocity.length()).fold(0.0, larger);
        let told = report(&mut *solver).max_speed;
        assert!((told / fastest - 1.0).abs() < 1e-6, "{told} for {fastest} m/s");
        solver.set_dt(0.004).unwrap();
    }
}

/// The steps of frames of 1/60 s.
fn frames(solver: &mut dyn Simulate, count: usize) -> Vec<Advanced> {
    (0..count).map(|_| solver.advance(1.0 / 60.0).unwrap_or_else(|e| panic!("{e}"))).collect()
}

fn steps_get_shorter_for_an_impact(backend: Backend) {
    let mut solver = backend.solver(&drop(1.0));
    let frames = frames(&mut *solver, 60);
    let steps: Vec<u32> = frames.iter().map(|f| f.steps).collect();
    let most = steps.iter().max().unwrap();
    // At 1 m/s a frame of 1/60 s needs 2 steps, at 2.9 m/s at the impact 6.
    assert!(steps[0] == 2 && *most >= 6, "{steps:?}");
    assert!(steps[40..].iter().max().unwrap() < most, "{steps:?}");
    assert!(steps.iter().all(|n| (2..=32).contains(n)), "{steps:?}");
    let total: u64 = steps.iter().map(|n| u64::from(*n)).sum();
    assert_eq!(frames[59].report.step, total);
    assert!((solver.time() - 1.0).abs() < 1e-9, "{} s", solver.time());
    assert_sound(&particles(&mut *solver));
    // No step moves matter much farther than requested: only by what an impact accelerates within a frame.
    let cells: Vec<f64> = frames.iter().map(|f| f.report.max_speed / 60.0 / f64::from(f.steps) / DX).collect();
    assert!(cells.iter().all(|c| *c < 1.0), "{cells:?}");
}

/// A jet that is about to begin, and a splash that is about to be added, already shorten the steps of the same frame.
fn what_comes_into_being_is_expected(backend: Backend) {
    let mut world = drop(0.0);
    world.spawns.pop();
    let shape = ball(1.0);
    let jet = Emitter::new("water", shape, DVec3::new(0.08, 0.3, 0.08), Rate::Litres(0.1));
    world.emitters.push(Emitter { velocity: DVec3::Y * -4.0, start: 0.05, end: Some(0.06), ..jet });
    world.settings.capacity = Some(10_000);
    let mut solver = backend.solver(&world);
    let steps: Vec<u32> =
        (0..4).map(|_| solver.plan_frame(1.0 / 60.0).and_then(|n| solver.steps(n).map(|()| n)).unwrap()).collect();
    assert_eq!(steps[..3], [2, 2, 2]);
    assert!(steps[3] >= 7, "{steps:?}");
    // Emitted particles have the emitter's motion.
    let motion = Motion::Steady { linear_velocity: DVec3::X * 10.0, angular_velocity: DVec3::ZERO };
    world.emitters[0] =
        Emitter { motion: Some(motion), start: 0.0, velocity: DVec3::ZERO, ..world.emitters[0].clone() };
    assert!(backend.solver(&world).plan_frame(1.0 / 60.0).unwrap() >= 16);
    let mut solver = backend.solver(&drop(0.0));
    assert_eq!(solver.plan_frame(1.0 / 60.0), Ok(2));
    // In seconds nothing gets faster than by a fall through the domain, 30 cells high.
    let falling = (2.0 * 9.81 * 30.0 * DX).sqrt();
    let steps = f64::from(backend.solver(&drop(0.0)).plan_frame(5.0).unwrap());
    let needed = falling * 5.0 / (0.5 * DX);
    assert!(steps >= needed && steps <= needed + 1.0, "{steps} steps for {needed}");
    let mut calm = drop(0.0);
    calm.settings.capacity = Some(10_000);
    let mut solver = backend.solver(&calm);
    solver.add(&block([2.0, 15.0, 2.0], [6.0, 19.0, 6.0], [0.0, -5.0, 0.0])).unwrap();
    assert!(solver.plan_frame(1.0 / 60.0).unwrap() >= 9);
}

/// A weightless box, empty but for a drop at rest.
fn calm() -> World {
    let mut world = empty([60.0, 12.0, 12.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.spawns.push(block([1.0, 1.0, 1.0], [3.0, 3.0, 3.0], [0.0; 3]));
    world.settings = Settings { dt: 1.0 / 60.0, courant: 0.5, capacity: Some(10_000), ..Settings::default() };
    world
}

/// A drop that moves 7.5 cells in 1/60 s: in steps of that length it would lose almost half of its speed.
const FAST: f64 = 7.5 * 60.0 * DX;

fn thrown() -> Spawn {
    block([6.0, 5.0, 5.0], [8.0, 7.0, 7.0], [FAST, 0.0, 0.0])
}

/// Matter that appears at the very end of a frame shortens the steps of the next one, also of one that resumes from a
/// snapshot between the two; and not those of the frame after that, if it is gone by then.
fn what_has_just_appeared_is_expected(backend: Backend) {
    let mut burst = calm();
    let jet = Emitter::new("water", ball(1.0), DVec3::splat(6.0 * DX), Rate::Particles(1e5));
    burst.emitters.push(Emitter { velocity: DVec3::X * FAST, end: Some(1e-3), ..jet });
    for (world, add) in [(calm(), true), (burst, false)] {
        let mut solver = backend.solver(&world);
        if add {
            solver.add(&thrown()).unwrap();
        }
        solver.set_dt(1e-3).unwrap();
        solver.step().unwrap();
        solver.set_dt(world.settings.dt).unwrap();
        let now = report(&mut *solver);
        assert!(now.emitted > 0 && now.max_speed == 0.0, "{now:?}");
        let snapshot = solver.save().unwrap();
        let steps = solver.advance(1.0 / 60.0).unwrap().steps;
        assert_eq!(steps, 15);
        let now = report(&mut *solver);
        assert!(now.faults.speed_clamped == 0 && (now.max_speed / FAST - 1.0).abs() < 0.01, "{now:?}");
        let mut resumed = backend.solver(&world);
        resumed.restore(&snapshot).unwrap();
        assert_eq!(resumed.plan_frame(1.0 / 60.0), Ok(steps));
    }
    let mut solver = backend.solver(&calm());
    solver.add(&thrown()).unwrap();
    solver.advance(1e-3).unwrap();
    solver.remove(&pbmpm::Region::new(pbmpm::Shape::HalfSpace, DVec3::splat(1.0))).unwrap();
    assert_eq!([(); 2].map(|()| solver.advance(1.0 / 60.0).unwrap().steps), [15, 1]);
}

/// Matter that a host throws in while frames are in flight keeps its speed: frames are planned for it until a report
/// knows it.
fn what_appears_in_flight_is_expected(backend: Backend) {
    let host = Host::new(backend, wgpu::Limits::default());
    let options = GpuOptions { steps_in_flight: 128, ..GpuOptions::default() };
    for in_flight in [1, 2] {
        let mut solver = GpuSolver::new(&host.device, &host.queue, &calm(), &options).unwrap();
        let (mut waiting, mut planned, mut last) = (VecDeque::new(), Vec::new(), None);
        for frame in 0..7 {
            if frame == 2 {
                solver.add(&thrown()).unwrap();
            }
            let steps = solver.plan_frame(1.0 / 60.0).unwrap();
            let mut encoder = host.encoder();
            for _ in 0..steps {
                assert!(solver.encode_step(&mut encoder).unwrap());
            }
            solver.encode_report(&mut encoder);
            waiting.push_back(encoder);
            planned.push(steps);
            // A device that is behind.
            if waiting.len() > in_flight {
                waiting.pop_front().into_iter().for_each(|encoder| host.submit(encoder));
            }
            last = solver.poll_report().unwrap().or(last);
        }
        assert_eq!(planned[..2], [1, 1], "{in_flight} in flight: {planned:?}");
        assert!(planned[2..].iter().all(|steps| (14..=16).contains(steps)), "{in_flight} in flight: {planned:?}");
        let last = last.expect("a report");
        assert_eq!(last.faults.speed_clamped, 0, "{in_flight} in flight");
        assert!((last.max_speed / FAST - 1.0).abs() < 0.01, "{in_flight} in flight: {} m/s", last.max_speed);
    }
}

/// Matter gets as fast as tools make it within a frame.
fn tools_do_not_lose_to_the_clamp(backend: Backend) {
    let (position, radius) = (DVec3::splat(2.0 * DX), 1000.0 * DX);
    let push = Action::Push { acceleration: DVec3::X * FAST * 60.0 };
    for (action, velocity) in [(Action::Grab { time: 0.0 }, DVec3::X * FAST), (push, DVec3::ZERO)] {
        let mut solver = backend.solver(&calm());
        solver.set_tools(&[Tool { action, radius, position, velocity }]).unwrap();
        let frame = solver.advance(1.0 / 60.0).unwrap();
        assert_eq!(frame.steps, 15, "{action:?}");
        // A force acts from the middle of the step before.
        let reached = frame.report.max_speed / FAST;
        assert!((reached - 1.0).abs() < 0.05 && frame.report.faults.speed_clamped == 0, "{action:?}: {reached}");
    }
}

/// The same steps and, on devices that round alike, the same bits, with pressures that persist over steps of different
/// lengths.
fn frames_are_divided_alike(backend: Backend) {
    let mut world = flowing();
    world.settings.courant = 0.25;
    let (mut cpu, mut gpu) = (Backend::Cpu.solver(&world), backend.solver(&world));
    let (here, there) = (frames(&mut *cpu, 8), frames(&mut *gpu, 8));
    let steps = |f: &[Advanced]| f.iter().map(|f| f.steps).collect::<Vec<_>>();
    assert_eq!(steps(&here)[0], steps(&there)[0]);
    assert!(steps(&here).iter().max() > steps(&here).iter().min(), "{:?}", steps(&here));
    if backend == Backend::Gpu {
        assert!(steps(&here).iter().zip(steps(&there)).all(|(a, b)| a.abs_diff(b) <= 1));
        return;
    }
    assert_eq!(steps(&here), steps(&there));
    for (a, b) in here.iter().zip(&there) {
        assert_eq!((a.iterations, a.capped), (b.iterations, b.capped));
        assert_eq!(
            (a.report.max_speed, a.report.solved, a.report.spent),
            (b.report.max_speed, b.report.solved, b.report.spent)
        );
    }
    assert_eq!(state_hash(&particles(&mut *cpu)), state_hash(&particles(&mut *gpu)));
    // And again, step by step.
    let mut again = backend.solver(&world);
    for advanced in &there {
        assert_eq!(again.plan_frame(1.0 / 60.0), Ok(advanced.steps));
        again.steps(advanced.steps).unwrap();
        report(&mut *again);
    }
    assert_eq!(state_hash(&particles(&mut *again)), state_hash(&particles(&mut *gpu)));
}

fn frames_tell_what_was_spent(backend: Backend) {
    let mut world = drop(1.0);
    let mut solver = backend.solver(&world);
    let all = frames(&mut *solver, 20);
    let spent = report(&mut *solver).spent;
    assert_eq!(all.iter().map(|f| f.iterations).sum::<u64>(), spent.iterations);
    assert_eq!(all.iter().map(|f| f.capped).sum::<u64>(), spent.capped);
    let last = all[19].report.solved.expect("a solve");
    assert!(spent.worst_change >= last.change && last.change > 0.0, "{spent:?} {last:?}");
    // With zero tolerance every solve takes all iterations, unless rounding ends it.
    world.settings.tolerance = 0.0;
    world.settings.iterations = 3;
    let mut solver = backend.solver(&world);
    let advanced = solver.advance(0.01).unwrap();
    assert_eq!((advanced.iterations, advanced.capped), (3 * u64::from(advanced.steps), u64::from(advanced.steps)));
    world.settings.scheme = Scheme::Published;
    let mut solver = backend.solver(&world);
    let advanced = solver.advance(0.02).unwrap();
    assert_eq!((advanced.iterations, advanced.capped), (3 * u64::from(advanced.steps), 0));
    assert_eq!(advanced.report.solved, None);
}
