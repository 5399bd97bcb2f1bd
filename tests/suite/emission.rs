//! Particles that come and go while a world runs: emitters, drains, and what a host adds and removes.

use crate::alike::{assert_counts, assert_pass, rounds_by_itself};
use crate::backends::{ALL, Backend, DEVICES, MOST, NATIVE, Tests};
use crate::meshes::{mesh, slab};
use crate::worlds::{DX, after, apart, ball, block, body, busy, cuboid, depth, empty, mixed, particles, report};
use pbmpm::lockstep::compare_step;
use pbmpm::{
    Boundary, Collider, DQuat, DVec3, Emitter, Error, Fate, GpuOptions, Model, Motion, Particle, Pose, Rate, Region,
    Scheme, Shape, Spawn, Wall, World, state_hash,
};
use std::f64::consts::PI;

pub fn add(tests: &mut Tests) {
    tests.each("emission", NATIVE, "every_pass", every_pass);
    tests.each("emission", NATIVE, "the_same_particles_in_the_same_slots", the_same_particles_in_the_same_slots);
    tests.each("emission", MOST, "a_minute_of_coming_and_going", a_minute_of_coming_and_going);
    tests.each("emission", ALL, "a_full_world_refuses", a_full_world_refuses);
    tests.each("emission", MOST, "a_jet_flies_in_parabolas", a_jet_flies_in_parabolas);
    tests.each("emission", MOST, "a_full_place_withholds", a_full_place_withholds);
    tests.each("emission", MOST, "bodies_withhold", bodies_withhold);
    tests.each("emission", MOST, "drains_take_what_is_in_them", drains_take_what_is_in_them);
    tests.each("emission", ALL, "hosts_add_and_remove", hosts_add_and_remove);
    tests.each("emission", MOST, "bodies_set_later_withhold_what_was_added", bodies_set_later_withhold_what_was_added);
    tests.each("emission", DEVICES, "a_great_many_at_once", a_great_many_at_once);
    tests.each("emission", MOST, "steps_that_wait_lose_nothing", steps_that_wait_lose_nothing);
    tests.each("emission", MOST, "rates_change", rates_change);
    tests.once("emission", "bad_values_are_refused", bad_values_are_refused);
}

fn at(cells: [f64; 3]) -> DVec3 {
    DVec3::from_array(cells) * DX
}

fn alive(particles: &[Particle]) -> usize {
    particles.iter().filter(|p| p.fate == Fate::Alive).count()
}

/// A jet from a moving nozzle, a still one in a corner, and two drains that overlap, one of which moves.
fn coming_and_going(mut world: World) -> World {
    world.settings.capacity = Some(2600);
    let motion = Motion::Oscillate {
        amplitude: at([2.0, 0.0, 0.0]),
        frequency: 2.0,
        phase: 0.0,
        angular_amplitude: DVec3::new(0.0, 0.0, 0.5),
    };
    world.emitters = vec![
        Emitter {
            motion: Some(motion.clone()),
            velocity: DVec3::new(0.0, -1.0, 0.3),
            ..Emitter::new("oil", ball(0.8), at([6.0, 11.0, 6.0]), Rate::Particles(7000.0))
        },
        Emitter::new("water", cuboid([1.0, 1.0, 1.0]), at([12.0, 1.5, 2.0]), Rate::Litres(3.0)),
    ];
    world.drains = vec![
        Region::new(cuboid([3.0, 0.6, 3.0]), at([11.0, 0.5, 11.0])),
        Region {
            motion: Some(motion),
            ..Region::new(Shape::Cylinder { radius: DX, half_height: DX }, at([9.0, 1.0, 11.0]))
        },
    ];
    world
}

/// Gate, count, numbers and places on a device equal those on the CPU, with and without solids.
fn every_pass(backend: Backend) {
    for (world, steps) in [(busy(), 1), (busy(), 45), (mixed(), 40)] {
        let found =
            compare_step(&coming_and_going(world), steps, &backend.choice(), None).unwrap_or_else(|e| panic!("{e}"));
        let mut seen = 0;
        for d in &found {
            let exact = ["drain", "emit_gate", "emit_count", "emit_scan", "emit_place"].contains(&d.stage.name());
            let place = format!("{} after {}: {} of {} differ", d.what, d.stage.name(), d.unequal, d.compared);
            seen += usize::from(exact);
            // Decisions about emission and drains agree even where positions differ by rounding.
            if rounds_by_itself(backend) {
                assert_pass(d, backend);
            } else {
                assert!(
                    d.largest <= 256.0 && (d.unequal == 0 || d.largest < 1e-5 || !exact),
                    "{place}, by {:e}",
                    d.largest
                );
            }
        }
        assert!(seen >= 7, "{seen} comparisons");
    }
}

