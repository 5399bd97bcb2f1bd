//! Matter at rest sleeps, costs nothing, and wakes when there is a reason.

use crate::alike::{assert_counts, assert_states};
use crate::backends::{Backend, CPUS, MOST, NATIVE, SINGLE, Tests};
use crate::worlds::{DX, after, ball, block, body, cuboid, dozing, empty, larger, one, particles, report, state};
use pbmpm::{
    Collider, CpuSolver, DVec3, Emitter, Material, Motion, Rate, Region, Scheme, Settings, Shape, Simulate, Sleep,
    Spawn, Tool, Wall, Walls, World, state_hash,
};

pub fn add(tests: &mut Tests) {
    tests.each("sleep", FAST, "nothing_changes_where_nothing_rests", nothing_changes_where_nothing_rests);
    tests.each("sleep", FAST, "what_rests_falls_asleep_and_stays", what_rests_falls_asleep_and_stays);
    tests.each("sleep", SINGLE, "devices_and_their_twin_agree", devices_and_their_twin_agree);
    tests.each("sleep", NATIVE, "a_grid_that_grows_changes_nothing", a_grid_that_grows_changes_nothing);
    tests.each("sleep", FAST, "each_disturbance_wakes", each_disturbance_wakes);
    tests.each("sleep", FAST, "a_disturbance_wakes_across_periodic_sides", a_disturbance_wakes_across_periodic_sides);
    tests.each("sleep", CPUS, "what_is_far_away_wakes_nobody", what_is_far_away_wakes_nobody);
    tests.each("sleep", FAST, "steps_of_another_length_are_no_motion", steps_of_another_length_are_no_motion);
    tests.each("sleep", FAST, "stresses_follow_steps_of_another_length", stresses_follow_steps_of_another_length);
    tests.each("sleep", CPUS, "an_impact_is_as_without_sleep", an_impact_is_as_without_sleep);
    tests.each("sleep", CPUS, "nothing_sleeps_in_flight", nothing_sleeps_in_flight);
    tests.each("sleep", MOST, "gone_on_with_is_never_stopped", gone_on_with_is_never_stopped);
    tests.once("sleep", "a_stirred_corner_stirs_as_without_sleep", a_stirred_corner_stirs_as_without_sleep);
}

/// Backends on which this does not take minutes.
const FAST: &[Backend] = &[Backend::Cpu, Backend::Cpu64, Backend::Lavapipe, Backend::Gpu];
const SCHEMES: [Scheme; 3] = [Scheme::Published, Scheme::Implicit, Scheme::Explicit];

/// A pool at rest, 16 by 5 by 8 cells, that sleeps after a tenth of a second.
fn pool(scheme: Scheme) -> World {
    let mut world = empty([16.0, 13.0, 8.0], Wall::Slip);
    world.settings = Settings { scheme, dt: 1.0 / 240.0, iterations: 6, ..Settings::default() };
    // In steps as long as these liquid of the explicit scheme is soft, and bounces.
    let speed = if scheme == Scheme::Explicit { 1.0 } else { 0.3 };
    world.settings.sleep = Some(Sleep { speed, time: 0.1 });
    world.spawns.push(block([0.0, 0.0, 0.0], [16.0, 5.0, 8.0], [0.0; 3]));
    world
}

fn asleep(solver: &mut dyn Simulate) -> u32 {
    report(solver).asleep
}

/// A pool that has just fallen asleep.
fn sleeping(backend: Backend, world: &World) -> Box<dyn Simulate> {
    let mut solver = backend.solver(world);
    solver.steps(28).unwrap();
    assert_eq!(asleep(&mut *solver), report(&mut *solver).alive, "all of it sleeps");
    solver
}

/// The same bits as without sleep, pass by pass, in scenes where everything keeps moving, or nothing rests for long
/// enough.
fn nothing_changes_where_nothing_rests(backend: Backend) {
    for (speed, time) in [(0.0, 0.0), (1.0, 1000.0)] {
        let mut world = dozing(Scheme::Published);
        world.settings.sleep = None;
        let without = after(&mut *backend.solver(&world), 30);
        world.settings.sleep = Some(Sleep { speed, time });
        let mut solver = backend.solver(&world);
        assert_states(backend, &without, &after(&mut *solver, 30), &format!("{speed} m/s, {time} s"));
        assert_eq!(asleep(&mut *solver), 0);
    }
}

