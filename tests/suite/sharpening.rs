//! Restoring what transfers smooth away.

use crate::backends::{Backend, CPUS, Tests};
use crate::suite::cases::CASES;
use crate::suite::measure::{angular_momentum, mean_vector};
use crate::suite::setup::{self, Preset, Scheme, Setup};
use crate::worlds::{DX, after, assert_sound, block, empty, particles};
use pbmpm::{DVec3, Material, Spawn, Wall};

pub fn add(tests: &mut Tests) {
    tests.each("sharpening", &[Backend::Cpu], "eddies_go_on", eddies_go_on);
    tests.each("sharpening", CPUS, "momentum_is_kept_between_materials", momentum_is_kept_between_materials);
}

/// Vortices of 16 cells: less than half of the numerical viscosity remains.
fn eddies_go_on(_: Backend) {
    let vortex = CASES.iter().find(|c| c.name == "a7-vortex").unwrap();
    for scheme in [Scheme::Implicit, Scheme::Explicit] {
        let [plain, sharpened] = [false, true].map(|sharpen| {
            let setup = Setup { sharpen: Some(sharpen), ..Setup::new(scheme, Preset::Realtime, setup::Backend::Cpu) };
            (vortex.body)(&setup).unwrap().metrics[0].measured
        });
        assert!(sharpened > 0.0 && sharpened < 0.5 * plain, "{scheme:?}: {sharpened}, {plain} without");
    }
}

/// A block of rubber and one of liquid that collide off-centre in free flight share nodes: what is restored to one is
/// not taken from the other.
fn momentum_is_kept_between_materials(backend: Backend) {
    for scheme in [pbmpm::Scheme::Implicit, pbmpm::Scheme::Explicit] {
        let mut world = empty([40.0, 24.0, 24.0], Wall::Slip);
        world.gravity = DVec3::ZERO;
        let rubber = Material { youngs_modulus: 1e5, rest_density: 1500.0, ..Material::elastic("rubber") };
        world.materials.push(rubber);
        let of = |material: &str, at: Spawn| Spawn { material: material.to_owned(), jitter: 0.2, ..at };
        world.spawns.push(of("water", block([13.0, 8.0, 8.0], [19.0, 14.0, 14.0], [0.4, 0.1, 0.0])));
        world.spawns.push(of("rubber", block([21.0, 10.0, 9.0], [27.0, 16.0, 15.0], [-0.4, 0.0, -0.1])));
        world.settings.scheme = scheme;
        world.settings.sharpen = true;
        world.settings.dt = if scheme == pbmpm::Scheme::Implicit { 1.0 / 300.0 } else { world.stable_dt() };
        let mut solver = backend.solver(&world);
        let here = particles(&mut *solver);
        let steps = (0.15 / world.settings.dt) as u32;
        let there = after(&mut *solver, steps);
        assert_sound(&there);
        let [v, w] = [&here, &there].map(|all| mean_vector(all, |p| p.velocity));
        let [l, m] = [&here, &there].map(|all| angular_momentum(all, DX));
        let mass: f64 = there.iter().map(|p| p.mass).sum();
        // Relative to the speed at which they meet, and to the angular momentum of that speed half a block from the
        // middle.
        assert!(v.distance(w) < 1e-5 * 0.8, "{scheme:?}: {v} has become {w}");
        assert!(l.distance(m) < 1e-4 * mass * 0.8 * 3.0 * DX, "{scheme:?}: {l} has become {m}");
    }
}
