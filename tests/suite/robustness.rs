//! Worlds at the limits of what is allowed: nothing breaks, nothing is lost.

use crate::alike::assert_states;
use crate::backends::{ALL, Backend, MOST, Tests};
use crate::worlds::{DX, after, assert_sound, ball, block, body, cuboid, depth, empty, particles, report, state};
use pbmpm::{Boundary, DQuat, DVec3, Fill, Pose, Spawn, Wall, World};

pub fn add(tests: &mut Tests) {
    tests.each("robustness", MOST, "a_thousand_particles_in_one_cell", a_thousand_particles_in_one_cell);
    tests.each("robustness", MOST, "more_matter_in_a_cell_than_a_node_holds", more_matter_in_a_cell_than_a_node_holds);
    tests.each("robustness", MOST, "a_hundred_colliders", a_hundred_colliders);
    tests.each("robustness", MOST, "overlapping_colliders", overlapping_colliders);
    tests.each("robustness", MOST, "a_body_put_into_the_liquid", a_body_put_into_the_liquid);
    tests.each("robustness", MOST, "shortest_and_longest_steps", shortest_and_longest_steps);
    tests.each("robustness", MOST, "strongest_gravity_and_speed", strongest_gravity_and_speed);
    tests.each("robustness", ALL, "no_walls_and_no_bodies", no_walls_and_no_bodies);
    tests.each("robustness", MOST, "what_flies_too_fast_is_slowed_alike", what_flies_too_fast_is_slowed_alike);
}

/// In mid-air, far from any side: the CPU path passes over all that contact does there.
fn what_flies_too_fast_is_slowed_alike(backend: Backend) {
    let mut world = empty([48.0, 48.0, 48.0], Wall::Slip);
    for bound in [0.7, 1.0, 4.0] {
        world.settings.max_displacement = bound;
        let cells_per_step = |v: [f64; 3]| v.map(|c| c * 1.5 * bound * DX * 120.0);
        world.spawns = vec![
            block([20.0, 20.0, 20.0], [26.0, 24.0, 26.0], cells_per_step([0.7, 0.3, -0.8])),
            block([20.0, 30.0, 20.0], [26.0, 34.0, 26.0], cells_per_step([-0.5, 0.8, 0.6])),
        ];
        let here = after(&mut *backend.solver(&world), 2);
        let there = after(&mut *Backend::Cpu.solver(&world), 2);
        if backend != Backend::Cpu64 {
            assert_states(backend, &here, &there, &format!("{bound} cells"));
        }
        let fastest = here.iter().map(|p| p.velocity.length() / (DX * 120.0)).fold(0.0, f64::max);
        assert!(fastest > 0.9 * bound && fastest < 1.00001 * bound, "{fastest} of {bound} cells per step");
    }
}