/// Not a bit of sleeping matter changes as long as nothing happens.
fn what_rests_falls_asleep_and_stays(backend: Backend) {
    for scheme in SCHEMES {
        let world = pool(scheme);
        let mut solver = backend.solver(&world);
        solver.steps(23).unwrap();
        assert_eq!(asleep(&mut *solver), 0, "a tenth of a second has not gone by");
        solver.steps(10).unwrap();
        let before = report(&mut *solver);
        assert_eq!((before.asleep, before.max_speed), (before.alive, 0.0), "{scheme:?}");
        let hash = state_hash(&particles(&mut *solver));
        solver.steps(50).unwrap();
        let now = report(&mut *solver);
        assert_eq!(state_hash(&particles(&mut *solver)), hash, "{scheme:?}");
        assert_eq!(
            (now.asleep, now.occupied_blocks, now.active_blocks),
            (before.asleep, before.occupied_blocks, before.active_blocks)
        );
        assert_eq!(now.faults, before.faults);
    }
}

/// A trough that is stirred at one end and sleeps at the other: the same bits on every path.
fn devices_and_their_twin_agree(backend: Backend) {
    for scheme in SCHEMES {
        let world = dozing(scheme);
        let mut cpu = CpuSolver::<f32>::new(&world).unwrap();
        let mut solver = backend.solver(&world);
        let mut most = 0;
        for _ in 0..3 {
            solver.steps(20).unwrap();
            cpu.steps(20).unwrap();
            let (here, there) = (report(&mut cpu), report(&mut *solver));
            let counts = [&here, &there].map(|r| [r.asleep, r.occupied_blocks, r.active_blocks].map(u64::from));
            assert_counts(backend, counts, &format!("{scheme:?}"));
            assert!(here.asleep < here.alive, "{scheme:?}: the tool stirs");
            most = most.max(here.asleep);
        }
        assert!(most > 500, "{scheme:?}: {most} sleep");
        // GL adds in a different order.
        if backend != Backend::Gl {
            assert_states(backend, &particles(&mut cpu), &particles(&mut *solver), &format!("{scheme:?}"));
        }
    }
}

/// Steps that are not taken for lack of room do not count as rest.
fn a_grid_that_grows_changes_nothing(backend: Backend) {
    let mut world = dozing(Scheme::Published);
    world.spawns.push(block([1.0, 5.0, 1.0], [4.0, 8.0, 3.0], [5.0, 4.0, 0.0]));
    let run = |grid_blocks| {
        let options = pbmpm::GpuOptions { grid_blocks, ..pbmpm::GpuOptions::default() };
        let mut solver = backend.try_solver(&world, &options).unwrap();
        solver.steps(32).unwrap();
        let told = report(&mut *solver);
        (told.faults.steps_deferred > 0, told.asleep, state_hash(&particles(&mut *solver)))
    };
    let (grew, asleep, hash) = run(Some(40));
    assert!(grew && asleep > 0, "{asleep} sleep");
    assert_eq!(run(Some(2000)), (false, asleep, hash));
}

