//! Whole scenes on a device against the CPU path in f32.

use crate::alike::{assert_loads, assert_states, assert_states_on, rounds_by_itself};
use crate::backends::{Backend, DEVICES, NATIVE, Tests};
use crate::worlds::{
    DX, after, apart, assert_sound, basin, block, busy, empty, flowing, mixed, particles, report, state,
};
use pbmpm::{DVec3, Fill, Material, Simulate, Spawn, Wall, World};

pub fn add(tests: &mut Tests) {
    tests.each("scene_parity", DEVICES, "before_and_after_contact", before_and_after_contact);
    tests.each("scene_parity", NATIVE, "nine_materials", nine_materials);
    tests.each("scene_parity", DEVICES, "implicit_liquids", implicit_liquids);
    tests.each("scene_parity", NATIVE, "four_models", four_models);
    tests.each("scene_parity", NATIVE, "a_crowd_of_bodies", a_crowd_of_bodies);
    tests.each("scene_parity", NATIVE, "step_lengths_and_bodies_that_change", step_lengths_and_bodies_that_change);
    tests.each(
        "scene_parity",
        &[Backend::Lavapipe, Backend::Gpu],
        "every_scene_begins_alike",
        every_scene_begins_alike,
    );
    // lavapipe's buffers hold at most 2.8 million particles.
    tests.each(
        "scene_parity",
        &[Backend::Swiftshader, Backend::Gpu],
        "more_particles_than_invocations",
        more_particles_than_invocations,
    );
    tests.each("scene_parity", NATIVE, "thesis_basin_70_steps", thesis_basin_70_steps);
    tests.each("scene_parity", NATIVE, "thesis_basin_200_steps", thesis_basin_200_steps);
}

fn pair(backend: Backend, world: &World) -> (Box<dyn Simulate>, Box<dyn Simulate>) {
    (Backend::Cpu.solver(world), backend.solver(world))
}

fn assert_like(a: &mut dyn Simulate, b: &mut dyn Simulate, metres: f64, share: f64) {
    let (x, y) = (state(a), state(b));
    let centre = DVec3::from_array(x.centre_of_mass_m).distance(DVec3::from_array(y.centre_of_mass_m));
    let energy = (y.kinetic_j / x.kinetic_j - 1.0).abs();
    assert!(centre < metres, "centres of mass {centre} m apart");
    assert!(energy < share, "kinetic energies {} and {} J", x.kinetic_j, y.kinetic_j);
    assert_eq!(x.mass_kg, y.mass_kg, "mass");
}

/// 10 steps of flight, particle by particle; then into floor, ball and turning box, where roundings are amplified.
///
/// Before contact: the same formulas in f32, some of which a compiler may fuse or reorder; 1e-5 m is 5e-4 cells. After:
/// the amplification by contact is chaotic for single particles, but not for sums.
fn before_and_after_contact(backend: Backend) {
    let (mut cpu, mut gpu) = pair(backend, &busy());
    assert_eq!(apart(&particles(&mut *cpu), &particles(&mut *gpu)), 0.0, "the same particles at the start");
    let (a, b) = (after(&mut *cpu, 8), after(&mut *gpu, 8));
    let worst = apart(&a, &b);
    assert!(worst < 1e-5, "{worst} m");
    let (a, b) = (after(&mut *cpu, 32), after(&mut *gpu, 32));
    assert_sound(&b);
    let touched = a.iter().filter(|p| p.position.y < 1.0 * DX).count();
    assert!(touched > 20, "only {touched} particles have come to the floor");
    assert_like(&mut *cpu, &mut *gpu, 2e-4, 0.02);
    assert!(a.iter().zip(&b).all(|(a, b)| a.mass == b.mass && a.material == b.material));
    let (a, b) = (report(&mut *cpu), report(&mut *gpu));
    assert_eq!((a.step, a.time, a.alive), (b.step, b.time, b.alive));
    assert_eq!(cpu.poses(), gpu.poses());
}

