//! Loads that the matter exerts on bodies.

use crate::alike::{assert_loads, assert_states};
use crate::backends::{ALL, Backend, CPUS, DEVICES, MOST, Tests};
use crate::floating_box;
use crate::suite::measure::angular_momentum;
use crate::worlds::{DX, ball, block, body, busy, cuboid, empty, particles, state};
use pbmpm::{
    Boundary, Collider, CpuSolver, DQuat, DVec3, Fate, GpuOptions, Load, Loads, Material, MeanLoad, Particle, Quality,
    Scheme, Shape, Simulate, Spawn, Wall, World,
};

pub fn add(tests: &mut Tests) {
    tests.each("loads", MOST, "what_contact_takes_the_bodies_receive", what_contact_takes_the_bodies_receive);
    tests.each("loads", MOST, "what_drags_receives_it_too", what_drags_receives_it_too);
    tests.each("loads", MOST, "what_stresses_press_they_receive_too", what_stresses_press_they_receive_too);
    tests.each("loads", MOST, "hard_impacts_leave_nothing_out", hard_impacts_leave_nothing_out);
    tests.each("loads", DEVICES, "devices_and_their_twin_agree", devices_and_their_twin_agree);
    tests.each("loads", DEVICES, "steps_that_are_not_taken_do_not_count", steps_that_are_not_taken_do_not_count);
    tests.each("loads", ALL, "only_what_is_asked_for", only_what_is_asked_for);
    tests.each("loads", MOST, "a_floor_bears_the_weight", a_floor_bears_the_weight);
    tests.each("loads", CPUS, "a_column_off_the_middle_turns_a_plate", a_column_off_the_middle_turns_a_plate);
    tests.each("loads", CPUS, "a_bar_in_a_pool_feels_archimedes_force", a_bar_in_a_pool_feels_archimedes_force);
    tests.each(
        "loads",
        &[Backend::Cpu],
        "a_small_body_is_lifted_wherever_it_is",
        a_small_body_is_lifted_wherever_it_is,
    );
    tests.each("loads", &[Backend::Cpu], "a_box_floats_as_deep_as_it_should", a_box_floats_as_deep_as_it_should);
}

fn measured(collider: Collider) -> Collider {
    Collider { measure: true, ..collider }
}

/// Two liquids that fall on turning bodies over a rough floor that is a body too; no side of the domain is reached.
fn closed() -> World {
    let mut world = busy();
    world.domain.walls = pbmpm::Walls::all(Wall::Open);
    world.domain.min -= DVec3::splat(20.0 * DX);
    world.domain.max += DVec3::splat(20.0 * DX);
    let mut floor = body(Shape::HalfSpace, [3.0, 0.5, 7.0]);
    floor.boundary = Boundary::Friction(0.3);
    floor.rotation = DQuat::from_rotation_x(0.1);
    world.colliders.push(floor);
    let mut cup = body(cuboid([12.0, 12.0, 12.0]), [7.0, 10.0, 7.0]);
    cup.inverted = true;
    cup.angular_velocity = DVec3::new(0.3, 0.5, 0.0);
    world.colliders.push(cup);
    world.colliders = world.colliders.into_iter().map(measured).collect();
    world
}

/// Momentum and angular momentum about the origin, including that of the particles' own affine motion.
fn momenta(particles: &[Particle]) -> (DVec3, DVec3) {
    let alive: Vec<_> = particles.iter().filter(|p| p.fate == Fate::Alive).cloned().collect();
    (alive.iter().map(|p| p.velocity * p.mass).sum(), angular_momentum(&alive, DX))
}

/// In each step the change of the matter's momenta, beyond gravity's part, equals what the bodies lose, also while step
/// length and gravity change. Of the momentum, 1e-9 may be missing, in f32 a few rounding errors. Matter that is pushed
/// out of a body keeps its velocity at another place: the angular momentum may be off by 1e-3 of that of all momentum
/// moved one cell aside.
fn what_contact_takes_the_bodies_receive(backend: Backend) {
    let world = closed();
    let (loads, given) = exchanged(backend, &world, [1.0 / 120.0, 1.0 / 200.0], 1e-9, 1e-3);
    for i in 0..world.colliders.len() {
        let load = loads.of(i).unwrap();
        assert!(load.impulse.length() > 1e-2 * given, "{i}: {load:?}");
        // Nothing can turn a ball without friction.
        let turned = load.angular_impulse.length() / (load.impulse.length() * DX);
        assert!(if i == 1 { turned < 1e-6 } else { turned > 0.1 }, "{i}: {load:?}");
    }
}

