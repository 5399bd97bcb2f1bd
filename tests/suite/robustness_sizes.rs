//! Worlds of every size: empty, one particle, the limits of groups, cells and blocks, and a very large domain.

use crate::backends::{ALL, Backend, MOST, Tests};
use crate::worlds::{DX, after, assert_sound, block, empty, larger, one, particles, report, row, state};
use pbmpm::{DVec3, Wall, World};

pub fn add(tests: &mut Tests) {
    for (name, body) in [
        ("no_particles", no_particles as fn(Backend)),
        ("particles_1", |b| some_particles(b, 1)),
        ("particles_63", |b| some_particles(b, 63)),
        ("particles_64", |b| some_particles(b, 64)),
        ("particles_65", |b| some_particles(b, 65)),
        ("particles_257", |b| some_particles(b, 257)),
    ] {
        tests.each("robustness_sizes", if name == "no_particles" { ALL } else { MOST }, name, body);
    }
    tests.each("robustness_sizes", MOST, "particles_on_every_boundary", particles_on_every_boundary);
    tests.each("robustness_sizes", MOST, "a_domain_of_one_cell", a_domain_of_one_cell);
    tests.each("robustness_sizes", MOST, "a_domain_of_one_block", a_domain_of_one_block);
    tests.each("robustness_sizes", MOST, "a_drop_in_the_largest_domain", a_drop_in_the_largest_domain);
    tests.each(
        "robustness_sizes",
        MOST,
        "a_block_of_more_particles_than_a_chunk",
        a_block_of_more_particles_than_a_chunk,
    );
}

/// An empty world can be stepped, and time passes. A world without even a material is empty, too.
fn no_particles(backend: Backend) {
    let mut world = empty([8.0, 8.0, 8.0], Wall::Slip);
    for materials in [1, 0] {
        world.materials.truncate(materials);
        let mut solver = backend.solver(&world);
        let end = after(&mut *solver, 5);
        assert!(end.is_empty());
        let report = report(&mut *solver);
        assert_eq!((report.step, report.alive, report.active_blocks), (5, 0, 0));
        assert_eq!(state(&mut *solver), pbmpm::State::default());
        assert!((solver.time() - 5.0 / 120.0).abs() < 1e-12);
    }
}

/// A row of particles falls freely: each of them, in any group of 64 and any chunk of 256.
fn some_particles(backend: Backend, count: u32) {
    let mut world = empty([160.0, 24.0, 8.0], Wall::Slip);
    world.spawns.push(row([6.1, 16.3, 3.7], count));
    let mut solver = backend.solver(&world);
    let start = particles(&mut *solver);
    assert_eq!(start.len(), count as usize);
    let end = after(&mut *solver, 12);
    assert_sound(&end);
    for (a, b) in start.iter().zip(&end) {
        let moved = b.position - a.position;
        assert!((moved + DVec3::Y * 0.5 * 9.81 * 0.01).length() < 1e-3 * DX, "{moved}");
    }
    // They land.
    let end = after(&mut *solver, 30);
    assert_sound(&end);
    assert!(end.iter().all(|p| p.position.y < 3.0 * DX), "on the floor");
    assert_eq!(report(&mut *solver).alive, count);
}