/// A dispatch has 65,535 workgroups of 64 along an axis, 4.19 million invocations: the 4.3 million particles here need
/// several rounds. The last ones, which have a material of their own, must move like the first ones.
fn more_particles_than_invocations(backend: Backend) {
    let mut world = empty([96.0, 100.0, 64.0], Wall::Slip);
    world.materials.push(Material::liquid("last"));
    let dense = |spawn| Spawn { fill: Fill::PerCell(9.5), ..spawn };
    world.spawns.push(dense(block([4.0, 4.0, 4.0], [92.0, 94.0, 60.0], [0.3, 0.0, 0.1])));
    let last = block([4.0, 94.0, 4.0], [92.0, 96.0, 60.0], [0.0, 0.4, 0.0]);
    world.spawns.push(dense(Spawn { material: "last".into(), ..last }));
    let (mut cpu, mut gpu) = pair(backend, &world);
    let (a, b) = (after(&mut *cpu, 3), after(&mut *gpu, 3));
    assert!(a.len() > 4_194_240 && a.last().is_some_and(|p| p.material == 1), "{} particles", a.len());
    assert_eq!(report(&mut *gpu).alive as usize, a.len());
    let worst = apart(&a, &b);
    assert!(worst < 1e-5, "{worst} m");
}

fn implicit_liquids(backend: Backend) {
    let (mut cpu, mut gpu) = pair(backend, &flowing());
    let (a, b) = (after(&mut *cpu, 24), after(&mut *gpu, 24));
    assert_sound(&b);
    let (here, there) = (report(&mut *cpu), report(&mut *gpu));
    let solved = here.solved.expect("a solve");
    assert!(solved.iterations > 1 && solved.change > 0.0, "{solved:?}");
    assert_eq!((here.step, here.alive), (there.step, there.alive));
    assert_states(backend, &a, &b, "a search");
    if !rounds_by_itself(backend) {
        assert_eq!(here.solved, there.solved);
    }
    let (here, there) = (cpu.loads().unwrap(), gpu.loads().unwrap());
    assert_loads(backend, &here, &there, 2);
    let touched = |body| there.of(body).is_some_and(|load| load.impulse.length() > 0.0);
    assert!(touched(0) && touched(1), "nothing has touched the bodies");
}

/// Liquid, rubber, sand and clay: 8 steps of flight, particle by particle, then into the floor and each other.
fn four_models(backend: Backend) {
    let (mut cpu, mut gpu) = pair(backend, &mixed());
    let worst = apart(&after(&mut *cpu, 8), &after(&mut *gpu, 8));
    assert!(worst < 1e-5, "{worst} m");
    assert_sound(&after(&mut *cpu, 52));
    assert_sound(&after(&mut *gpu, 52));
    assert_like(&mut *cpu, &mut *gpu, 2e-4, 0.02);
}

/// More materials than fit into one vector, each with its own density and stiffness.
fn nine_materials(backend: Backend) {
    let mut world = empty([20.0, 10.0, 6.0], Wall::Slip);
    world.settings.iterations = 2;
    world.materials.clear();
    for i in 0..9 {
        let name = format!("m{i}");
        let (i, lo) = (f64::from(i), 1.0 + 2.0 * f64::from(i));
        world.materials.push(Material {
            rest_density: 300.0 + 150.0 * i,
            relaxation: 0.2 * i,
            viscous_relaxation: 0.1 * i,
            ..Material::liquid(&name)
        });
        let block = block([lo, 0.0, 1.0], [lo + 2.0, 3.0, 5.0], [0.1 * i, 0.0, 0.0]);
        world.spawns.push(Spawn { material: name, ..block });
    }
    let (mut cpu, mut gpu) = pair(backend, &world);
    let (a, b) = (after(&mut *cpu, 5), after(&mut *gpu, 5));
    assert!(a.iter().zip(&b).all(|(a, b)| a.mass == b.mass && a.material == b.material));
    let masses: std::collections::BTreeSet<u64> = b.iter().map(|p| p.mass.to_bits()).collect();
    assert_eq!(masses.len(), 9);
    // In contact with the floor from the start, but only for five steps.
    let worst = apart(&a, &b);
    assert!(worst < 1e-5, "{worst} m");
    assert_like(&mut *cpu, &mut *gpu, 1e-5, 1e-3);
}