/// In so few slots that soon none is free; compared particle by particle for as long as rounding errors stay small.
fn the_same_particles_in_the_same_slots(backend: Backend) {
    let world = coming_and_going(busy());
    let (mut cpu, mut gpu) = (Backend::Cpu.solver(&world), backend.solver(&world));
    let (a, b) = (after(&mut *cpu, 24), after(&mut *gpu, 24));
    assert_eq!(a.len(), 2600);
    // Once the gate decides differently, all later slots differ.
    if !rounds_by_itself(backend) {
        let of = |p: &Particle| (p.fate, p.material, p.mass.to_bits());
        for (slot, (a, b)) in a.iter().zip(&b).enumerate() {
            assert_eq!(of(a), of(b), "slot {slot}");
        }
        let worst = apart(&a, &b);
        assert!(worst < 1e-4, "{worst} m");
    }
    let (a, b) = (report(&mut *cpu), report(&mut *gpu));
    let counts = [&a, &b].map(|r| [u64::from(r.alive), r.emitted, r.drained, r.withheld]);
    assert_counts(backend, counts, "alive, emitted, drained, withheld");
    assert!(a.emitted > 1000 && a.drained > 50, "{a:?}");
}

/// 10⁴ particles come and go every second for a minute: all are accounted for. On software devices it is three seconds,
/// unless `PBMPM_SLOW_TESTS` requests the full minute.
fn a_minute_of_coming_and_going(backend: Backend) {
    let mut world = empty([8.0, 12.0, 8.0], Wall::Slip);
    (world.settings.dt, world.settings.iterations) = (1.0 / 60.0, 1);
    world.settings.capacity = Some(4096);
    world.emitters = vec![Emitter {
        velocity: DVec3::new(0.0, -2.0, 0.0),
        ..Emitter::new("water", ball(2.0), at([4.0, 9.0, 4.0]), Rate::Particles(1e4))
    }];
    world.drains = vec![Region::new(Shape::HalfSpace, at([0.0, 2.0, 0.0]))];
    let mut solver = backend.solver(&world);
    let software = matches!(backend, Backend::Lavapipe | Backend::Swiftshader);
    let seconds = if software && std::env::var_os("PBMPM_SLOW_TESTS").is_none() { 3 } else { 60 };
    solver.steps(60 * seconds).unwrap();
    let report = report(&mut *solver);
    let due = 10_000 * u64::from(seconds);
    assert_eq!(report.emitted + report.withheld, due, "{report:?}");
    assert!(report.emitted > due * 99 / 100, "{report:?}");
    assert_eq!(report.emitted - report.drained, u64::from(report.alive), "{report:?}");
    let faults = report.faults;
    assert_eq!((faults.refused, faults.escaped, faults.quarantined), (0, 0, 0), "{faults:?}");
    assert_eq!(alive(&particles(&mut *solver)), report.alive as usize);
}

/// No slot is free: existing particles stay, and further ones are counted.
fn a_full_world_refuses(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.spawns = vec![block([1.0, 1.0, 1.0], [3.0, 3.0, 3.0], [0.0; 3])];
    world.settings.capacity = Some(100);
    world.emitters = vec![Emitter::new("water", ball(2.0), at([8.0, 8.0, 8.0]), Rate::Particles(6000.0))];
    let mut solver = backend.solver(&world);
    let before = particles(&mut *solver);
    assert_eq!((before.len(), alive(&before)), (100, 64));
    assert_eq!(before.iter().filter(|p| p.fate == Fate::Vacant).count(), 36);
    let end = after(&mut *solver, 12);
    assert_eq!(alive(&end), 100);
    for (slot, (a, b)) in before.iter().zip(&end).take(64).enumerate() {
        assert!(a.position.distance(b.position) < 0.1 * DX, "slot {slot}");
    }
    let report = report(&mut *solver);
    assert_eq!((report.emitted, report.faults.refused), (36, 600 - 36 - report.withheld), "{report:?}");
}

