//! Each stage on a device beside its twin on the CPU, from the same developed state: stirred, splashed, with random
//! volume ratios and gradients that no formula would give.

use crate::alike::assert_pass;
use crate::backends::{Backend, NATIVE, SOFTWARE, Tests};
use crate::worlds::{
    basin, block, body, busy, clamped, cylinder, dozing, empty, flowing, mixed, mixed_explicit, mixed_implicit,
    mixed_thick, repeated, thick,
};
use pbmpm::lockstep::{Difference, compare_step};
use pbmpm::{Boundary, Collider, Scheme, Tuning, Wall, Walls, World};

pub fn add(tests: &mut Tests) {
    tests.each("stage_parity", NATIVE, "every_pass_of_a_busy_step", every_pass_of_a_busy_step);
    tests.each("stage_parity", NATIVE, "every_pass_of_a_basin_step", every_pass_of_a_basin_step);
    tests.each("stage_parity", NATIVE, "every_pass_without_colliders", every_pass_without_colliders);
    tests.each("stage_parity", NATIVE, "every_pass_of_a_mixed_step", every_pass_of_a_mixed_step);
    tests.each("stage_parity", NATIVE, "every_pass_of_an_explicit_step", every_pass_of_an_explicit_step);
    tests.each("stage_parity", SOFTWARE, "every_pass_of_an_implicit_step", every_pass_of_an_implicit_step);
    tests.each("stage_parity", SOFTWARE, "every_pass_with_block_pressures", every_pass_with_block_pressures);
    tests.each("stage_parity", SOFTWARE, "every_pass_of_a_dozing_step", every_pass_of_a_dozing_step);
    tests.each("stage_parity", SOFTWARE, "every_pass_of_a_repeated_step", every_pass_of_a_repeated_step);
}

/// The same bits, or differences that are [`allowed`](crate::alike::allowed) where a device rounds differently.
fn check(differences: &[Difference], backend: Backend) {
    assert!(differences.iter().any(|d| d.stage.name() == "integrate" && d.compared > 0), "the step ran to its end");
    differences.iter().for_each(|d| assert_pass(d, backend));
}

/// A step with the tuning for this adapter, and with that for a graphics processor.
fn compared(world: &World, steps: u32, backend: Backend) -> impl Iterator<Item = Vec<Difference>> {
    [None, Some(Tuning::GPU)]
        .into_iter()
        .map(move |tuning| compare_step(world, steps, &backend.choice(), tuning).unwrap_or_else(|e| panic!("{e}")))
}

fn compare(world: &World, steps: u32, backend: Backend) {
    compared(world, steps, backend).for_each(|differences| check(&differences, backend));
}

fn equal(differences: &[Difference], world: &World, steps: u32) {
    for d in differences {
        let place = format!("{} after {} of step {steps} of {}", d.what, d.stage.name(), world.name);
        assert_eq!(d.unequal, 0, "{place}: of {} by up to {:e}", d.compared, d.largest);
    }
}

fn every_pass_of_a_busy_step(backend: Backend) {
    compare(&busy(), 0, backend);
    compare(&busy(), 40, backend);
}

fn every_pass_of_a_basin_step(backend: Backend) {
    compare(&basin(), 100, backend);
}

fn every_pass_of_a_mixed_step(backend: Backend) {
    for steps in [0, 10, 60] {
        compare(&mixed(), steps, backend);
    }
}

fn every_pass_of_an_explicit_step(backend: Backend) {
    for steps in [0, 20, 150] {
        compare(&mixed_explicit(), steps, backend);
        compare(&clamped(mixed_explicit()), steps, backend);
        let mut sticky = mixed_explicit();
        sticky.settings.sharpen = true;
        sticky.materials.iter_mut().for_each(|m| m.viscosity = 2.0);
        sticky.colliders.iter_mut().for_each(|c| c.boundary = Boundary::Stick);
        compare(&sticky, steps, backend);
        // Without the materials that make nodes record their distance from bodies.
        let loose = |name: &str| ["water", "sand"].contains(&name);
        sticky.spawns.retain(|s| loose(&s.material));
        sticky.materials.retain(|m| loose(&m.name));
        sticky.colliders.iter_mut().for_each(|c| c.measure = true);
        compare(&sticky, steps, backend);
    }
}

