//! Settings by quality: how they follow from the scale and from the materials, and the accuracy that results.

use crate::backends::{Backend, CPUS, Tests};
use crate::worlds::{DX, assert_sound, ball, block, body, cuboid, particles, state};
use pbmpm::{Collider, DQuat, DVec3, Emitter, Material, Motion, Quality, Rate, Scheme, Settings, Spawn, World};

const ALL: [Quality; 3] = [Quality::Draft, Quality::Realtime, Quality::Accurate];

pub fn add(tests: &mut Tests) {
    tests.once("quality", "steps_go_with_the_scale", steps_go_with_the_scale);
    let stiff = "liquids_are_as_stiff_as_their_scene_needs";
    tests.once("quality", stiff, liquids_are_as_stiff_as_their_scene_needs);
    let unhindered = "liquids_of_the_explicit_scheme_are_as_stiff_as_the_unhindered_step_bears";
    tests.once("quality", unhindered, liquids_of_the_explicit_scheme_are_as_stiff_as_the_unhindered_step_bears);
    let alike = "iterations_do_not_make_a_liquid_stiffer";
    tests.each("quality", &[Backend::Cpu], alike, iterations_do_not_make_a_liquid_stiffer);
    tests.once("quality", "scripted_bodies_stir_as_others_do", scripted_bodies_stir_as_others_do);
    tests.once("quality", "without_gravity_motion_decides", without_gravity_motion_decides);
    tests.each("quality", &[Backend::Cpu], "bodies_pass_no_liquid_by", bodies_pass_no_liquid_by);
    tests.once("quality", "materials_decide_the_scheme", materials_decide_the_scheme);
    tests.once("quality", "deep_liquids_get_shorter_steps", deep_liquids_get_shorter_steps);
    let shared = "liquids_share_their_pressure_where_they_can";
    tests.once("quality", shared, liquids_share_their_pressure_where_they_can);
    tests.each("quality", &[Backend::Cpu], "better_ones_lose_less_height", better_ones_lose_less_height);
    tests.each("quality", CPUS, "scales_are_alike", scales_are_alike);
    tests.each("quality", &[Backend::Cpu], "every_scene_takes_every_quality", every_scene_takes_every_quality);
}

fn water(cells: [f64; 3], cell_size: f64) -> World {
    let mut world = World::new(DVec3::ZERO, DVec3::from_array(cells) * cell_size, cell_size);
    world.materials.push(Material::liquid("water"));
    world
}

fn steps_go_with_the_scale() {
    for (quality, hertz, iterations) in
        [(Quality::Draft, 120.0, 3), (Quality::Realtime, 300.0, 4), (Quality::Accurate, 300.0, 8)]
    {
        let mut world = water([10.0; 3], 0.02);
        let settings = quality.settings(&world);
        assert_eq!((settings.dt, settings.scheme, settings.iterations), (1.0 / hertz, Scheme::Implicit, iterations));
        world.domain.cell_size = 0.005;
        assert!((quality.settings(&world).dt * hertz - 0.5).abs() < 1e-12);
        world.gravity = DVec3::new(0.6, 0.0, 0.8) * 9.81 * 16.0;
        assert!((quality.settings(&world).dt * hertz - 0.125).abs() < 1e-12);
        // On cells of a metre gravity alone would allow steps that meet bodies too seldom.
        world.domain.cell_size = 1.0;
        world.gravity = DVec3::Y * -9.81;
        assert!(quality.settings(&world).dt <= 1.0 / 30.0);
        // Settings that affect neither accuracy nor cost are kept.
        world.settings = Settings { max_fill: 8.0, tension_limit: 2.0, capacity: Some(7), ..world.settings };
        let settings = quality.settings(&world);
        assert_eq!((settings.max_fill, settings.tension_limit, settings.capacity), (8.0, 2.0, Some(7)));
    }
}