/// More bodies in reach of one block than some devices could visit for the particles of several chunks (see
/// `Tuning::share`).
fn a_crowd_of_bodies(backend: Backend) {
    let mut world = empty([12.0; 3], Wall::Slip);
    world.spawns.push(block([1.0; 3], [11.0, 9.0, 11.0], [0.0; 3]));
    for i in 0..200 {
        let turn = f64::from(i);
        let at = DVec3::splat(6.0) + DVec3::new((0.7 * turn).sin(), (1.3 * turn).sin(), (0.37 * turn).sin());
        world.colliders.push(pbmpm::Collider::new(pbmpm::Shape::Sphere { radius: 0.3 * DX }, at * DX));
    }
    let (mut cpu, mut gpu) = pair(backend, &world);
    let worst = apart(&after(&mut *cpu, 2), &after(&mut *gpu, 2)) / DX;
    assert!(worst < 1e-5, "{worst} cells");
}

/// Changes by a host between steps affect both paths alike.
fn step_lengths_and_bodies_that_change(backend: Backend) {
    let (mut cpu, mut gpu) = pair(backend, &busy());
    for solver in [&mut cpu, &mut gpu] {
        solver.steps(3).unwrap();
        solver.set_dt(1.0 / 90.0).unwrap();
        solver.set_gravity(DVec3::new(2.0, -6.0, 1.0)).unwrap();
        solver.steps(4).unwrap();
        let pose = pbmpm::Pose { position: DVec3::new(5.0, 6.0, 5.0) * DX, ..solver.poses()[0] };
        solver.set_collider(0, Some(pose), DVec3::new(0.0, 0.3, 0.0), DVec3::new(3.0, 0.0, 0.0)).unwrap();
        solver.set_dt(1.0 / 150.0).unwrap();
        solver.steps(4).unwrap();
    }
    assert_eq!((cpu.time(), cpu.poses()), (gpu.time(), gpu.poses()));
    let (a, b) = (particles(&mut *cpu), particles(&mut *gpu));
    assert_sound(&b);
    let worst = apart(&a, &b);
    // A few steps of contact amplify rounding errors slightly.
    assert!(worst < 1e-4, "{worst} m");
}

/// Every scene that the crate ships, particle by particle for some steps; those with much matter for fewer.
fn every_scene_begins_alike(backend: Backend) {
    for file in crate::scene_files::scene_files() {
        let world = pbmpm::scene::from_file(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let (mut cpu, mut gpu) = pair(backend, &world);
        let steps = if report(&mut *cpu).alive < 10_000 { 24 } else { 3 };
        let (a, b) = (after(&mut *cpu, steps), after(&mut *gpu, steps));
        let cell = world.domain.cell_size;
        if rounds_by_itself(backend) {
            assert_states_on(cell, backend, &a, &b, &file.display().to_string());
            continue;
        }
        let worst = apart(&a, &b) / cell;
        assert!(worst < 1e-3, "{}: {worst} cells", file.display());
        assert!(a.iter().zip(&b).all(|(a, b)| a.fate == b.fate), "{}", file.display());
    }
}

/// The thesis' scene in full: each particle for 70 steps, mostly of flight. Walls and rotor then amplify rounding
/// errors. If rounding depends on the driver, single particles are compared for the flight only, and their sums at the
/// end, during the impact.
fn thesis_basin_70_steps(backend: Backend) {
    let (mut cpu, mut gpu) = pair(backend, &basin());
    if rounds_by_itself(backend) {
        let worst = apart(&after(&mut *cpu, 30), &after(&mut *gpu, 30));
        assert!(worst < 1e-4, "{worst} m");
        let (a, b) = (after(&mut *cpu, 40), after(&mut *gpu, 40));
        assert_states_on(basin().domain.cell_size, backend, &a, &b, "at the impact");
        assert_like(&mut *cpu, &mut *gpu, 5e-3, 0.01);
        return;
    }
    let worst = apart(&after(&mut *cpu, 70), &after(&mut *gpu, 70));
    assert!(worst < 1e-4, "{worst} m");
}

/// The sums during the impact.
fn thesis_basin_200_steps(backend: Backend) {
    let (mut cpu, mut gpu) = pair(backend, &basin());
    cpu.steps(200).unwrap();
    assert_sound(&after(&mut *gpu, 200));
    assert_like(&mut *cpu, &mut *gpu, 5e-3, 0.01);
}