/// Too few particles to touch: each is where its flight has brought it since its emission, which is within a step or at
/// its end.
fn a_jet_flies_in_parabolas(backend: Backend) {
    let mut world = empty([60.0, 60.0, 12.0], Wall::Slip);
    world.settings.dt = 1.0 / 90.0;
    let nozzle = at([5.0, 10.0, 6.0]);
    let velocity = DVec3::new(1.5, 2.5, 0.0);
    world.emitters = vec![Emitter {
        velocity,
        ..Emitter::new("water", Shape::Sphere { radius: 1e-6 }, nozzle, Rate::Particles(7.0))
    }];
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, 45);
    assert_eq!(alive(&end), 3);
    for (k, p) in end.iter().take(3).enumerate() {
        let age = 0.5 - (k + 1) as f64 / 7.0;
        let there = nozzle + velocity * age + DVec3::new(0.0, -9.81, 0.0) * (0.5 * age * age);
        assert!(p.position.distance(there) < backend.pick(2e-6, 1e-5), "{k}: {} for {there}", p.position);
    }
}

/// Amid liquid there is no room, unless the gate is disabled.
fn a_full_place_withholds(backend: Backend) {
    let mut world = empty([8.0, 8.0, 8.0], Wall::Slip);
    // Nothing compresses the liquid away from that place.
    world.gravity = DVec3::ZERO;
    world.spawns = vec![block([0.0, 0.0, 0.0], [8.0, 6.0, 8.0], [0.0; 3])];
    let mut emitter = Emitter::new("water", ball(1.5), at([4.0, 3.0, 4.0]), Rate::Particles(3000.0));
    for (limit, share) in [(0.9, 0.0..1e-9), (1e6, 1.0..1.01)] {
        emitter.fill_limit = limit;
        world.emitters = vec![emitter.clone()];
        let mut solver = backend.solver(&world);
        solver.steps(24).unwrap();
        let report = report(&mut *solver);
        assert_eq!(report.emitted + report.withheld, 600);
        assert!(share.contains(&(report.emitted as f64 / 600.0)), "limit {limit}: {report:?}");
        assert_eq!(u64::from(report.alive), 8 * 6 * 8 * 8 + report.emitted);
    }
}

/// Nothing appears inside a body at its position then, nor outside of a container; a clamp holds what appears in it.
fn bodies_withhold(backend: Backend) {
    let half = [3.0, 6.0, 6.0];
    let wall = |shape: Shape| body(shape, half);
    let container = Collider { inverted: true, ..body(ball(2.0), [8.0, 6.0, 6.0]) };
    let clamp = Collider { boundary: Boundary::Fixed, ..wall(cuboid(half)) };
    // On its way through the emitter.
    let piston = Collider { linear_velocity: DVec3::X * DX * 20.0, ..body(cuboid(half), [1.0, 6.0, 6.0]) };
    // Two balls whose centres are a radius apart share 5/16 of their volume.
    for (name, collider, share) in [
        (
            "half-space",
            Collider { rotation: DQuat::from_rotation_z(-0.5 * PI), ..body(Shape::HalfSpace, [6.0; 3]) },
            0.5,
        ),
        ("box", wall(cuboid(half)), 0.5),
        ("mesh", wall(mesh(slab(half), 0.5)), 0.5),
        ("container", container, 0.3125),
        ("clamp", clamp, 1.0),
        ("piston", piston, 0.5),
    ] {
        let mut world = empty([12.0; 3], Wall::Slip);
        world.gravity = DVec3::ZERO;
        let emitter = Emitter::new("water", ball(2.0), at([6.0; 3]), Rate::Particles(600.0));
        world.emitters = vec![Emitter { fill_limit: 1e6, ..emitter }];
        world.colliders = vec![collider];
        let mut solver = backend.solver(&world);
        for step in 0..24 {
            solver.steps(1).unwrap();
            let inside = depth(&world, &mut *solver) / DX;
            assert!(name == "clamp" || inside < 1e-3, "{name}, step {step}: {inside} cells inside");
        }
        let report = report(&mut *solver);
        assert_eq!(report.emitted + report.withheld, 120, "{name}");
        assert!((report.emitted as f64 / 120.0 - share).abs() < 0.08, "{name}: {report:?}");
    }
}