/// Any disturbance of a sleeping pool, by a host or by the world, wakes it there, and it moves.
fn each_disturbance_wakes(backend: Backend) {
    let above = DVec3::new(8.0, 8.0, 4.0) * DX;
    let mut moved = pool(Scheme::Implicit);
    moved.colliders.push(body(ball(2.0), [8.0, 8.0, 4.0]));
    let mut emitting = pool(Scheme::Implicit);
    let jet = Emitter::new("water", Shape::Sphere { radius: DX }, above, Rate::Particles(0.0));
    emitting.emitters.push(Emitter { velocity: DVec3::Y * -1.0, ..jet });
    emitting.settings.capacity = Some(40_000);
    let mut drained = pool(Scheme::Implicit);
    drained.settings.capacity = Some(40_000);
    type Act = (&'static str, World, fn(&mut dyn Simulate));
    let acts: [Act; 7] = [
        ("gravity", pool(Scheme::Implicit), |s| s.set_gravity(DVec3::new(5.0, -9.81, 0.0)).unwrap()),
        ("a body placed", moved.clone(), |s| {
            let pose = pbmpm::Pose { position: DVec3::new(8.0, 5.0, 4.0) * DX, rotation: pbmpm::DQuat::IDENTITY };
            s.set_collider(0, Some(pose), DVec3::ZERO, DVec3::ZERO).unwrap();
        }),
        ("a body that moves", moved, |s| s.set_collider(0, None, DVec3::Y * -2.0, DVec3::ZERO).unwrap()),
        ("a tool", pool(Scheme::Implicit), |s| {
            let action = pbmpm::Action::Push { acceleration: DVec3::Y * 100.0 };
            let position = DVec3::new(8.0, 4.0, 4.0) * DX;
            s.set_tools(&[Tool { action, radius: 3.0 * DX, position, velocity: DVec3::ZERO }]).unwrap();
        }),
        ("an emitter", emitting, |s| s.set_emission(0, Rate::Particles(5000.0)).unwrap()),
        ("particles added", drained.clone(), |s| {
            s.add(&block([7.0, 7.0, 3.0], [9.0, 9.0, 5.0], [0.0, -2.0, 0.0])).map(drop).unwrap();
        }),
        ("particles removed", drained, |s| {
            s.remove(&Region::new(cuboid([2.0, 5.0, 2.0]), DVec3::new(6.0, 0.0, 4.0) * DX)).unwrap();
        }),
    ];
    for (what, world, act) in acts {
        let mut solver = sleeping(backend, &world);
        let before = particles(&mut *solver);
        act(&mut *solver);
        solver.step().unwrap();
        let told = report(&mut *solver);
        assert!(told.asleep < told.alive, "{what} wakes nothing");
        solver.steps(12).unwrap();
        let after = particles(&mut *solver);
        let ways = after.iter().zip(&before).take(5120).map(|(now, before)| now.position.distance(before.position));
        let most = ways.fold(0.0, larger);
        assert!(most > 0.2 * DX, "{what} moves it by {most} m");
    }
}

/// Matter beside a periodic side wakes when that at the other side is removed.
fn a_disturbance_wakes_across_periodic_sides(backend: Backend) {
    let mut world = pool(Scheme::Implicit);
    world.domain.walls = Walls { y_min: Wall::Slip, y_max: Wall::Slip, ..Walls::all(Wall::Periodic) };
    world.domain.max = world.domain.min + DVec3::new(48.0, 12.0, 12.0) * DX;
    world.spawns = vec![Spawn::cuboid("water", DVec3::ZERO, DVec3::new(48.0, 4.0, 12.0) * DX)];
    let mut solver = sleeping(backend, &world);
    let before = particles(&mut *solver);
    solver.remove(&Region::new(cuboid([6.0, 12.0, 12.0]), DVec3::new(6.0, 0.0, 6.0) * DX)).unwrap();
    solver.steps(12).unwrap();
    let after = particles(&mut *solver);
    // Matter in the last cells before the other side.
    let beside = before.iter().zip(&after).filter(|(p, _)| p.position.x > 46.0 * DX);
    let most = beside.map(|(p, now)| now.position.distance(p.position).min(DX)).fold(0.0, larger);
    assert!(most > 0.2 * DX, "it moves by {most} m");
}

/// A body that turns, one that swings and a drain, far above the pool.
fn what_is_far_away_wakes_nobody(backend: Backend) {
    let mut world = pool(Scheme::Published);
    world.domain.max.y *= 4.0;
    let far = [8.0, 40.0, 4.0];
    world.colliders.push(Collider { angular_velocity: DVec3::Z, ..body(cuboid([3.0, 0.5, 0.5]), far) });
    let swing =
        Motion::Oscillate { amplitude: DVec3::X * DX, frequency: 3.0, phase: 0.0, angular_amplitude: DVec3::ZERO };
    world.colliders.push(Collider { motion: Some(swing), ..body(ball(2.0), far) });
    world.drains.push(Region::new(cuboid([2.0, 2.0, 2.0]), DVec3::from_array(far) * DX));
    let mut solver = sleeping(backend, &world);
    solver.set_dt(1.0 / 480.0).unwrap();
    solver.steps(10).unwrap();
    assert_eq!(asleep(&mut *solver), report(&mut *solver).alive, "steps of another length wake nobody either");
}

/// Matter that drifts at three fifths of the speed of rest goes on falling asleep when steps become half as long.
fn steps_of_another_length_are_no_motion(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.settings.sleep = Some(Sleep { speed: 0.1, time: 0.1 });
    world.spawns.push(block([4.0, 4.0, 4.0], [8.0, 8.0, 8.0], [0.06, 0.0, 0.0]));
    let mut solver = backend.solver(&world);
    // 0.083 s in ten steps of 1/120 s, then 0.025 s in steps of 1/240 s.
    solver.steps(10).unwrap();
    solver.set_dt(1.0 / 240.0).unwrap();
    solver.steps(6).unwrap();
    let told = report(&mut *solver);
    assert_eq!(told.asleep, told.alive);
}

/// Rubber that has fallen asleep under its weight wakes in steps a third as long with the stress that bears it: it moves
/// no more than if nothing had changed.
fn stresses_follow_steps_of_another_length(backend: Backend) {
    let woken = |dt: f64| {
        let mut world = empty([12.0, 12.0, 12.0], Wall::Stick);
        world.materials[0] = Material { youngs_modulus: 1e5, ..Material::elastic(&*world.materials[0].name) };
        world.settings = Settings {
            scheme: Scheme::Implicit,
            dt: 1.0 / 240.0,
            iterations: 20,
            tolerance: 1e-5,
            ..Settings::default()
        };
        world.settings.sleep = Some(Sleep { speed: 0.02, time: 0.1 });
        world.spawns.push(block([2.0, 0.0, 2.0], [10.0, 6.0, 10.0], [0.0; 3]));
        let mut solver = backend.solver(&world);
        solver.steps(480).unwrap();
        assert_eq!(asleep(&mut *solver), report(&mut *solver).alive, "all of it sleeps");
        solver.set_dt(dt).unwrap();
        // The length changes while everything sleeps; a gravity that differs in the seventh digit then wakes it.
        solver.steps(2).unwrap();
        solver.set_gravity(world.gravity * (1.0 + 1e-7)).unwrap();
        solver.steps(2).unwrap();
        assert_eq!(asleep(&mut *solver), 0);
        report(&mut *solver).max_speed
    };
    let [alike, shorter] = [1.0 / 240.0, 1.0 / 720.0].map(woken);
    assert!(shorter < 2.0 * alike + 1e-4, "{shorter} m/s, {alike} in steps of the same length");
}

/// A block that falls into a pool moves the same whether or not the pool sleeps when it arrives.
fn an_impact_is_as_without_sleep(backend: Backend) {
    let run = |sleep: Option<Sleep>| {
        let mut world = pool(Scheme::Implicit);
        world.domain.max.y *= 3.0;
        world.settings.sleep = sleep;
        world.settings.sleep.iter_mut().for_each(|sleep| sleep.speed = 0.1);
        world.spawns.push(block([5.0, 28.0, 2.0], [10.0, 33.0, 6.0], [0.0; 3]));
        let mut solver = backend.solver(&world);
        // 0.46 m of free fall take 0.3 s.
        solver.steps(60).unwrap();
        let slept = asleep(&mut *solver);
        let energy = [30, 60].map(|steps| {
            solver.steps(steps).unwrap();
            let s = state(&mut *solver);
            (s.kinetic_j + s.potential_j, s.centre_of_mass_m)
        });
        (slept, energy)
    };
    let (slept, with) = run(Some(Sleep { speed: 0.1, time: 0.1 }));
    let (_, without) = run(None);
    assert!(slept > 5000, "{slept} slept before the impact");
    for ((energy, centre), (energy_without, centre_without)) in with.into_iter().zip(without) {
        assert!((energy / energy_without - 1.0).abs() < 0.01, "{energy} J, {energy_without} J without sleep");
        let apart = DVec3::from_array(centre).distance(DVec3::from_array(centre_without));
        assert!(apart < 0.05 * DX, "{apart} m apart");
    }
}

/// A particle at the top of its flight does not stay there, nor does one that has just been placed.
fn nothing_sleeps_in_flight(backend: Backend) {
    let mut world = empty([8.0, 40.0, 8.0], Wall::Slip);
    world.settings.sleep = Some(Sleep { speed: 0.05, time: 0.02 });
    let mut thrown = one(DVec3::new(4.0, 10.0, 4.0) * DX);
    thrown.velocity.y = 2.0;
    world.spawns.push(thrown);
    world.spawns.push(one(DVec3::new(4.0, 35.0, 4.0) * DX));
    let mut solver = backend.solver(&world);
    solver.steps(72).unwrap();
    let all = particles(&mut *solver);
    let t: f64 = 0.6;
    // Either has reached the floor, or is where it should be: y = y₀ + v t − g t²/2.
    assert!((all[0].position.y - (0.2 + 2.0 * t - 0.5 * 9.81 * t * t).max(0.0)).abs() < 1.5 * DX, "{:?}", all[0]);
    assert!(all[1].position.y < 2.0 * DX, "{:?}", all[1]);
}

/// The time for which each particle has rested is part of a snapshot.
fn gone_on_with_is_never_stopped(backend: Backend) {
    let world = dozing(Scheme::Implicit);
    let mut whole = backend.solver(&world);
    whole.steps(12).unwrap();
    let mut stopped = backend.solver(&world);
    stopped.restore(&whole.save().unwrap()).unwrap();
    let bytes = whole.save().unwrap().to_bytes().unwrap();
    let read = pbmpm::Snapshot::from_bytes(&bytes, &world).unwrap();
    let mut from_file = backend.solver(&world);
    from_file.restore(&read).unwrap();
    for solver in [&mut stopped, &mut from_file] {
        assert_eq!(report(&mut **solver), report(&mut *whole));
    }
    for solver in [&mut whole, &mut stopped, &mut from_file] {
        solver.steps(20).unwrap();
        assert!(asleep(&mut **solver) > 0);
    }
    let told = |solver: &mut dyn Simulate| (report(solver), state_hash(&particles(solver)));
    assert_eq!(told(&mut *stopped), told(&mut *whole));
    assert_eq!(told(&mut *from_file), told(&mut *whole));
}

/// The accuracy lost by sleep: a pool stirred in one corner for two seconds, compared with the same pool kept awake.
fn a_stirred_corner_stirs_as_without_sleep() {
    let run = |sleep| {
        let mut world = empty([40.0, 8.0, 16.0], Wall::Slip);
        world.settings = Settings { scheme: Scheme::Implicit, dt: 1.0 / 240.0, iterations: 5, ..Settings::default() };
        world.settings.sleep = sleep;
        world.spawns.push(block([0.0, 0.0, 0.0], [40.0, 3.0, 16.0], [0.0; 3]));
        let stir = pbmpm::Action::Stir { angular_velocity: DVec3::Y * 10.0, time: 0.05 };
        let mut tool = pbmpm::ScriptedTool::new(stir, 3.0 * DX, DVec3::splat(3.0 * DX));
        tool.start = 0.5;
        world.tools.push(tool);
        let mut solver = CpuSolver::<f32>::new(&world).unwrap();
        let mut stirred = Vec::new();
        let mut slept = Vec::new();
        while solver.time() < 2.5 {
            solver.steps(24).unwrap();
            if solver.time() > 1.0 {
                let s = state(&mut solver);
                stirred.push([s.kinetic_j, s.centre_of_mass_m[1]]);
                slept.push(f64::from(asleep(&mut solver)) / 15_360.0);
            }
        }
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| stirred.iter().map(of).sum::<f64>() / stirred.len() as f64;
        (mean(&|s| s[0]), mean(&|s| s[1]), slept.iter().sum::<f64>() / slept.len() as f64)
    };
    let (energy_without, height_without, _) = run(None);
    // Measured: 12 and 23 % less energy, that of waves that have died at the edge of sleeping matter.
    for (speed, least, less) in [(0.01, 0.4, 0.14), (0.03, 0.5, 0.25)] {
        let (energy, height, slept) = run(Some(Sleep { speed, time: 0.25 }));
        assert!(slept > least, "{slept} sleep below {speed} m/s");
        let share = energy / energy_without;
        assert!(share < 1.0 && share > 1.0 - less, "{energy} J, {energy_without} J without sleep");
        assert!((height / height_without - 1.0).abs() < 1e-4, "{height} m, {height_without} m without sleep");
    }
}