/// The same for the drag of walls, and for what they withhold from particles beside them.
fn what_drags_receives_it_too(backend: Backend) {
    let mut world = closed();
    world.settings.scheme = Scheme::Explicit;
    world.materials.iter_mut().for_each(|m| m.viscosity = 5.0);
    world.colliders.iter_mut().for_each(|c| c.boundary = Boundary::Stick);
    let dt = 1.0 / 400.0;
    world.settings.dt = dt;
    exchanged(backend, &world, [dt, 0.7 * dt], 1e-9, 1e-3);
}

/// The same in the implicit scheme, where stresses push nodes that bodies hold, and push and pull them off.
fn what_stresses_press_they_receive_too(backend: Backend) {
    let mut world = closed();
    world.settings.scheme = Scheme::Implicit;
    world.settings.iterations = 6;
    world.colliders[1].linear_velocity = DVec3::new(-2.0, 0.5, 0.0);
    // Loads are whole numbers of units, and each node that stresses press rounds once more: 1e-8 at most was found.
    exchanged(backend, &world, [1.0 / 300.0, 1.0 / 200.0], 1e-7, 1e-3);
}

/// Rubber that is thrown at bodies: stresses would make light nodes deep in them many times faster than nodes may be,
/// and these lose it all to the bodies that hold them.
fn hard_impacts_leave_nothing_out(backend: Backend) {
    for boundary in [Boundary::Fixed, Boundary::Friction(0.3), Boundary::Slip] {
        let mut world = empty([48.0, 48.0, 48.0], Wall::Open);
        world.settings.scheme = Scheme::Implicit;
        world.settings.iterations = 12;
        world.materials = vec![Material { name: "water".to_owned(), youngs_modulus: 1e5, ..Material::elastic("") }];
        world.spawns.push(block([20.0, 20.3, 20.0], [26.0, 26.3, 26.0], [0.5, -4.0, 0.0]));
        world.colliders.push(Collider { boundary, ..measured(body(cuboid([10.0, 4.0, 10.0]), [23.0, 15.7, 23.0])) });
        // The correction beside clamps takes angular momentum.
        let aside = if boundary == Boundary::Fixed { 2e-2 } else { 1e-3 };
        exchanged(backend, &world, [1.0 / 300.0, 1.0 / 200.0], 1e-7, aside);
    }
}

/// The loads of a world's bodies after steps of these lengths, and the sum of all momentum involved, kg m/s. Without
/// rounding on the grid this share of it may be missing, and of its angular momentum as much as if all of it were moved
/// `aside` by so many cells.
fn exchanged(backend: Backend, world: &World, dts: [f64; 2], share: f64, aside: f64) -> (Loads, f64) {
    let mut solver = backend.solver(world);
    let mut before = solver.particles().unwrap();
    let mut loads = solver.loads().unwrap();
    let mut kick = DVec3::ZERO; // the part of the last step's gravity that is still to be applied, m/s
    // Sum of the magnitudes of the matter's momentum, kg m/s.
    let mut given: f64 = before.iter().map(|p| p.mass * p.velocity.length()).sum();
    for step in 0..60 {
        solver.set_dt(dts[step / 7 % 2]).unwrap();
        solver.set_gravity(DVec3::new(if step > 30 { 3.0 } else { 0.0 }, -9.81, 0.0)).unwrap();
        let half = solver.gravity() * solver.dt() * 0.5;
        let poses = solver.poses().to_vec();
        solver.step().unwrap();
        let (now, new) = (solver.particles().unwrap(), solver.loads().unwrap());
        let (mut lost, mut lost_angular) = (DVec3::ZERO, DVec3::ZERO);
        for (i, pose) in poses.iter().enumerate() {
            let (a, b) = (loads.of(i).unwrap(), new.of(i).unwrap());
            lost += b.impulse - a.impulse;
            lost_angular += b.angular_impulse - a.angular_impulse + pose.position.cross(b.impulse - a.impulse);
        }
        let kicks = before.iter().map(|p| ((kick + half) * p.mass, p.position.cross(kick + half) * p.mass));
        let (gravity, turned) = kicks.fold((DVec3::ZERO, DVec3::ZERO), |s, k| (s.0 + k.0, s.1 + k.1));
        given += gravity.length();
        let (old, moved) = (momenta(&before), momenta(&now));
        let missing = moved.0 - old.0 - gravity + lost;
        assert!(missing.length() < backend.pick(share, 1e-5) * given, "step {step}: {missing} of {given}");
        let missing = moved.1 - old.1 - turned + lost_angular;
        assert!(missing.length() < aside * given * DX, "step {step}: {missing} of {given} times {DX} m");
        (before, loads, kick) = (now, new, half);
    }
    assert!(before.iter().all(|p| p.fate == Fate::Alive));
    (loads, given)
}