/// A thousand light particles in one cell, with the mass of eight usual ones.
fn a_thousand_particles_in_one_cell(backend: Backend) {
    let mut world = empty([8.0, 8.0, 8.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns.push(Spawn { fill: Fill::PerCell(1000.0), ..block([3.0, 2.0, 3.0], [4.0, 3.0, 4.0], [0.0; 3]) });
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, 20);
    assert_eq!(end.len(), 1000);
    assert_sound(&end);
    let report = report(&mut *solver);
    assert_eq!((report.faults.saturated_nodes, report.alive), (0, 1000));
    assert!((state(&mut *solver).mass_kg - 1000.0 * DX.powi(3)).abs() < 1e-9);
    assert!(depth(&world, &mut *solver) <= 0.0);
}

/// 300 times the matter of a cell, 34 cell masses on its nodes, where 16 are counted and 32 wrap the sums. With room
/// for it nothing is counted; without room, it is counted and all stays finite.
fn more_matter_in_a_cell_than_a_node_holds(backend: Backend) {
    let mut world = empty([16.0, 16.0, 16.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns = vec![block([7.0, 7.0, 7.0], [8.0, 8.0, 8.0], [0.0; 3]); 300];
    for (max_fill, room) in [(16.0, false), (256.0, true)] {
        world.settings.max_fill = max_fill;
        let mut solver = backend.solver(&world);
        let end = after(&mut *solver, 6);
        assert_eq!(end.len(), 2400);
        assert_sound(&end);
        let report = report(&mut *solver);
        // Double precision does not use fixed-point sums and holds any amount.
        let counted = !room && backend != Backend::Cpu64;
        assert_eq!(report.faults.saturated_nodes > 0, counted, "{:?}", report.faults);
        assert_eq!(report.alive, 2400);
        assert!(depth(&world, &mut *solver) <= 0.0);
    }
}

/// Four words of the cull mask: 10 by 10 balls that overlap hold up a slab of liquid. Between four of them the
/// lowest point lies √(1.9² − 2) = 1.27 cells above their centres.
fn a_hundred_colliders(backend: Backend) {
    let mut world = empty([20.0, 10.0, 20.0], Wall::Slip);
    world.settings.iterations = 1;
    for i in 0..100 {
        let at = [1.0 + 2.0 * f64::from(i % 10), 1.2, 1.0 + 2.0 * f64::from(i / 10)];
        world.colliders.push(body(ball(1.9), at));
    }
    // Above the first rows and above the last.
    world.spawns.push(block([0.0, 3.5, 0.0], [20.0, 4.5, 4.0], [0.0; 3]));
    world.spawns.push(block([0.0, 3.5, 16.0], [20.0, 4.5, 20.0], [0.0; 3]));
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, 20);
    assert_sound(&end);
    let inside = depth(&world, &mut *solver) / DX;
    assert!(inside < 0.1, "{inside} cells");
    let lowest = state(&mut *solver).bounds_m[0][1] / DX;
    assert!(lowest > 2.4 && lowest < 3.1, "the liquid lies on the balls: {lowest}");
}

/// Boxes that turn through each other, a floor and a ball, all overlapping with the liquid.
fn overlapping_colliders(backend: Backend) {
    let mut world = empty([14.0, 14.0, 14.0], Wall::Friction(0.5));
    world.settings.iterations = 2;
    world.spawns.push(block([4.0, 3.0, 4.0], [10.0, 8.0, 10.0], [0.0; 3]));
    for i in 0..4 {
        let mut arm = body(cuboid([4.0, 0.5, 0.5]), [7.0, 4.0, 7.0]);
        arm.rotation = DQuat::from_rotation_y(0.7 * f64::from(i));
        arm.angular_velocity = DVec3::new(0.0, 4.0 - 2.0 * f64::from(i), 1.0);
        arm.boundary = [Boundary::Slip, Boundary::Stick, Boundary::Friction(1.0), Boundary::Friction(10.0)][i as usize];
        world.colliders.push(arm);
    }
    world.colliders.push(body(ball(1.5), [7.0, 4.0, 7.0]));
    world.colliders.push(body(pbmpm::Shape::HalfSpace, [0.0, 1.0, 0.0]));
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, 40);
    assert_sound(&end);
    let now = state(&mut *solver);
    // The arms' tips move at 0.5 m/s and the liquid falls 8 cells.
    assert!(now.max_speed_m_s < 4.0 * DX * 120.0, "{}", now.max_speed_m_s);
    let fall = now.mass_kg * 9.81 * 8.0 * DX;
    assert!(now.kinetic_j < fall, "{} J, a fall has {fall}", now.kinetic_j);
}

/// A ball that appears in a pool displaces the liquid within a few steps without making it explode.
fn a_body_put_into_the_liquid(backend: Backend) {
    let mut world = empty([10.0, 12.0, 10.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns.push(block([0.0; 3], [10.0, 4.0, 10.0], [0.0; 3]));
    world.colliders.push(body(ball(1.5), [5.0, 9.0, 5.0]));
    let mut solver = backend.solver(&world);
    solver.steps(5).unwrap();
    let pose = Pose { position: DVec3::new(5.0, 2.0, 5.0) * DX, rotation: DQuat::IDENTITY };
    solver.set_collider(0, Some(pose), DVec3::ZERO, DVec3::ZERO).unwrap();
    assert_eq!(solver.poses()[0], pose);
    assert!(depth(&world, &mut *solver) > DX, "the ball is in the liquid");
    let end = after(&mut *solver, 20);
    assert_sound(&end);
    let inside = depth(&world, &mut *solver) / DX;
    assert!(inside < 0.1, "{inside} cells inside");
    let now = state(&mut *solver);
    let fall = now.mass_kg * 9.81 * 4.0 * DX;
    assert!(now.kinetic_j < 0.5 * fall, "{} J, a fall has {fall}", now.kinetic_j);
}

/// 1e-5 s and 0.2 s, and changes from one to the other. In 0.2 s gravity alone moves matter by 20 cells, five times the
/// bound.
fn shortest_and_longest_steps(backend: Backend) {
    let mut world = empty([10.0, 16.0, 10.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns.push(block([3.0, 4.0, 3.0], [7.0, 8.0, 7.0], [0.2, 0.0, 0.0]));
    world.colliders.push(body(ball(2.0), [5.0, 1.0, 5.0]));
    let mut solver = backend.solver(&world);
    let mut steps = 0;
    for dt in [1e-5, 0.2, 1e-5, 0.2, 1.0 / 120.0] {
        solver.set_dt(dt).unwrap();
        let now = after(&mut *solver, 4);
        steps += 4;
        assert_sound(&now);
        assert!(depth(&world, &mut *solver) < 0.6 * DX, "after steps of {dt} s");
    }
    let report = report(&mut *solver);
    assert_eq!((report.step, report.alive), (steps, 512));
    assert!((report.time - 4.0 * (0.4 + 2e-5 + 1.0 / 120.0)).abs() < 1e-9, "{}", report.time);
}

/// The largest allowed gravity and the fastest allowed spawn: clamped, counted, finite.
fn strongest_gravity_and_speed(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.settings.iterations = 2;
    world.gravity = DVec3::new(1e6, -1e6, 1e6);
    world.spawns.push(block([4.0, 4.0, 4.0], [8.0, 8.0, 8.0], [-1e6, 1e6, 0.0]));
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, 10);
    assert_sound(&end);
    assert!(report(&mut *solver).faults.speed_clamped > 0);
    assert!(depth(&world, &mut *solver) <= 0.0);
    // Back to rest within bounds.
    solver.set_gravity(DVec3::new(0.0, -9.81, 0.0)).unwrap();
    assert_sound(&after(&mut *solver, 20));
}

/// The variant without contact: all sides open, no body.
fn no_walls_and_no_bodies(backend: Backend) {
    let mut world: World = empty([16.0, 24.0, 16.0], Wall::Open);
    world.spawns.push(block([6.0, 12.0, 6.0], [10.0, 16.0, 10.0], [0.0; 3]));
    let mut solver = backend.solver(&world);
    let start = particles(&mut *solver);
    let end = after(&mut *solver, 12);
    assert_sound(&end);
    let fallen = start[7].position.y - end[7].position.y;
    assert!((fallen - 0.5 * 9.81 * 0.01).abs() < 5e-4 * DX, "{fallen}");
    // Then it leaves through the floor.
    solver.steps(60).unwrap();
    let report = report(&mut *solver);
    assert_eq!((report.faults.escaped, report.alive), (512, 0));
    assert_eq!(state(&mut *solver), pbmpm::State::default());
    solver.steps(3).unwrap();
    assert_eq!(crate::worlds::report(&mut *solver).active_blocks, 0);
}