/// A host may add particles and then, before the next step, set a body into their places.
fn bodies_set_later_withhold_what_was_added(backend: Backend) {
    let mut world = empty([12.0; 3], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.settings.capacity = Some(1000);
    world.colliders = vec![body(cuboid([2.0, 6.0, 6.0]), [-4.0, 6.0, 6.0])];
    let mut solver = backend.solver(&world);
    assert_eq!(solver.add(&block([4.0; 3], [8.0; 3], [0.0; 3])), Ok(512));
    let over_half = Pose { position: at([4.0, 6.0, 6.0]), rotation: DQuat::IDENTITY };
    solver.set_collider(0, Some(over_half), DVec3::ZERO, DVec3::ZERO).unwrap();
    solver.step().unwrap();
    let end = report(&mut *solver);
    assert_eq!((end.emitted, end.withheld, end.faults.refused), (256, 256, 0));
    assert!(particles(&mut *solver).iter().all(|p| p.fate != Fate::Alive || p.position.x > 6.0 * DX));
}

/// At the end of a step nothing is left inside a drain at its position then, and nothing outside of one has been
/// deleted.
fn drains_take_what_is_in_them(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.spawns = vec![block([1.0, 1.0, 1.0], [11.0, 11.0, 11.0], [0.0; 3])];
    let motion = Motion::Steady { linear_velocity: DVec3::new(0.3, 0.0, 0.2), angular_velocity: DVec3::Y * 2.0 };
    let moving = Region { motion: Some(motion), ..Region::new(cuboid([1.2, 3.0, 0.7]), at([3.1, 6.0, 5.0])) };
    let keep = Region { inverted: true, ..Region::new(ball(4.3), at([6.0, 6.0, 6.0])) };
    for drains in [vec![moving.clone()], vec![keep.clone()], vec![moving, keep]] {
        world.drains = drains;
        let mut solver = backend.solver(&world);
        solver.steps(7).unwrap();
        let (end, time) = (particles(&mut *solver), solver.time());
        let depth = |p: &Particle| {
            let inside = |d: &Region| {
                let pose = d.pose(time);
                let distance = d.shape.signed_distance(pose.rotation.inverse() * (p.position - pose.position));
                if d.inverted { distance } else { -distance }
            };
            world.drains.iter().map(inside).fold(f64::NEG_INFINITY, f64::max)
        };
        let gone = end.iter().filter(|p| p.fate == Fate::Drained).count();
        assert!(gone > 100 && alive(&end) > 100, "{gone} gone");
        assert!(end.iter().filter(|p| p.fate == Fate::Alive).all(|p| depth(p) < 1e-6));
        let report = report(&mut *solver);
        assert_eq!((report.drained as usize, report.alive as usize), (gone, alive(&end)));
        if world.drains.iter().all(|d| d.motion.is_none()) {
            assert!(end.iter().filter(|p| p.fate == Fate::Drained).all(|p| depth(p) > -1e-6));
        }
    }
}

/// More than the iterations that llvmpipe allows in a loop: none is left out, and they are those of the CPU path.
fn a_great_many_at_once(backend: Backend) {
    let mut world = empty([46.0; 3], Wall::Slip);
    world.settings.scheme = Scheme::Published;
    world.settings.iterations = 1;
    world.settings.capacity = Some(600_000);
    let [here, there] = [Backend::Cpu, backend].map(|backend| {
        let mut solver = backend.solver(&world);
        assert_eq!(solver.add(&block([2.0; 3], [44.0; 3], [0.1, 0.0, 0.0])), Ok(592_704));
        solver.step().unwrap();
        let report = report(&mut *solver);
        assert_eq!((report.alive, report.faults.refused, report.withheld), (592_704, 0, 0));
        particles(&mut *solver)
    });
    assert_eq!(state_hash(&here), state_hash(&there));
}

/// In a world without emitters and drains: a splash here, a region deleted there, both in one step.
fn hosts_add_and_remove(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.spawns = vec![block([1.0, 1.0, 1.0], [5.0, 5.0, 5.0], [0.0; 3])];
    world.settings.capacity = Some(512);
    let mut solver = backend.solver(&world);
    solver.step().unwrap();
    let splash = block([6.0, 6.0, 6.0], [9.0, 9.0, 9.0], [1.0, 0.0, 0.0]);
    assert_eq!(solver.add(&splash), Ok(216));
    solver.step().unwrap();
    // Every slot is taken: nothing is overwritten.
    assert_eq!(report(&mut *solver).faults.refused, 216);
    solver.remove(&Region::new(cuboid([1.0, 3.0, 3.0]), at([2.0, 3.0, 3.0]))).unwrap();
    assert_eq!(solver.add(&splash), Ok(216));
    let end = after(&mut *solver, 1);
    let left = end.iter().filter(|p| p.position.x < at([5.5; 3]).x).count();
    let moving: Vec<_> = end.iter().filter(|p| p.fate == Fate::Alive && p.position.x > at([5.5; 3]).x).collect();
    assert_eq!((left, moving.len()), (256 + 40, 216));
    assert_eq!(end.iter().filter(|p| p.fate == Fate::Drained).count(), 40);
    assert!(moving.iter().all(|p| p.velocity.distance(DVec3::X) < 1e-5));
    let centre = moving.iter().map(|p| p.position).sum::<DVec3>() / 216.0;
    assert!(centre.distance(at([7.5; 3])) < 1e-6, "{centre}");
    let after_a_step = after(&mut *solver, 1);
    let centre = after_a_step.iter().filter(|p| p.velocity.x > 0.5).map(|p| p.position).sum::<DVec3>() / 216.0;
    assert!(centre.distance(at([7.5; 3]) + DVec3::X * solver.dt()) < 1e-5, "{centre}");
    // A shape that has not been used before.
    solver.remove(&Region::new(ball(20.0), at([6.0; 3]))).unwrap();
    solver.step().unwrap();
    let report = report(&mut *solver);
    assert_eq!((report.alive, report.emitted, report.drained), (0, 216, 512 + 216));
    // In one step, no more than the number of slots.
    assert_eq!([solver.add(&splash), solver.add(&splash)], [Ok(216), Ok(216)]);
    let error = solver.add(&splash).unwrap_err();
    assert!(
        matches!(&error, Error::Invalid { field, value, .. } if field == "spawn.fill" && value == "648"),
        "{error}"
    );
    assert_eq!(solver.step(), Ok(()));
}

/// Where a device must grow buffers and repeat steps, requests of a host in these steps are carried out all the same.
fn steps_that_wait_lose_nothing(backend: Backend) {
    let mut world = empty([40.0, 20.0, 20.0], Wall::Slip);
    world.spawns = vec![block([1.0, 1.0, 1.0], [3.0, 3.0, 3.0], [0.0; 3])];
    world.settings.capacity = Some(4000);
    world.emitters = vec![Emitter::new("water", ball(1.0), at([20.0, 15.0, 10.0]), Rate::Particles(1200.0))];
    world.colliders = vec![body(ball(1.0), [30.0, 3.0, 3.0])];
    let options = GpuOptions { grid_blocks: Some(8), ..GpuOptions::default() };
    let mut solver = backend.try_solver(&world, &options).unwrap_or_else(|e| panic!("{e}"));
    for k in 0..3 {
        let x = 6.0 + 10.0 * f64::from(k);
        assert_eq!(solver.add(&block([x, 8.0, 8.0], [x + 4.0, 12.0, 12.0], [0.0; 3])), Ok(512));
        solver.steps(2).unwrap();
    }
    let there = Pose { position: at([33.0, 3.0, 3.0]), ..solver.poses()[0] };
    solver.set_collider(0, Some(there), DVec3::ZERO, DVec3::ZERO).unwrap();
    solver.add(&block([1.0, 12.0, 12.0], [4.0, 15.0, 15.0], [0.0; 3])).unwrap();
    solver.steps(2).unwrap();
    let report = report(&mut *solver);
    let emitted = 3 * 512 + 216 + 80;
    assert_eq!((report.step, report.emitted, report.alive), (8, emitted, 64 + emitted as u32), "{report:?}");
    assert_eq!(solver.poses()[0], there);
    assert_eq!(report.faults.steps_deferred > 0, !matches!(backend, Backend::Cpu | Backend::Cpu64));
}

fn rates_change(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.emitters = vec![
        Emitter { end: Some(0.05), ..Emitter::new("water", ball(1.0), at([3.0; 3]), Rate::Particles(1200.0)) },
        Emitter { fill_limit: 1e6, ..Emitter::new("water", ball(2.0), at([8.0; 3]), Rate::Particles(600.0)) },
    ];
    let mut solver = backend.solver(&world);
    solver.steps(12).unwrap();
    solver.set_emission(1, Rate::Particles(0.0)).unwrap();
    solver.steps(12).unwrap();
    assert_eq!(report(&mut *solver).emitted + report(&mut *solver).withheld, 60 + 60);
    solver.set_emission(1, Rate::Litres(DX.powi(3) / 8.0 * 1000.0 * 2400.0)).unwrap();
    solver.steps(12).unwrap();
    assert_eq!(report(&mut *solver).emitted + report(&mut *solver).withheld, 60 + 60 + 240);
    assert!(
        matches!(solver.set_emission(2, Rate::Particles(1.0)), Err(Error::Invalid { field, .. }) if field == "emitter")
    );
    // Together with the other's 2,400.
    let error = solver.set_emission(0, Rate::Particles(9_999_000.0));
    assert!(matches!(error, Err(Error::Invalid { field, .. }) if field == "emitters"));
    let error = solver.set_emission(0, Rate::Particles(f64::NAN));
    assert!(matches!(error, Err(Error::Invalid { field, .. }) if field == "emitters[0].rate.particles"));
}

fn bad_values_are_refused() {
    let good = coming_and_going(busy());
    assert_eq!(good.validate(), Ok(()));
    type Change = fn(&mut World);
    let broken: [(&str, Change); 18] = [
        ("emitters[0].material", |w| w.emitters[0].material = "lead".to_owned()),
        ("emitters[1].shape", |w| w.emitters[1].shape = Shape::HalfSpace),
        ("emitters[0].shape.sphere.radius", |w| w.emitters[0].shape = Shape::Sphere { radius: -1.0 }),
        ("emitters[0].position", |w| w.emitters[0].position.y = f64::NAN),
        ("emitters[0].velocity", |w| w.emitters[0].velocity.y = 1e7),
        ("emitters[0].motion.oscillate.frequency", |w| {
            w.emitters[0].motion = Some(Motion::Oscillate {
                amplitude: DVec3::ZERO,
                frequency: -1.0,
                phase: 0.0,
                angular_amplitude: DVec3::ZERO,
            });
        }),
        ("emitters[1].rate.litres", |w| w.emitters[1].rate = Rate::Litres(1e9)),
        ("emitters[0].rate.particles", |w| w.emitters[0].rate = Rate::Particles(-1.0)),
        ("emitters[0].per_cell", |w| w.emitters[0].per_cell = 0.0),
        ("emitters[0].fill_limit", |w| w.emitters[0].fill_limit = 0.0),
        ("emitters[0].start", |w| w.emitters[0].start = -1.0),
        ("emitters[0].end", |w| (w.emitters[0].start, w.emitters[0].end) = (2.0, Some(1.0))),
        ("emitters", |w| w.emitters = vec![w.emitters[0].clone(); 257]),
        ("emitters", |w| w.emitters[..2].iter_mut().for_each(|e| e.rate = Rate::Particles(6e6))),
        ("drains[1].rotation", |w| w.drains[1].rotation *= 2.0),
        ("drains[0].motion.steady.linear_velocity", |w| {
            w.drains[0].motion =
                Some(Motion::Steady { linear_velocity: DVec3::splat(f64::INFINITY), angular_velocity: DVec3::ZERO });
        }),
        ("drains", |w| w.drains = vec![w.drains[0].clone(); 257]),
        ("settings.capacity", |w| w.settings.capacity = Some(10)),
    ];
    for (field, change) in broken {
        let mut world = good.clone();
        change(&mut world);
        let error = pbmpm::CpuSolver::<f32>::new(&world).err();
        assert!(matches!(&error, Some(Error::Invalid { field: found, .. }) if found == field), "{field}: {error:?}");
    }
    let mut solver = Backend::Cpu.solver(&good);
    let before = report(&mut *solver);
    let one = || block([2.0, 2.0, 2.0], [3.0, 3.0, 3.0], [0.0; 3]);
    let outside = block([-2.0, 2.0, 2.0], [3.0, 3.0, 3.0], [0.0; 3]);
    let unknown = Spawn { material: "lead".to_owned(), ..one() };
    let many = block([0.0, 0.0, 0.0], [14.0, 14.0, 14.0], [0.0; 3]);
    for (spawn, field) in [(outside, "spawn"), (unknown, "spawn.material"), (many, "spawn.fill")] {
        let error = solver.add(&spawn);
        assert!(matches!(&error, Err(Error::Invalid { field: found, .. }) if found == field), "{field}: {error:?}");
    }
    let error = solver.remove(&Region::new(ball(f64::NAN), at([1.0; 3])));
    assert!(matches!(error, Err(Error::Invalid { field, .. }) if field == "region.shape.sphere.radius"));
    assert_eq!(before, report(&mut *solver));
    let mut sand = good;
    sand.materials[0].model = Model::Sand { friction_angle: 30.0 };
    assert!(pbmpm::CpuSolver::<f32>::new(&sand).is_ok());
}