/// A hundred times the square of the largest speed, for any step and iterations; more at better qualities.
fn liquids_are_as_stiff_as_their_scene_needs() {
    let mut world = water([10.0; 3], 0.02);
    world.spawns.push(block([0.0; 3], [10.0, 6.0, 10.0], [0.0; 3]));
    let limit = |world: &World, quality: Quality| quality.settings(world).bulk_limit.unwrap_or(f64::INFINITY);
    let found = limit(&world, Quality::Realtime) / (1000.0 * 100.0 * 2.0 * 9.81 * 0.12);
    assert!((found - 1.0).abs() < 1e-9, "{found}");
    assert!((limit(&world, Quality::Accurate) / limit(&world, Quality::Realtime) - 4.0).abs() < 1e-9);
    world.spawns[0].velocity = DVec3::X * 3.0;
    let moving = limit(&world, Quality::Realtime) / (1000.0 * 100.0 * (9.0 + 2.0 * 9.81 * 0.12));
    assert!((moving - 1.0).abs() < 1e-9, "{moving}");
    // If nothing moves and nothing has weight, the iterations decide.
    world.spawns[0].velocity = DVec3::ZERO;
    world.gravity = DVec3::ZERO;
    assert_eq!(Quality::Realtime.settings(&world).bulk_limit, None);
    world.spawns[0].velocity = DVec3::X * 1e-4;
    world.materials[0].rest_density = 1e-3;
    world.settings = Quality::Draft.settings(&world);
    world.validate().expect("what a quality chooses is allowed");
}

/// Viscosity and solids shorten steps below what gravity, depth and motion require, but do not change the modulus of a
/// liquid.
fn liquids_of_the_explicit_scheme_are_as_stiff_as_the_unhindered_step_bears() {
    let mut world = water([40.0; 3], 0.02);
    world.spawns.push(block([0.0; 3], [10.0, 32.0, 10.0], [0.0; 3]));
    let of = |world: &World| Quality::Realtime.settings_in(Scheme::Explicit, world);
    let modulus = |world: &World| of(world).bulk_limit.expect("something weighs or moves");
    // Sound travels √0.85 cells in 1/900 s.
    let full = 1000.0 * 0.85 * (0.02f64 * 900.0).powi(2);
    assert!((modulus(&world) / full - 1.0).abs() < 1e-9);
    world.materials[0].viscosity = 100.0;
    world.materials.push(Material { youngs_modulus: 1e6, ..Material::elastic("rubber") });
    world.spawns.push(Spawn { material: "rubber".to_owned(), ..block([20.0, 0.0, 20.0], [30.0; 3], [0.0; 3]) });
    assert!(of(&world).dt < 0.5 / 900.0 && (modulus(&world) / full - 1.0).abs() < 1e-9, "{:?}", of(&world));
    // Fast motion at the start, also of a body, needs a larger modulus: a step for each third of a cell of the way.
    world.spawns[0].velocity = DVec3::X * 12.0;
    let thrown = 1000.0 * 0.85 * (3.0f64 * 12.0).powi(2);
    assert!((modulus(&world) / thrown - 1.0).abs() < 1e-9);
    world.spawns[0].velocity = DVec3::ZERO;
    world.gravity = DVec3::ZERO;
    assert_eq!(of(&world).bulk_limit, None);
    world.colliders.push(Collider { linear_velocity: DVec3::Y * 12.0, ..body(ball(1.0), [5.0; 3]) });
    assert!((modulus(&world) / thrown - 1.0).abs() < 1e-9);
}

/// Columns with the same limit lose the same height with four times the iterations, whether or not the liquids of a
/// block share a pressure. Without a limit, columns without shared pressures lose less.
fn iterations_do_not_make_a_liquid_stiffer(backend: Backend) {
    let height = |iterations: u32, bulk_limit: Option<f64>, block_pressure: bool| {
        let mut world = water([3.0, 14.0, 3.0], 0.02);
        world.spawns.push(block([0.0; 3], [3.0, 12.0, 3.0], [0.0; 3]));
        world.settings = Settings { bulk_limit, iterations, block_pressure, ..Quality::Realtime.settings(&world) };
        let mut solver = backend.solver(&world);
        solver.steps(300).unwrap_or_else(|e| panic!("{e}"));
        state(&mut *solver).centre_of_mass_m[1] / DX
    };
    for shared in [false, true] {
        let soft = [4, 16].map(|iterations| height(iterations, Some(5e4), shared));
        assert!((soft[0] - soft[1]).abs() < 0.01, "{soft:?} cells");
    }
    let soft = height(4, Some(5e4), false);
    let stiff = [4, 16].map(|iterations| height(iterations, None, false));
    assert!(stiff[1] - stiff[0] > 0.01 && stiff[0] - soft > 0.05, "{stiff:?} and {soft} cells");
}

