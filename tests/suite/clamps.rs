//! Solids held by clamps.

use crate::backends::{Backend, CPUS, Tests};
use crate::worlds::{DX, after, assert_sound, block, body, cuboid, empty, larger, particles};
use pbmpm::{Boundary, Collider, DVec3, Material, Particle, Scheme, Simulate, Wall, World};

pub fn add(tests: &mut Tests) {
    tests.each("clamps", CPUS, "a_clamp_holds_up_to_its_face", a_clamp_holds_up_to_its_face);
    tests.each(
        "clamps",
        &[Backend::Cpu],
        "thin_clamps_hold_no_more_than_is_there",
        thin_clamps_hold_no_more_than_is_there,
    );
    tests.each("clamps", &[Backend::Cpu], "a_clamp_that_turns_strains_nothing", a_clamp_that_turns_strains_nothing);
}

const YOUNG: f64 = 1e5;

fn room(scheme: Scheme) -> World {
    let mut world = empty([12.0, 24.0, 12.0], Wall::Slip);
    world.materials = vec![Material {
        name: "water".to_owned(),
        rest_density: 1000.0,
        youngs_modulus: YOUNG,
        poisson_ratio: 0.0,
        viscosity: 100.0,
        ..Material::elastic("")
    }];
    world.settings.scheme = scheme;
    world.settings.iterations = 16;
    world.settings.dt = 1.0 / 480.0;
    if scheme == Scheme::Explicit {
        world.settings.dt = world.stable_dt();
    }
    world
}

fn clamp(half: [f64; 3], at: [f64; 3]) -> Collider {
    Collider { boundary: Boundary::Fixed, ..body(cuboid(half), at) }
}

fn run(solver: &mut dyn Simulate, seconds: f64) -> Vec<Particle> {
    let steps = (seconds / solver.dt()).round() as u32;
    let end = after(solver, steps);
    assert_sound(&end);
    end
}

/// A bar of 12 cells hangs from a clamp whose face lies on nodes or anywhere between: it sags like a bar that begins at
/// the face, within the effect of half a particle's spacing.
fn a_clamp_holds_up_to_its_face(backend: Backend) {
    for scheme in [Scheme::Explicit, Scheme::Implicit] {
        for off in [0.0, 0.3, 0.5, 0.8] {
            let face = 18.0 + off;
            let mut world = room(scheme);
            world.spawns.push(block([4.0, 6.0, 4.0], [8.0, 20.0, 8.0], [0.0; 3]));
            world.colliders.push(clamp([3.0, 1.5, 3.0], [6.0, face + 1.5, 6.0]));
            let length = (face - 6.0) * DX;
            let mut solver = backend.solver(&world);
            let start = particles(&mut *solver);
            run(&mut *solver, 0.3);
            let hangs = |p: &Particle| p.position.y < face * DX;
            // It keeps swinging, ten times a second.
            let (mut sum, mut count) = (0.0, 0.0);
            for _ in 0..50 {
                let now = run(&mut *solver, 0.01);
                for (start, now) in start.iter().zip(&now).filter(|(start, _)| hangs(start)) {
                    sum += start.position.y - now.position.y;
                    count += 1.0;
                }
            }
            let load = 1000.0 * 9.81 * length / YOUNG;
            // The first two terms of the sag by logarithmic strain.
            let expected = length * (load / 3.0 + 3.0 / 8.0 * load * load);
            let sag = sum / count / expected;
            assert!((sag - 1.0).abs() < 0.06, "{sag} of its sag {off} above the nodes in {scheme:?}");
        }
    }
}

/// Plates and pins thinner than a cell, on nodes and between them, in a nearly incompressible block that is shaken: it
/// stays within the energy that it was given.
fn thin_clamps_hold_no_more_than_is_there(backend: Backend) {
    for scheme in [Scheme::Explicit, Scheme::Implicit] {
        for (half, at) in
            [([3.0, 0.1, 3.0], 12.0), ([3.0, 0.2, 3.0], 12.35), ([0.3, 3.0, 0.3], 12.6), ([3.0, 0.45, 3.0], 12.5)]
        {
            let mut world = room(scheme);
            world.gravity = DVec3::ZERO;
            world.materials[0].poisson_ratio = 0.48;
            world.materials[0].viscosity = 0.0;
            if scheme == Scheme::Explicit {
                world.settings.dt = world.stable_dt();
            }
            world.spawns.push(block([4.0, 8.0, 4.0], [8.0, 16.0, 8.0], [0.0, 0.5, 0.3]));
            world.colliders.push(clamp(half, [6.1, at, 6.2]));
            let mut solver = backend.solver(&world);
            let kinetic = |p: &[Particle]| p.iter().map(|p| 0.5 * p.mass * p.velocity.length_squared()).sum::<f64>();
            let start = kinetic(&particles(&mut *solver));
            for _ in 0..10 {
                let end = run(&mut *solver, 0.05);
                let now = kinetic(&end) / start;
                assert!(now < 1.0, "{half:?} at {at} in {scheme:?}: {now} of the energy");
                let denser = end.iter().map(|p| (p.volume_ratio - 1.0).abs()).fold(0.0, larger);
                assert!(denser < 0.5, "{half:?} at {at} in {scheme:?}: volumes off by {denser}");
            }
        }
    }
}

/// A block turns with the clamp that holds its middle, a third of a turn, and keeps its shape.
fn a_clamp_that_turns_strains_nothing(backend: Backend) {
    for scheme in [Scheme::Explicit, Scheme::Implicit] {
        let mut world = room(scheme);
        world.gravity = DVec3::ZERO;
        world.spawns.push(block([4.0, 8.0, 4.0], [8.0, 16.0, 8.0], [0.0; 3]));
        let mut middle = clamp([3.0, 1.3, 3.0], [6.0, 12.0, 6.0]);
        middle.angular_velocity = DVec3::Y * 4.0;
        world.colliders.push(middle);
        let mut solver = backend.solver(&world);
        let end = run(&mut *solver, 0.5);
        let tallest = end.iter().map(|p| (p.position.y / DX - 12.0).abs()).fold(0.0, larger);
        let widest = end.iter().map(|p| (p.position - DVec3::new(6.0, 0.0, 6.0) * DX).with_y(0.0).length() / DX);
        let widest = widest.fold(0.0, larger);
        let denser = end.iter().map(|p| (p.volume_ratio - 1.0).abs()).fold(0.0, larger);
        assert!((tallest - 3.75).abs() < 0.1 && (widest - 1.75 * 2f64.sqrt()).abs() < 0.1, "{tallest} {widest}");
        assert!(denser < 0.05, "{denser}");
    }
}