/// Particles exactly on nodes, middles of cells and block edges, and on the sides, edges and corners of the domain.
/// None moves without a force, except those on a side, which are kept a thousandth of a cell away from it.
fn particles_on_every_boundary(backend: Backend) {
    let mut world = empty([8.0, 8.0, 8.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    let axis = [0.0, 0.5, 1.5, 4.0, 4.5, 8.0];
    for x in axis {
        for y in axis {
            for z in axis {
                world.spawns.push(one((DVec3::new(x, y, z) * DX).min(world.domain.max)));
            }
        }
    }
    let mut solver = backend.solver(&world);
    let start = particles(&mut *solver);
    assert_eq!(start.len(), 216);
    let end = after(&mut *solver, 3);
    assert_sound(&end);
    for (a, b) in start.iter().zip(&end) {
        let moved = (b.position - a.position).abs().max_element() / DX;
        // Sides keep a gap of a thousandth; the eight in a corner are more than fit there, and begin to separate.
        assert!(moved < 1.5e-3, "{moved} cells from {}", a.position / DX);
    }
    // With a force in each direction they stay inside.
    for gravity in [DVec3::splat(9.81), DVec3::splat(-9.81), DVec3::new(30.0, -30.0, 0.0)] {
        solver.set_gravity(gravity).unwrap();
        let now = after(&mut *solver, 10);
        assert_sound(&now);
        let (lo, hi) = (world.domain.min, world.domain.max);
        assert!(now.iter().all(|p| p.position.clamp(lo, hi) == p.position), "inside under {gravity}");
    }
}

fn closed(cells: f64) -> World {
    let mut world = empty([cells; 3], Wall::Slip);
    world.spawns.push(block([0.25 * cells; 3], [0.75 * cells; 3], [0.4, -0.2, 0.1]));
    world
}

fn stays_inside(backend: Backend, cells: f64) {
    let world = closed(cells);
    let mut solver = backend.solver(&world);
    let count = particles(&mut *solver).len();
    assert!(count > 0);
    let end = after(&mut *solver, 40);
    assert_sound(&end);
    assert_eq!(end.len(), count);
    let (lo, hi) = (world.domain.min, world.domain.max);
    assert!(end.iter().all(|p| p.position.clamp(lo, hi) == p.position));
    assert!(report(&mut *solver).active_blocks <= 27);
}

fn a_domain_of_one_cell(backend: Backend) {
    stays_inside(backend, 1.0);
}

fn a_domain_of_one_block(backend: Backend) {
    stays_inside(backend, 4.0);
}

/// 4080 cells along each axis, with a drop in the far corner: the cost is that of the drop, and it falls as in a small
/// domain.
///
/// f32: a position of 4080 cells is rounded to 2.4e-4 cells in each of 12 steps.
fn a_drop_in_the_largest_domain(backend: Backend) {
    let small = {
        let mut world = empty([40.0, 40.0, 40.0], Wall::Slip);
        world.spawns.push(block([32.0, 32.0, 32.0], [36.0, 36.0, 36.0], [0.3, 0.0, -0.2]));
        world
    };
    let mut large = small.clone();
    let shift = DVec3::splat(4040.0 * DX);
    large.domain.max = DVec3::splat(4080.0 * DX);
    large.spawns[0].position += shift;
    let (mut here, mut there) = (backend.solver(&small), backend.solver(&large));
    let (a, b) = (after(&mut *here, 12), after(&mut *there, 12));
    assert_sound(&b);
    let worst = a.iter().zip(&b).map(|(a, b)| (b.position - shift - a.position).length()).fold(0.0, larger);
    assert!(worst < backend.pick(1e-8, 1e-2) * DX, "{} cells", worst / DX);
    let (few, same) = (report(&mut *here), report(&mut *there));
    assert!(same.active_blocks <= 64, "{same:?}");
    assert!(same.active_blocks <= few.active_blocks + 37, "{same:?} {few:?}");
    let bytes = there.memory().total();
    assert!(bytes < 4 << 20, "{bytes} bytes");
    // It also falls into its corner, onto the sides.
    large.gravity = DVec3::new(20.0, 20.0, 20.0);
    let mut solver = backend.solver(&large);
    let end = after(&mut *solver, 30);
    assert_sound(&end);
    let hi = large.domain.max;
    assert!(end.iter().all(|p| p.position.min(hi) == p.position));
}

/// 27 particles in a cell make blocks of 1728: seven chunks.
fn a_block_of_more_particles_than_a_chunk(backend: Backend) {
    let mut world = empty([8.0, 16.0, 8.0], Wall::Slip);
    world.settings.iterations = 1;
    let fill = pbmpm::Fill::PerCell(27.0);
    world.spawns.push(pbmpm::Spawn { fill, ..block([2.0, 6.0, 2.0], [6.0, 10.0, 6.0], [0.0; 3]) });
    let mut solver = backend.solver(&world);
    let start = particles(&mut *solver);
    assert_eq!(start.len(), 1728);
    let end = after(&mut *solver, 12);
    assert_sound(&end);
    let worst = start.iter().zip(&end).map(|(a, b)| (b.position - a.position + DVec3::Y * 0.049_05).length());
    let worst = worst.fold(0.0, larger) / DX;
    assert!(worst < backend.pick(1e-9, 5e-3), "{worst} cells off a free fall");
}