/// A body or an emitter that moves by a script requires the same settings as with the velocity itself.
fn scripted_bodies_stir_as_others_do() {
    let with = |change: &dyn Fn(&mut World)| {
        let mut world = water([20.0; 3], 0.02);
        world.spawns.push(block([0.0; 3], [20.0, 6.0, 20.0], [0.0; 3]));
        world.colliders.push(body(cuboid([3.0, 1.0, 1.0]), [10.0; 3]));
        change(&mut world);
        Quality::Realtime.settings(&world)
    };
    let (linear_velocity, angular_velocity) = (DVec3::X * 4.0, DVec3::Y * 20.0);
    let script = |motion: &Motion| with(&|world| world.colliders[0].motion = Some(motion.clone()));
    let stated = with(&|world| {
        (world.colliders[0].linear_velocity, world.colliders[0].angular_velocity) = (linear_velocity, angular_velocity);
    });
    assert!(stated.bulk_limit > with(&|_| ()).bulk_limit);
    assert_eq!(script(&Motion::Steady { linear_velocity, angular_velocity }), stated);
    let turn = std::f64::consts::TAU * 0.5;
    let (amplitude, angular_amplitude) = (linear_velocity / turn, angular_velocity / turn);
    let found = script(&Motion::Oscillate { amplitude, frequency: 0.5, phase: 0.25, angular_amplitude }).bulk_limit;
    assert!((found.unwrap() / stated.bulk_limit.unwrap() - 1.0).abs() < 1e-9);
    let keyed = |rotations: Vec<DQuat>| {
        let (times, positions) = (vec![0.0, 0.1], vec![DVec3::ZERO, linear_velocity * 0.1]);
        script(&Motion::Keyframes { times, positions, rotations, repeat: false }).bulk_limit.unwrap()
    };
    let turned = vec![DQuat::IDENTITY, DQuat::from_scaled_axis(angular_velocity * 0.1)];
    assert!((keyed(turned) / stated.bulk_limit.unwrap() - 1.0).abs() < 1e-6);
    assert!(keyed(Vec::new()) < stated.bulk_limit.unwrap());
    let jet = Emitter::new("water", ball(1.0), DVec3::splat(0.2), Rate::Litres(1.0));
    let emitted = |velocity: DVec3, motion: Option<Motion>| {
        with(&|world| world.emitters.push(Emitter { velocity, motion: motion.clone(), ..jet.clone() }))
    };
    let moved = Motion::Steady { linear_velocity, angular_velocity: DVec3::ZERO };
    assert_eq!(emitted(DVec3::ZERO, Some(moved)), emitted(linear_velocity, None));
}

fn without_gravity_motion_decides() {
    for quality in ALL {
        for scheme in [Scheme::Published, Scheme::Implicit, Scheme::Explicit] {
            let mut world = water([20.0; 3], 0.02);
            world.gravity = DVec3::ZERO;
            let calm = quality.settings_in(scheme, &world);
            assert!(calm.dt <= 1.0 / 30.0 && calm.dt > 1e-3, "{calm:?}");
            let spin = Spawn { angular_velocity: DVec3::Y * 10.0, ..block([5.0; 3], [15.0; 3], [1.0, 0.0, 0.0]) };
            world.spawns.push(spin);
            let moving = quality.settings_in(scheme, &world);
            // A corner moves at 1 m/s and 10 rad/s times half the box's diagonal.
            let speed = 1.0 + 10.0 * 0.1 * 3f64.sqrt();
            assert!(moving.dt * speed <= moving.courant * DX * (1.0 + 1e-12), "{moving:?}");
            let jet = Emitter::new("water", ball(1.0), DVec3::splat(0.2), Rate::Litres(1.0));
            world.emitters.push(Emitter { velocity: DVec3::X * 2.0 * speed, ..jet });
            assert!((quality.settings_in(scheme, &world).dt / moving.dt - 0.5).abs() < 1e-9);
            // A negligible gravity changes hardly anything.
            world.gravity = DVec3::Y * -1e-9;
            assert!((quality.settings_in(scheme, &world).dt / moving.dt - 0.5).abs() < 1e-9);
        }
    }
}

