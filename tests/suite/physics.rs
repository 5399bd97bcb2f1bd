//! Motion without contact: free fall, drift, and what must be conserved.

use crate::backends::{ALL, Backend, CPUS, MOST, Tests};
use crate::worlds::{DX, after, apart, assert_sound, block, empty, larger, one, particles, report, state};
use pbmpm::{CpuSolver, DVec3, Fate, Material, Simulate, Spawn, Wall, World};

pub fn add(tests: &mut Tests) {
    tests.each("physics", ALL, "free_fall_is_a_parabola", free_fall_is_a_parabola);
    tests.each("physics", ALL, "free_fall_of_jittered_matter", free_fall_of_jittered_matter);
    tests.each(
        "physics",
        ALL,
        "free_fall_under_changing_steps_and_gravity",
        free_fall_under_changing_steps_and_gravity,
    );
    tests.each("physics", ALL, "step_changed_before_the_first", step_changed_before_the_first);
    tests.each("physics", MOST, "whole_cell_drift_changes_nothing", whole_cell_drift_changes_nothing);
    tests.each("physics", CPUS, "any_drift_changes_little", any_drift_changes_little);
    tests.each("physics", MOST, "momentum_and_mass_are_kept", momentum_and_mass_are_kept);
    tests.each("physics", MOST, "momentum_of_unequal_spray_is_kept", momentum_of_unequal_spray_is_kept);
    tests.each("physics", MOST, "lone_particles_keep_their_speed", lone_particles_keep_their_speed);
    tests.each("physics", ALL, "fast_particles_are_slowed_and_counted", fast_particles_are_slowed_and_counted);
    tests.each("physics", ALL, "open_sides_delete_and_count", open_sides_delete_and_count);
    tests.each(
        "physics",
        ALL,
        "viscosity_damps_and_zero_viscosity_does_not",
        viscosity_damps_and_zero_viscosity_does_not,
    );
    tests.once(
        "physics",
        "how_full_a_node_is_does_not_depend_on_density",
        how_full_a_node_is_does_not_depend_on_density,
    );
}

const GRAVITY: DVec3 = DVec3::new(0.0, -9.81, 0.0);

/// A cube of 4³ cells in flight, far from every side.
fn flight(velocity: [f64; 3]) -> World {
    let mut world = empty([80.0, 96.0, 24.0], Wall::Slip);
    world.spawns.push(block([8.0, 40.0, 8.0], [12.0, 44.0, 12.0], velocity));
    world
}

/// Half a second of flight against `x0 + v t + g t²/2`: the centre of mass as a share of `g t²/2`, and each particle.
///
/// f64: rounding only. f32: 240 transfers, each rounding the velocity by some 1e-7 cells per step to the grid's fixed
/// point, over a fall of 61 cells; on a lattice all nodes are rounded alike, so that it does not average out.
fn free_fall_is_a_parabola(backend: Backend) {
    let velocity = DVec3::new(1.5, 2.0, 0.0);
    let mut solver = backend.solver(&flight(velocity.to_array()));
    let start = particles(&mut *solver);
    let end = after(&mut *solver, 60);
    let t = solver.time();
    assert!((t - 0.5).abs() < 1e-12, "{t}");
    let fall = GRAVITY * (0.5 * t * t);
    let errors = start.iter().zip(&end).map(|(a, b)| b.position - (a.position + velocity * t + fall));
    let errors: Vec<_> = errors.collect();
    let centre = errors.iter().copied().sum::<DVec3>() / errors.len() as f64;
    assert!(centre.length() < backend.pick(1e-6, 1e-5) * fall.length(), "{centre} m");
    for (a, e) in end.iter().zip(&errors) {
        assert!((*e - centre).length() < backend.pick(1e-9, 5e-3) * DX, "{} cells of deformation", (*e - centre) / DX);
        // The reported velocity is the mean over the last step.
        let mean = velocity + GRAVITY * (t - 0.5 * solver.dt());
        assert!((a.velocity - mean).length() < backend.pick(1e-9, 1e-3), "{} {mean}", a.velocity);
    }
    assert_eq!(report(&mut *solver).faults, pbmpm::Faults::default());
}

/// A disordered body is pushed apart where it reads too dense, but its centre of mass falls like a stone.
fn free_fall_of_jittered_matter(backend: Backend) {
    let mut world = flight([1.5, 2.0, 0.0]);
    world.spawns[0].jitter = 0.25;
    let mut solver = backend.solver(&world);
    let start = DVec3::from_array(state(&mut *solver).centre_of_mass_m);
    solver.steps(60).unwrap();
    let end = DVec3::from_array(state(&mut *solver).centre_of_mass_m);
    let expected = start + DVec3::new(1.5, 2.0, 0.0) * 0.5 + GRAVITY * 0.125;
    let error = (end - expected).length() / (GRAVITY.length() * 0.125);
    assert!(error < backend.pick(1e-12, 1e-5), "{error}");
}

