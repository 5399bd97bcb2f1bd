//! Shared pressures of the liquids in a block.

use crate::alike::assert_states;
use crate::backends::{Backend, CPUS, NATIVE, Tests};
use crate::suite::cases::CASES;
use crate::suite::measure::{angular_momentum, mean_vector};
use crate::suite::setup::{self, Preset, Setup};
use crate::worlds::{DX, after, assert_sound, block, body, cuboid, empty, flowing, particles, report, state, thick};
use pbmpm::{DVec3, Material, Motion, Quality, Scheme, Settings, Wall, World};

pub fn add(tests: &mut Tests) {
    tests.each("blocks", &[Backend::Cpu], "columns_stand_higher", columns_stand_higher);
    tests.each("blocks", &[Backend::Cpu], "what_flies_knows_nothing_of_them", what_flies_knows_nothing_of_them);
    tests.each("blocks", &[Backend::Cpu], "other_worlds_are_as_they_were", other_worlds_are_as_they_were);
    tests.each("blocks", &[Backend::Cpu], "stronger_gravity_makes_nothing_boil", stronger_gravity_makes_nothing_boil);
    tests.each(
        "blocks",
        &[Backend::Cpu],
        "what_is_not_weight_throws_nothing_back",
        what_is_not_weight_throws_nothing_back,
    );
    tests.each("blocks", &[Backend::Cpu], "blows_gain_no_energy_without_them", blows_gain_no_energy_without_them);
    tests.each("blocks", &[Backend::Cpu], "oil_on_water_stands_as_high", oil_on_water_stands_as_high);
    tests.each("blocks", &[Backend::Cpu], "light_liquids_bear_dense_ones", light_liquids_bear_dense_ones);
    tests.each("blocks", CPUS, "momentum_is_kept", momentum_is_kept);
    tests.each("blocks", NATIVE, "devices_take_the_same_steps", devices_take_the_same_steps);
}

fn shared(mut world: World) -> World {
    world.settings.block_pressure = true;
    world
}

/// 64 cells of water at realtime lose less than half of the height that they lose without shared pressures, and rest.
fn columns_stand_higher(_: Backend) {
    let column = CASES.iter().find(|c| c.name == "a3-64").unwrap();
    let [without, with] = [false, true].map(|block_pressure| {
        let setup = Setup::new(setup::Scheme::Implicit, Preset::Realtime, setup::Backend::Cpu);
        let metrics = (column.body)(&Setup { block_pressure, ..setup }).unwrap().metrics;
        ["height loss", "kinetic energy over m g H"].map(|name| metrics.iter().find(|m| m.name == name).unwrap().error)
    });
    assert!(with[0] < 0.5 * without[0] && with[1] < 0.5 * without[1], "{with:?}, {without:?} without");
}

/// Bit for bit, at any speed, wherever block borders lie.
fn what_flies_knows_nothing_of_them(_: Backend) {
    for speed in [0.0, 1.3] {
        let mut world = empty([40.0, 24.0, 24.0], Wall::Slip);
        world.settings.scheme = Scheme::Implicit;
        world.spawns.push(block([8.0, 8.0, 8.0], [19.0, 15.0, 14.0], [speed, 0.2, 0.0]));
        let [without, with] = [world.clone(), shared(world)].map(|world| after(&mut *Backend::Cpu.solver(&world), 24));
        assert_states(Backend::Cpu, &without, &with, "in flight");
    }
}

/// There are no shared pressures in other schemes, where the search begins with the stress carried over, or where
/// matter is too deep for the iterations.
fn other_worlds_are_as_they_were(_: Backend) {
    for scheme in [Scheme::Published, Scheme::Explicit] {
        let mut world = flowing();
        world.settings.scheme = scheme;
        world.settings.dt = 1e-3;
        let [without, with] = [world.clone(), shared(world)].map(|world| after(&mut *Backend::Cpu.solver(&world), 10));
        assert_states(Backend::Cpu, &without, &with, "another scheme");
    }
    let [without, with] = [thick(), shared(thick())].map(|world| after(&mut *Backend::Cpu.solver(&world), 10));
    assert_states(Backend::Cpu, &without, &with, "a thick liquid");
    let [without, with] =
        [column(96.0), shared(column(96.0))].map(|world| after(&mut *Backend::Cpu.solver(&world), 10));
    assert_states(Backend::Cpu, &without, &with, "a deep column");
}