/// Without gravity, liquid at rest stays before a plate that comes at 10 m/s.
fn bodies_pass_no_liquid_by(backend: Backend) {
    for scheme in [Scheme::Implicit, Scheme::Explicit] {
        let mut world = water([100.0, 20.0, 20.0], DX);
        world.gravity = DVec3::ZERO;
        world.spawns = vec![block([40.0, 6.0, 6.0], [48.0, 14.0, 14.0], [0.0; 3])];
        let plate = body(cuboid([1.0, 20.0, 20.0]), [30.0, 10.0, 10.0]);
        world.colliders.push(Collider { linear_velocity: DVec3::X * 10.0, ..plate });
        world.settings = Quality::Realtime.settings_in(scheme, &world);
        let mut solver = backend.solver(&world);
        for _ in 0..6 {
            solver.advance(0.01).unwrap();
        }
        let front = solver.poses()[0].position.x;
        assert!(front > 55.0 * DX, "the plate has met all of the liquid: {front}");
        let behind = particles(&mut *solver).iter().filter(|p| p.position.x < front).count();
        assert_eq!(behind, 0, "{scheme:?}");
    }
}

fn materials_decide_the_scheme() {
    for quality in ALL {
        let mut world = water([10.0; 3], 0.02);
        world.materials.push(Material::liquid("oil"));
        assert_eq!(quality.settings(&world).scheme, Scheme::Implicit);
        for young in [1e2, 1e5, 1e8] {
            let mut mixed = world.clone();
            mixed.materials.push(Material { youngs_modulus: young, ..Material::elastic("rubber") });
            let mut solid = mixed.clone();
            solid.materials.retain(|m| m.name == "rubber");
            for (world, scheme) in [(&mut mixed, Scheme::Implicit), (&mut solid, Scheme::Explicit)] {
                world.settings = quality.settings(world);
                assert_eq!(world.settings.scheme, scheme);
                assert_eq!(world.validate(), Ok(()));
            }
            assert!(solid.settings.dt <= quality.stable_share() * solid.stable_dt());
            // A stiff solid needs shorter steps, or more iterations.
            let (longest, iterations) = mixed.followed_dt(mixed.settings.dt);
            assert!(mixed.settings.dt <= longest && mixed.settings.iterations >= iterations);
            assert_eq!(mixed.settings.dt, quality.settings(&world).dt.min(longest));
            // Only the explicit scheme supports sand.
            mixed.materials.push(Material::sand("sand", 30.0));
            mixed.settings = quality.settings(&mixed);
            assert_eq!((mixed.settings.scheme, mixed.validate()), (Scheme::Explicit, Ok(())));
            // A liquid is softened to the step length, whatever a solid requires.
            assert!(mixed.settings.dt <= 1.0 / 600.0);
        }
        // If a shorter step than the shortest would be needed, the world is refused.
        let mut steel = world.clone();
        steel.materials = vec![Material { youngs_modulus: 1e12, ..Material::elastic("steel") }];
        steel.settings = quality.settings(&steel);
        let error = steel.validate().unwrap_err().to_string();
        assert!(error.starts_with("materials[0].youngs_modulus = 1000000000000.0: must be so small"), "{error}");
    }
}

fn deep_liquids_get_shorter_steps() {
    let column = |height: f64, parts: u32| {
        let mut world = water([10.0, 300.0, 10.0], DX);
        let each = height / f64::from(parts);
        for k in 0..parts {
            let lo = each * f64::from(k);
            world.spawns.push(block([0.0, lo, 0.0], [4.0, lo + each, 4.0], [0.0; 3]));
        }
        world
    };
    for scheme in [Scheme::Published, Scheme::Implicit, Scheme::Explicit] {
        let dt = |world: &World| Quality::Realtime.settings_in(scheme, world).dt;
        let usual = dt(&column(32.0, 1));
        assert_eq!(dt(&column(8.0, 1)), usual);
        // With shared pressures, twice the depth is not too deep.
        let enough = if scheme == Scheme::Implicit { 64.0 } else { 32.0 };
        assert_eq!(dt(&column(enough, 1)), usual);
        // Proportional to one over the root of the depth, in one piece or in four.
        for parts in [1, 4] {
            assert!((dt(&column(4.0 * enough, parts)) / usual - 0.5).abs() < 1e-12);
        }
        // Distance does not add to the depth, and depth is measured along gravity.
        let mut far = column(enough, 1);
        far.spawns.push(block([0.0, 230.0, 0.0], [4.0, 230.0 + enough, 4.0], [0.0; 3]));
        assert!((dt(&far) / usual - 0.5f64.sqrt()).abs() < 1e-12);
        far.gravity = DVec3::X * 9.81;
        assert_eq!(dt(&far), usual);
    }
}