/// Under piecewise constant gravity the path is exactly a parabola in each piece, for any steps.
fn free_fall_under_changing_steps_and_gravity(backend: Backend) {
    let mut solver = backend.solver(&flight([0.5, 1.0, 0.2]));
    let start = particles(&mut *solver);
    let (mut position, mut velocity) = (DVec3::ZERO, DVec3::new(0.5, 1.0, 0.2));
    for (dt, gravity, steps) in [
        (1.0 / 120.0, GRAVITY, 7),
        (1.0 / 60.0, GRAVITY, 3),
        (1.0 / 480.0, GRAVITY, 10),
        (1.0 / 240.0, DVec3::new(3.0, -2.0, 1.0), 12),
        (1.0 / 90.0, DVec3::ZERO, 5),
        (1.0 / 120.0, GRAVITY, 1),
        (1.0 / 45.0, GRAVITY, 2),
    ] {
        solver.set_dt(dt).unwrap();
        solver.set_gravity(gravity).unwrap();
        assert_eq!((solver.dt(), solver.gravity()), (dt, gravity));
        solver.steps(steps).unwrap();
        let t = dt * f64::from(steps);
        position += velocity * t + gravity * (0.5 * t * t);
        velocity += gravity * t;
    }
    // f64: rounding only. f32: a transfer rounds by up to 5e-7 cells per step. Over the steps of 1/480 and 1/240 s that
    // is 3e-4 m/s at worst, which then lasts 0.15 s.
    let tolerance = backend.pick(1e-9, 1e-4);
    for (a, b) in start.iter().zip(particles(&mut *solver)) {
        let error = (b.position - a.position - position).length();
        assert!(error < tolerance, "{error} m");
    }
}

/// Changing the step length before the first step does not change velocities either.
fn step_changed_before_the_first(backend: Backend) {
    let mut solver = backend.solver(&flight([1.5, 2.0, 0.0]));
    let start = state(&mut *solver);
    solver.set_dt(1.0 / 60.0).unwrap();
    assert!((state(&mut *solver).kinetic_j / start.kinetic_j - 1.0).abs() < 1e-6, "velocities stay");
    solver.steps(6).unwrap();
    let moved = DVec3::from_array(state(&mut *solver).centre_of_mass_m) - DVec3::from_array(start.centre_of_mass_m);
    let expected = DVec3::new(1.5, 2.0, 0.0) * 0.1 + GRAVITY * 0.005;
    assert!((moved - expected).length() < 1e-4 * expected.length(), "{moved} {expected}");
}