/// Two iterations in steps of 1/190 s, in which gravity moves matter as far, in cells, as in 1/300 s on cells of 2 cm.
fn column(depth: f64) -> World {
    let mut world = empty([4.0, 1.5 * depth, 4.0], Wall::Slip);
    world.settings = Settings { scheme: Scheme::Implicit, dt: 1.0 / 190.0, iterations: 2, ..world.settings };
    world.spawns.push(block([0.0, 0.0, 0.0], [4.0, depth, 4.0], [0.0; 3]));
    world
}

/// Two layers as deep as each other in a tank, the lower as dense as `below`, the upper as dense as `above`, kg/m³.
fn layers(depth: f64, below: f64, above: f64, quality: Quality) -> World {
    let mut world = empty([8.0, depth + 8.0, 8.0], Wall::Slip);
    let of = |name: &str, rest_density: f64| Material { rest_density, ..Material::liquid(name) };
    world.materials = vec![of("below", below), of("above", above)];
    let half = 0.5 * depth;
    world.spawns =
        vec![block([0.0; 3], [8.0, half, 8.0], [0.0; 3]), block([0.0, half, 0.0], [8.0, depth, 8.0], [0.0; 3])];
    for (spawn, material) in world.spawns.iter_mut().zip(&world.materials) {
        (spawn.material, spawn.jitter) = (material.name.clone(), 0.2);
    }
    world.settings = quality.settings(&world);
    world
}

/// The height of the middle of all mass, in cells, and the kinetic energy over m g h after some time.
fn stands(world: &World, time: f64) -> [f64; 2] {
    let mut solver = Backend::Cpu.solver(world);
    while solver.time() < time {
        solver.advance(1.0 / 60.0).unwrap();
    }
    let state = state(&mut *solver);
    let weight = state.mass_kg * world.gravity.length();
    [state.centre_of_mass_m[1] / DX, state.kinetic_j / (weight * state.centre_of_mass_m[1])]
}

/// Oil on water loses as little of its height as water on water, and comes to rest as well.
fn oil_on_water_stands_as_high(_: Backend) {
    let [water, oil] = [1000.0, 900.0].map(|above| {
        let world = layers(32.0, 1000.0, above, Quality::Realtime);
        let [height, kinetic] = stands(&world, 1.0);
        let middle = (8.0 * 1000.0 + 24.0 * above) / (1000.0 + above);
        [1.0 - height / middle, kinetic]
    });
    assert!(oil[0] < 1.2 * water[0] && oil[1] < 2.0 * water[1] + 1e-6, "{oil:?}, water {water:?}");
}

/// A layer that bears one of five or twenty times its density sinks by a tenth of a cell at most before the two change
/// places, and one of a thousandth of the density rests above.
fn light_liquids_bear_dense_ones(_: Backend) {
    for above in [5000.0, 20_000.0] {
        let world = layers(16.0, 1000.0, above, Quality::Realtime);
        let [height, _] = stands(&world, 0.2);
        let middle = (4.0 * 1000.0 + 12.0 * above) / (1000.0 + above);
        assert!(height > middle - 0.1, "{height} of {middle} cells beneath {above} kg/m³");
    }
    for quality in [Quality::Realtime, Quality::Accurate] {
        let [_, kinetic] = stands(&layers(16.0, 1000.0, 1.0, quality), 1.5);
        assert!(kinetic < 2e-6, "{kinetic} m g h of motion, {quality:?}");
    }
}

/// If gravity becomes so strong that matter would boil, pressures are no longer shared.
fn stronger_gravity_makes_nothing_boil(_: Backend) {
    for before in [0.0, 0.25] {
        let [without, with] = [column(64.0), shared(column(64.0))].map(|mut world| {
            let gravity = world.gravity;
            world.gravity = before * gravity;
            let mut solver = Backend::Cpu.solver(&world);
            solver.set_gravity(gravity).unwrap();
            let rest = after(&mut *solver, 300);
            assert_sound(&rest);
            rest.iter().map(|p| p.velocity.length()).sum::<f64>() / rest.len() as f64
        });
        assert!(with < 1.2 * without, "{with} m/s, {without} without");
    }
}