/// The same bits after every pass where the liquids of a block share a pressure: in a deep pool, thrown about, beside
/// solids and walls that it sticks to, partly asleep.
fn every_pass_with_block_pressures(backend: Backend) {
    let mut pool = empty([12.0, 16.0, 9.0], Wall::Slip);
    pool.settings.scheme = Scheme::Implicit;
    pool.spawns.push(block([0.0, 0.0, 0.0], [12.0, 14.0, 9.0], [0.0; 3]));
    let mut sticky = pool.clone();
    sticky.name = "sticky".to_owned();
    sticky.materials[0].viscosity = 1.0;
    sticky.materials.push(pbmpm::Material { youngs_modulus: 2e4, ..pbmpm::Material::elastic("rubber") });
    sticky.spawns[0] = block([0.0, 0.0, 0.0], [12.0, 8.0, 9.0], [0.0; 3]);
    let rubber = block([3.0, 8.0, 2.0], [8.0, 13.0, 7.0], [0.0; 3]);
    sticky.spawns.push(pbmpm::Spawn { material: "rubber".to_owned(), ..rubber });
    sticky.domain.walls = Walls::all(Wall::Stick);
    let asleep = dozing(Scheme::Implicit);
    // Oil beneath water, and beside it.
    let mut oily = pool.clone();
    oily.name = "oily".to_owned();
    oily.materials.push(pbmpm::Material { rest_density: 800.0, ..pbmpm::Material::liquid("oil") });
    oily.spawns = vec![
        block([0.0, 0.0, 0.0], [12.0, 3.0, 9.0], [0.0; 3]),
        block([0.0, 7.0, 0.0], [7.0, 14.0, 9.0], [0.0; 3]),
        block([0.0, 3.0, 0.0], [12.0, 7.0, 9.0], [0.0; 3]),
        block([7.0, 7.0, 0.0], [12.0, 14.0, 9.0], [0.0; 3]),
    ];
    oily.spawns[..2].iter_mut().for_each(|spawn| spawn.material = "oil".to_owned());
    let worlds = [(&pool, 30), (&oily, 30), (&sticky, 30), (&flowing(), 24), (&mixed_implicit(), 40), (&asleep, 16)];
    for (world, steps) in worlds {
        let mut world = world.clone();
        world.settings.block_pressure = true;
        for differences in compared(&world, steps, backend) {
            assert!(differences.iter().any(|d| d.what == "pressures of blocks" && d.compared > 0), "{}", world.name);
            equal(&differences, &world, steps);
        }
    }
}

/// The same bits after every pass: conjugate gradients amplify differences, so that no tolerance would be meaningful.
fn every_pass_of_an_implicit_step(backend: Backend) {
    let mut dam = empty([16.0, 10.0, 5.0], Wall::Slip);
    dam.settings.scheme = Scheme::Implicit;
    dam.settings.iterations = 5;
    dam.settings.sharpen = true;
    dam.spawns.push(block([0.0, 0.0, 0.0], [5.0, 8.0, 5.0], [0.0; 3]));
    // In a jar and on a ball that it sticks to, so viscous that the search begins with its pressure as well.
    let mut jar = thick();
    jar.materials[0].viscosity = 600.0;
    let round = body(cylinder(6.0, 6.0), [7.0, 7.0, 7.0]);
    jar.colliders.push(Collider { inverted: true, boundary: Boundary::Stick, ..round });
    jar.colliders[1].boundary = Boundary::Stick;
    // With that ball turning, with and without viscosity that is solved for; and beside solids.
    jar.colliders[1].angular_velocity = pbmpm::DVec3::new(3.0, 5.0, -4.0);
    let mut runny = jar.clone();
    runny.materials[0].viscosity = 2.0;
    let mut sticky_mix = mixed_thick();
    sticky_mix.settings.sharpen = true;
    sticky_mix.colliders.iter_mut().for_each(|c| c.boundary = Boundary::Stick);
    let mut flight = dam.clone();
    flight.domain.walls = Walls::all(Wall::Open);
    flight.settings.tolerance = 0.05;
    for (world, steps) in [
        (&dam, 0),
        (&dam, 20),
        (&flowing(), 1),
        (&flowing(), 24),
        (&flight, 2),
        (&mixed_implicit(), 0),
        (&mixed_implicit(), 40),
        (&clamped(mixed_implicit()), 1),
        (&clamped(mixed_implicit()), 40),
        (&thick(), 24),
        (&jar, 20),
        (&runny, 20),
        (&sticky_mix, 40),
        (&mixed_thick(), 40),
    ] {
        for differences in compared(world, steps, backend) {
            for name in ["press", "predict", "line", "seek", "project", "settle", "integrate"] {
                assert!(differences.iter().any(|d| d.stage.name() == name && d.compared > 0), "{name} did not run");
            }
            equal(&differences, world, steps);
        }
    }
}

/// The same bits, where some matter sleeps, some is beside it and some is awake.
fn every_pass_of_a_dozing_step(backend: Backend) {
    for scheme in [Scheme::Published, Scheme::Implicit, Scheme::Explicit] {
        let mut two = dozing(scheme);
        two.settings.sharpen = true;
        two.materials.push(pbmpm::Material { rest_density: 800.0, ..pbmpm::Material::liquid("oil") });
        for (world, steps) in [(dozing(scheme), 16), (dozing(scheme), 40), (two, 24)] {
            for differences in compared(&world, steps, backend) {
                assert!(differences.iter().any(|d| d.what == "blocks that sleep" && d.compared > 0));
                equal(&differences, &world, steps);
            }
        }
    }
}

/// The same bits where matter crosses periodic sides, in all schemes, also where some of it sleeps.
fn every_pass_of_a_repeated_step(backend: Backend) {
    for scheme in [Scheme::Published, Scheme::Implicit, Scheme::Explicit] {
        let mut world = repeated();
        world.settings.scheme = scheme;
        let mut asleep = dozing(scheme);
        asleep.domain.walls = Walls { x_min: Wall::Periodic, x_max: Wall::Periodic, ..asleep.domain.walls };
        for (world, steps) in [(&world, 0), (&world, 40), (&asleep, 40)] {
            for differences in compared(world, steps, backend) {
                check(&differences, backend);
                equal(&differences, world, steps);
            }
        }
    }
}

fn every_pass_without_colliders(backend: Backend) {
    let mut world = busy();
    world.colliders.clear();
    world.domain.walls = Walls::all(Wall::Open);
    compare(&world, 5, backend);
}