/// Two blocks that collide in the middle while everything drifts, far from the sides.
fn meeting(drift: DVec3) -> World {
    let mut world = empty([80.0, 96.0, 96.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    let speed = DVec3::new(0.8, 0.1, 0.0);
    let spawn = |lo: [f64; 3], hi: [f64; 3], v: DVec3| Spawn { velocity: v + drift, ..block(lo, hi, [0.0; 3]) };
    world.spawns.push(spawn([18.0, 46.0, 46.0], [21.0, 50.0, 50.0], speed));
    world.spawns.push(spawn([22.0, 46.0, 46.0], [25.0, 50.0, 50.0], -speed));
    world
}

/// A collision seen from a frame that moves by a whole cell per step: relative to the grid nothing changes, so the
/// result is the same.
///
/// f64: rounding, amplified by 30 steps of collision. f32: positions up to 54 cells are rounded 30 times, 1e-4 cells.
fn whole_cell_drift_changes_nothing(backend: Backend) {
    let drift = DVec3::X * DX * 120.0;
    let still = after(&mut *backend.solver(&meeting(DVec3::ZERO)), 30);
    let moving = after(&mut *backend.solver(&meeting(drift)), 30);
    let moved = drift * (30.0 / 120.0);
    let worst = still.iter().zip(&moving).map(|(a, b)| (b.position - a.position - moved).length()).fold(0.0, larger);
    assert!(worst < backend.pick(1e-8, 1e-3) * DX, "{} cells", worst / DX);
    let met = still.iter().any(|p| (p.velocity.x.abs() - 0.8).abs() > 0.2);
    assert!(met, "nothing collided");
}

/// In any other frame the grid's position differs in each step: the same up to discretisation.
fn any_drift_changes_little(backend: Backend) {
    let drift = DVec3::new(0.37, 0.11, -0.23) * DX * 120.0;
    let mut still = backend.solver(&meeting(DVec3::ZERO));
    let mut moving = backend.solver(&meeting(drift));
    still.steps(30).unwrap();
    moving.steps(30).unwrap();
    let energy = |solver: &mut dyn Simulate, frame: DVec3| -> f64 {
        particles(solver).iter().map(|p| 0.5 * p.mass * (p.velocity - frame).length_squared()).sum()
    };
    let (a, b) = (energy(&mut *still, DVec3::ZERO), energy(&mut *moving, drift));
    assert!((a - b).abs() < 0.05 * a, "{a} {b} J");
}

/// Change of the mean velocity after this many steps, in cells per step. No side may be reached.
fn momentum_drift(backend: Backend, world: &World, steps: u32) -> f64 {
    let mut solver = backend.solver(world);
    let before = state(&mut *solver);
    let start = particles(&mut *solver);
    let end = after(&mut *solver, steps);
    let now = state(&mut *solver);
    assert_sound(&end);
    let inside = now.bounds_m[0].iter().all(|x| *x > 3.0 * DX);
    assert!(inside, "the sides were reached, which says nothing of momentum: {:?}", now.bounds_m);
    assert!(start.iter().zip(&end).all(|(a, b)| a.mass == b.mass && a.material == b.material));
    assert_eq!(now.mass_kg, before.mass_kg, "mass is exact");
    assert_eq!(report(&mut *solver).alive as usize, end.len());
    let drift = (DVec3::from_array(now.momentum) - DVec3::from_array(before.momentum)) / now.mass_kg;
    drift.length() * solver.dt() / DX
}

/// Two blocks that drift and collide at 0.05 cells per step, with neither gravity nor contact: at most 1e-5 cells per
/// step. f64: rounding only.
fn momentum_and_mass_are_kept(backend: Backend) {
    let mut world = meeting(DVec3::new(0.02, -0.01, 0.0));
    world.settings.iterations = 1;
    world.spawns.iter_mut().for_each(|spawn| spawn.velocity *= 0.15);
    let drift = momentum_drift(backend, &world, 200);
    assert!(drift < backend.pick(1e-12, 1e-5), "{drift} cells per step");
}

/// The same for different liquids, so that what fixed point removes equally from every particle does not cancel between
/// the two: light spray against heavy.
fn momentum_of_unequal_spray_is_kept(backend: Backend) {
    let mut world = meeting(DVec3::new(0.02, -0.01, 0.0));
    world.settings.iterations = 2;
    world.materials.push(Material { rest_density: 500.0, ..Material::liquid("oil") });
    world.spawns[1].material = "oil".to_owned();
    world.spawns[0].jitter = 0.2;
    world.spawns.iter_mut().for_each(|spawn| spawn.velocity *= 0.3);
    let drift = momentum_drift(backend, &world, 100);
    assert!(drift < backend.pick(1e-12, 1e-5), "{drift} cells per step");
}

/// 60 isolated particles at a tenth of a cell per step: nothing may slow them. 1e-5 of a cell per step is 1e-4.
fn lone_particles_keep_their_speed(backend: Backend) {
    let mut world = empty([80.0, 64.0, 40.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.settings.iterations = 2;
    for i in 0..60 {
        let f = f64::from(i);
        let spread = DVec3::new((f * 0.618).fract(), (f * 0.37).fract(), (f * 0.71).fract());
        let at = DVec3::new(20.0, 4.0 + 3.0 * f64::from(i % 20), 4.0 + 3.0 * f64::from(i / 20)) + spread;
        world.spawns.push(Spawn { velocity: DVec3::X * 0.1 * DX * 120.0, ..one(at * DX) });
    }
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, 100);
    assert_sound(&end);
    let mean = end.iter().map(|p| p.velocity.x).sum::<f64>() / 60.0 / (DX * 120.0);
    assert!((mean - 0.1).abs() < backend.pick(1e-12, 1e-5), "{} cells per step", mean - 0.1);
}

/// 10 cells per step where 4 are allowed: slowed to 4, and counted; below the bound nothing is counted.
fn fast_particles_are_slowed_and_counted(backend: Backend) {
    let mut world = empty([96.0, 16.0, 16.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    for (cells, clamped) in [(3.9, false), (10.0, true)] {
        world.spawns = vec![block([6.0, 6.0, 6.0], [8.0, 8.0, 8.0], [cells * DX * 120.0, 0.0, 0.0])];
        let mut solver = backend.solver(&world);
        let start = particles(&mut *solver);
        let end = after(&mut *solver, 3);
        let moved = (end[0].position - start[0].position).x / DX;
        let expected = 3.0 * if clamped { 4.0 } else { cells };
        assert!((moved - expected).abs() < 1e-4, "{moved} {expected}");
        let report = report(&mut *solver);
        assert_eq!(report.faults.speed_clamped > 0, clamped, "{:?}", report.faults);
        assert_eq!(report.faults.quarantined, 0);
    }
}

/// Matter that drifts out is deleted, counted and marked; the rest keeps its mass.
fn open_sides_delete_and_count(backend: Backend) {
    let mut world = empty([24.0, 16.0, 16.0], Wall::Slip);
    world.domain.walls.x_max = Wall::Open;
    world.gravity = DVec3::ZERO;
    world.spawns.push(block([16.0, 6.0, 6.0], [20.0, 10.0, 10.0], [2.4, 0.0, 0.0]));
    world.spawns.push(block([4.0, 6.0, 6.0], [8.0, 10.0, 10.0], [0.0, 0.0, 0.0]));
    let mut solver = backend.solver(&world);
    let total = state(&mut *solver).mass_kg;
    // One cell per step: the front leaves in the fourth step, the tail in the eighth.
    let seen = after(&mut *solver, 6);
    let out = seen.iter().filter(|p| p.fate == Fate::Escaped).count();
    assert!(out > 0 && out < 512, "{out}");
    let end = after(&mut *solver, 8);
    let report = report(&mut *solver);
    assert_eq!((report.faults.escaped, report.alive), (512, 512));
    assert!(end[..512].iter().all(|p| p.fate == Fate::Escaped), "those that left were made first");
    assert_sound(&end[512..]);
    let rest = state(&mut *solver).mass_kg / total;
    assert!((rest - 0.5).abs() < 1e-12, "{rest}");
    assert!(apart(&end[512..], &seen[512..]) < 1e-6, "the block at rest stays");
}

/// A viscous body loses shear; without viscosity it keeps the shear much longer.
fn viscosity_damps_and_zero_viscosity_does_not(backend: Backend) {
    let energy = |viscous_relaxation: f64| {
        let mut world = meeting(DVec3::ZERO);
        world.settings.iterations = 2;
        // Two layers that slide along each other.
        world.spawns[0] = block([20.0, 20.0, 20.0], [26.0, 23.0, 25.0], [0.3, 0.0, 0.0]);
        world.spawns[1] = block([20.0, 23.0, 20.0], [26.0, 26.0, 25.0], [-0.3, 0.0, 0.0]);
        world.materials[0].viscous_relaxation = viscous_relaxation;
        let mut solver = backend.solver(&world);
        let before = state(&mut *solver).kinetic_j;
        solver.steps(40).unwrap();
        state(&mut *solver).kinetic_j / before
    };
    let (thin, thick) = (energy(0.0), energy(0.8));
    assert!(thin > 0.6 && thick < 0.5 * thin, "{thin} {thick}");
}

/// Water beside oil of a tenth of its density: inside the block every particle measures one cell volume of matter per
/// cell, up to the 2 % that a lattice reads too much.
fn how_full_a_node_is_does_not_depend_on_density() {
    let mut world = empty([16.0, 12.0, 12.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.materials.push(Material { rest_density: 100.0, ..Material::liquid("oil") });
    world.spawns.push(block([2.0, 2.0, 2.0], [8.0, 10.0, 10.0], [0.0; 3]));
    let oil = block([8.0, 2.0, 2.0], [14.0, 10.0, 10.0], [0.0; 3]);
    world.spawns.push(Spawn { material: "oil".to_owned(), ..oil });
    let mut solver = CpuSolver::<f32>::new(&world).expect("the world is valid");
    let inside: Vec<bool> = particles(&mut solver)
        .iter()
        .map(|p| (p.position / DX - DVec3::new(8.0, 6.0, 6.0)).abs().cmple(DVec3::new(4.0, 2.0, 2.0)).all())
        .collect();
    solver.step().expect("a step");
    let layout = solver.gpu_layout();
    let fractions = inside.iter().zip(&layout.displacement).filter(|(inside, _)| **inside).map(|(_, u)| u[3]);
    let (mut count, mut worst) = (0, 0.0f32);
    for fraction in fractions {
        count += 1;
        worst = worst.max((fraction - 1.0).abs());
    }
    assert!(count > 500 && worst < 0.03, "{count} particles, off by up to {worst}");
}