fn agreed(backend: Backend, world: &World, options: &GpuOptions, steps: u32) {
    let mut cpu = CpuSolver::<f32>::new(world).unwrap();
    cpu.steps(steps).unwrap();
    let mut solver = backend.try_solver(world, options).unwrap();
    solver.steps(steps).unwrap();
    let (expected, found) = (cpu.loads().unwrap(), solver.loads().unwrap());
    assert!(expected.of(0).unwrap().impulse != DVec3::ZERO);
    assert_loads(backend, &expected, &found, world.colliders.len());
}

/// As well as the particles do.
fn devices_and_their_twin_agree(backend: Backend) {
    agreed(backend, &closed(), &GpuOptions::default(), 40);
    // More loads than copies of each.
    let mut world = closed();
    world.colliders.extend((0..80).map(|i| measured(body(ball(0.4), [1.0 + 0.15 * f64::from(i), 1.0, 7.0]))));
    agreed(backend, &world, &GpuOptions::default(), 20);
}

/// A grid that is much too small at first, so that steps are deferred again and again.
fn steps_that_are_not_taken_do_not_count(backend: Backend) {
    let world = closed();
    let options = GpuOptions { grid_blocks: Some(8), ..GpuOptions::default() };
    let mut solver = backend.try_solver(&world, &options).unwrap();
    solver.steps(1).unwrap();
    assert!(solver.report().unwrap().faults.steps_deferred > 0);
    agreed(backend, &world, &options, 30);
}

fn only_what_is_asked_for(backend: Backend) {
    let mut world = busy();
    world.colliders[1].measure = true;
    let mut solver = backend.solver(&world);
    let start = solver.loads().unwrap();
    assert_eq!((start.of(0), start.of(1), start.of(2)), (None, Some(Load::default()), None));
    solver.steps(20).unwrap();
    let now = solver.loads().unwrap();
    assert_eq!((now.step, now.time, now.of(0)), (20, solver.time(), None));
    let load = now.of(1).unwrap();
    let mean = now.mean_since(&start, 1).unwrap();
    assert!(load.impulse.y < 0.0, "it is pressed down: {load:?}");
    assert!((mean.force * now.time).distance(load.impulse) < 1e-12);
    assert_eq!(now.mean_since(&start, 0), None);
    let mut without = backend.solver(&busy());
    without.steps(20).unwrap();
    assert_eq!(without.loads().unwrap().of(1), None);
    let [measured, unmeasured] = [&mut solver, &mut without].map(|s| particles(&mut **s));
    assert_states(backend, &measured, &unmeasured, "measuring changes nothing");
}

/// The mean load on the first collider over `steps` steps after `rest` steps.
fn mean(solver: &mut dyn Simulate, rest: u32, steps: u32) -> MeanLoad {
    solver.steps(rest).unwrap();
    let before = solver.loads().unwrap();
    solver.steps(steps).unwrap();
    solver.loads().unwrap().mean_since(&before, 0).unwrap()
}

/// A box as the floor under a well of liquid: once at rest, the mean load over an oscillation of the pool is its weight
/// within 1 %.
fn a_floor_bears_the_weight(backend: Backend) {
    let mut world = empty([4.0, 16.0, 4.0], Wall::Slip);
    world.settings.dt = 1.0 / 240.0;
    world.colliders.push(measured(body(cuboid([8.0, 1.0, 8.0]), [2.0, 1.0, 2.0])));
    world.spawns.push(block([0.0, 2.0, 0.0], [4.0, 6.0, 4.0], [0.0; 3]));
    let mut solver = backend.solver(&world);
    let load = mean(&mut *solver, 120, 120);
    let weight = state(&mut *solver).mass_kg * 9.81;
    assert!((load.force / weight).distance(DVec3::NEG_Y) < 0.01, "{load:?}, weight {weight}");
    assert!(load.torque.length() < 0.01 * weight * DX, "{load:?} about the middle");
}

/// The same well over one end of a plate: the torque is its weight times the distance from the plate's middle, within 1
/// %.
fn a_column_off_the_middle_turns_a_plate(backend: Backend) {
    let mut world = empty([16.0, 16.0, 4.0], Wall::Slip);
    world.settings.dt = 1.0 / 240.0;
    world.colliders.push(measured(body(cuboid([8.0, 1.0, 2.0]), [8.0, 1.0, 2.0])));
    world.colliders.push(body(cuboid([6.0, 8.0, 8.0]), [6.0, 10.0, 2.0]));
    world.spawns.push(block([12.0, 2.0, 0.0], [16.0, 6.0, 4.0], [0.0; 3]));
    let mut solver = backend.solver(&world);
    let load = mean(&mut *solver, 120, 120);
    let now = state(&mut *solver);
    let weight = now.mass_kg * 9.81;
    let arm = now.centre_of_mass_m[0] - 8.0 * DX;
    assert!(arm > 5.5 * DX && arm < 6.5 * DX);
    assert!((load.torque / (weight * arm)).distance(DVec3::NEG_Z) < 0.01, "{load:?}, expected {}", weight * arm);
}