/// By blocks, except where liquids differ much in density, are very thick beside bodies, or may become too deep for
/// that; never in drafts.
fn liquids_share_their_pressure_where_they_can() {
    let mut world = water([10.0, 100.0, 10.0], DX);
    world.spawns.push(block([0.0; 3], [10.0; 3], [0.0; 3]));
    let with = |change: &dyn Fn(&mut World)| {
        let mut world = world.clone();
        change(&mut world);
        ALL.map(|quality| quality.settings_in(Scheme::Implicit, &world).block_pressure)
    };
    let (shared, apart) = ([false, true, true], [false; 3]);
    assert_eq!(with(&|_| ()), shared);
    assert_eq!(with(&|w| w.materials[0].viscosity = 5000.0), shared);
    let post = |w: &mut World| w.colliders.push(body(cuboid([1.0; 3]), [5.0; 3]));
    assert_eq!(with(&|w| (post(w), w.materials[0].viscosity = 50.0).1), shared);
    assert_eq!(with(&|w| (post(w), w.materials[0].viscosity = 5000.0).1), apart);
    assert_eq!(with(&|w| (w.settings.capacity, w.domain.max.y) = (Some(100_000), 200.0 * DX)), [false, false, true]);
    let beside = |w: &mut World, other: Material| {
        w.spawns.push(Spawn { material: other.name.clone(), ..block([0.0, 20.0, 0.0], [10.0, 24.0, 10.0], [0.0; 3]) });
        w.materials.push(other);
    };
    assert_eq!(with(&|w| beside(w, Material { viscosity: 1.0, ..Material::liquid("syrup") })), shared);
    let of = |rest_density: f64| Material { rest_density, ..Material::liquid("other") };
    assert_eq!(with(&|w| beside(w, of(900.0))), shared);
    assert_eq!(with(&|w| beside(w, of(20.0))), apart);
    // Where they cannot, iterations make up for it.
    let iterations = |density: f64| {
        let mut world = world.clone();
        beside(&mut world, of(density));
        ALL.map(|quality| quality.settings_in(Scheme::Implicit, &world).iterations)
    };
    assert_eq!([1000.0, 20.0].map(iterations), [[3, 4, 8], [6, 8, 16]]);
    assert_eq!(with(&|w| w.materials[0] = Material::elastic("water")), apart);
}

/// Share of its height that a column of 16 cells loses within a second.
fn lost(backend: Backend, quality: Quality, cell_size: f64) -> f64 {
    let mut world = water([4.0, 20.0, 4.0], cell_size);
    let top = DVec3::new(4.0, 16.0, 4.0) * cell_size;
    world.spawns.push(Spawn { jitter: 0.2, ..Spawn::cuboid("water", DVec3::ZERO, top) });
    // The same in units of the time scale.
    let seconds = (cell_size / 0.02).sqrt();
    world.settings = quality.settings(&world);
    let mut solver = backend.solver(&world);
    solver.steps((seconds / world.settings.dt).round() as u32).unwrap();
    assert_sound(&particles(&mut *solver));
    1.0 - state(&mut *solver).centre_of_mass_m[1] / (8.0 * cell_size)
}

fn better_ones_lose_less_height(backend: Backend) {
    let [draft, realtime, accurate] = ALL.map(|quality| lost(backend, quality, 0.02));
    assert!(draft < 0.15 && realtime < 0.01 && accurate < 0.005, "{draft} {realtime} {accurate}");
    assert!(accurate < 0.75 * realtime && realtime < 0.5 * draft, "{draft} {realtime} {accurate}");
}

/// A world of larger cells is the same one in slower motion.
fn scales_are_alike(backend: Backend) {
    let (small, large) = (lost(backend, Quality::Realtime, 0.02), lost(backend, Quality::Realtime, 0.08));
    let tolerance = backend.pick(1e-7, 1e-3);
    assert!((small - large).abs() < tolerance, "{small} {large}");
}

/// Some steps of each: nothing is lost, and all numbers are finite.
fn every_scene_takes_every_quality(backend: Backend) {
    for file in crate::scene_files::scene_files() {
        let mut world = pbmpm::scene::from_file(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        for quality in ALL {
            world.settings = quality.settings(&world);
            let mut solver = backend.solver(&world);
            let advanced =
                solver.advance(4.0 * world.settings.dt).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
            assert!(advanced.steps >= 4);
            assert_sound(&particles(&mut *solver));
        }
    }
}