/// Water that rams the end of a channel, and a box that is drawn through a pool, cause pressures under which particles
/// would not stay in their places. There is no more motion than without shared pressures, and few particles are
/// clamped.
fn what_is_not_weight_throws_nothing_back(_: Backend) {
    let mut channel = empty([48.0, 6.0, 6.0], Wall::Slip);
    channel.gravity = DVec3::ZERO;
    channel.spawns.push(block([4.0, 0.0, 0.0], [40.0, 6.0, 6.0], [2.0, 0.0, 0.0]));
    let mut pool = empty([48.0, 24.0, 6.0], Wall::Slip);
    pool.spawns.push(block([0.0; 3], [48.0, 8.0, 6.0], [0.0; 3]));
    let mut drawn = body(cuboid([2.0, 2.0, 1.5]), [5.0, 4.0, 3.0]);
    let (times, positions) = (vec![0.0, 0.095], vec![DVec3::ZERO, DVec3::X * 38.0 * DX]);
    drawn.motion = Some(Motion::Keyframes { times, positions, rotations: Vec::new(), repeat: false });
    pool.colliders.push(drawn);
    for (name, mut world) in [("ram", channel), ("box", pool)] {
        for quality in [Quality::Realtime, Quality::Accurate] {
            world.settings = quality.settings(&world);
            assert!(world.settings.block_pressure);
            let [without, with] = [false, true].map(|block_pressure| {
                world.settings.block_pressure = block_pressure;
                let mut solver = Backend::Cpu.solver(&world);
                let mut most = state(&mut *solver).kinetic_j;
                for _ in 0..18 {
                    solver.advance(1.0 / 60.0).unwrap();
                    most = most.max(state(&mut *solver).kinetic_j);
                }
                (most, report(&mut *solver).faults.gradient_clamped)
            });
            assert!(with.0 < 1.1 * without.0 && with.1 < 500, "{name}, {quality:?}: {with:?}, {without:?} without");
        }
    }
}

/// Water that rams the end of a channel, at up to two cells per step: compression stores no more energy than a step
/// accounts for.
fn blows_gain_no_energy_without_them(_: Backend) {
    for quality in [Quality::Draft, Quality::Realtime] {
        for speed in [1.5, 2.0, 2.6] {
            let mut world = empty([48.0, 4.0, 4.0], Wall::Slip);
            world.gravity = DVec3::ZERO;
            world.spawns.push(block([4.0, 0.0, 0.0], [40.0, 4.0, 4.0], [speed, 0.0, 0.0]));
            world.settings = Settings { block_pressure: false, ..quality.settings(&world) };
            let mut solver = Backend::Cpu.solver(&world);
            let first = state(&mut *solver).kinetic_j;
            while solver.time() < 0.6 / speed {
                solver.step().unwrap();
                let now = state(&mut *solver).kinetic_j;
                assert!(
                    now < 1.001 * first,
                    "{quality:?} at {speed} m/s: {now} J of {first} after {} s",
                    solver.time()
                );
            }
        }
    }
}

/// Two blocks of liquid that collide off-centre in free flight.
fn momentum_is_kept(backend: Backend) {
    let mut world = empty([40.0, 48.0, 48.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.settings.scheme = Scheme::Implicit;
    world.settings.dt = 1.0 / 300.0;
    world.spawns.push(block([13.0, 20.0, 20.0], [19.0, 26.0, 26.0], [1.2, 0.1, 0.0]));
    world.spawns.push(block([21.0, 22.0, 21.0], [27.0, 28.0, 27.0], [-1.2, 0.0, -0.1]));
    let mut solver = backend.solver(&shared(world));
    let here = particles(&mut *solver);
    let there = after(&mut *solver, 45);
    assert_sound(&there);
    let [v, w] = [&here, &there].map(|all| mean_vector(all, |p| p.velocity));
    let [l, m] = [&here, &there].map(|all| angular_momentum(all, DX));
    let mass: f64 = there.iter().map(|p| p.mass).sum();
    // Relative to the speed at which they meet, and to the angular momentum of that speed half a block from the middle.
    assert!(v.distance(w) < 1e-5 * 2.4, "{v} has become {w}");
    assert!(l.distance(m) < 1e-4 * mass * 2.4 * 3.0 * DX, "{l} has become {m}");
}

/// A dam that breaks over a step, long enough for the grid to grow.
fn devices_take_the_same_steps(backend: Backend) {
    let mut world = empty([32.0, 20.0, 8.0], Wall::Slip);
    world.settings.scheme = Scheme::Implicit;
    world.spawns.push(block([0.0, 0.0, 0.0], [10.0, 18.0, 8.0], [0.0; 3]));
    let world = shared(world);
    let [here, there] = [Backend::Cpu, backend].map(|backend| after(&mut *backend.solver(&world), 60));
    assert_states(backend, &here, &there, "a dam");
}