/// A bar across a channel, held in water at rest, is lifted by the weight of the displaced water. Its faces lie on the
/// grid; at its edges only the nearest side stops a node, which takes half a cell off the width at each: 4 % are
/// allowed.
fn a_bar_in_a_pool_feels_archimedes_force(backend: Backend) {
    let mut world = empty([52.0, 18.0, 2.0], Wall::Slip);
    world.settings.dt = 1.0 / 240.0;
    world.settings.iterations = 16;
    world.colliders.push(measured(body(cuboid([20.0, 3.0, 8.0]), [26.0, 8.0, 1.0])));
    world.spawns = vec![
        block([0.0, 0.0, 0.0], [52.0, 5.0, 2.0], [0.0; 3]),
        block([0.0, 5.0, 0.0], [6.0, 11.0, 2.0], [0.0; 3]),
        block([46.0, 5.0, 0.0], [52.0, 11.0, 2.0], [0.0; 3]),
        block([0.0, 11.0, 0.0], [52.0, 14.0, 2.0], [0.0; 3]),
    ];
    let mut solver = backend.solver(&world);
    let load = mean(&mut *solver, 240, 120);
    let expected = 1000.0 * 9.81 * (40.0 * 6.0 * 2.0) * DX.powi(3);
    assert!((load.force / expected).distance(DVec3::Y) < 0.04, "{load:?}, expected {expected}");
}

/// Boxes of 4 to 8 cells and a ball of 8 across, deep in a tank, with faces on nodes or off: the resting liquid around
/// them exerts Archimedes' force, within a tenth, and stays at rest.
fn a_small_body_is_lifted_wherever_it_is(backend: Backend) {
    let flat = (cuboid([3.0, 2.0, 3.0]), 6.0 * 4.0 * 6.0);
    let cube = (cuboid([2.0; 3]), 4.0 * 4.0 * 4.0);
    let beam = (cuboid([4.0, 2.5, 2.0]), 8.0 * 5.0 * 4.0);
    let round = (ball(4.0), 4.0 / 3.0 * std::f64::consts::PI * 64.0);
    for ((shape, volume), off) in [(flat.clone(), 0.0), (flat, 0.75), (cube, 0.0), (beam, 0.3), (round, 0.5)] {
        let mut world = empty([18.0; 3], Wall::Slip);
        world.spawns.push(Spawn { jitter: 0.2, ..block([0.0; 3], [18.0, 13.0, 18.0], [0.0; 3]) });
        world.colliders.push(measured(body(shape.clone(), [9.0 + off, 7.0 + off, 9.0 + off])));
        world.settings = Quality::Realtime.settings_in(Scheme::Implicit, &world);
        let mut solver = backend.solver(&world);
        let load = mean(&mut *solver, 300, 300);
        let lift = load.force.y / (1000.0 * 9.81 * volume * DX.powi(3));
        assert!((lift - 1.0).abs() < 0.1, "{lift} of the lift of {shape:?} at {off}");
        let now = state(&mut *solver);
        let left = now.kinetic_j / (now.mass_kg * 9.81 * DX);
        assert!(left < 5e-3, "{left} of a fall by a cell beside {shape:?} at {off}");
    }
}

/// The example, in which another engine moves the box: it floats as deep as its density requires, within 5 %, and does
/// not tip over, whether it is dropped or released under water. Its righting moment is sampled by rows of nodes, so
/// that from some starts it rolls by up to 0.14 for a second or two.
fn a_box_floats_as_deep_as_it_should(backend: Backend) {
    for (ratio, lifted) in [(0.5, 1.5), (0.5, -1.5), (0.75, -1.0), (0.25, 1.5)] {
        let world = floating_box::world(ratio, lifted);
        let mut solver = backend.solver(&world);
        let found = floating_box::float(&mut *solver, ratio, 3.0).unwrap();
        // In cells: the grid represents its bottom by rows of nodes.
        let off = (found.depth - found.expected) / floating_box::CELL;
        assert!(off.abs() < 0.4, "{ratio} {lifted}: {off}, {found:?}");
        assert!(found.tilt.abs() < 0.15, "{ratio} {lifted}: {found:?}");
    }
}
