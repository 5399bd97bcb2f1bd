//! The same bits for any order of particles, threads, submissions or allocations.

use crate::alike::assert_states;
use crate::backends::{Backend, DEVICES, MOST, NATIVE, SINGLE, Tests};
use crate::worlds::{after, ball, block, body, busy, cuboid, empty, flowing, mixed_implicit, particles, report};
use pbmpm::{
    Boundary, Collider, DVec3, Error, Fill, GpuOptions, Material, Memory, Model, Particle, Quality, Scheme, Settings,
    Simulate, Spawn, Tuning, Wall, World, state_hash,
};
use std::collections::HashMap;

pub fn add(tests: &mut Tests) {
    tests.each("determinism", MOST, "twice_the_same", twice_the_same);
    tests.each("determinism", SINGLE, "order_of_particles_does_not_matter", order_of_particles_does_not_matter);
    tests.each("determinism", MOST, "steps_may_be_split_over_submissions", steps_may_be_split_over_submissions);
    tests.each("determinism", MOST, "materials_of_which_there_is_nothing", materials_of_which_there_is_nothing);
    tests.each("determinism", MOST, "looking_changes_nothing", looking_changes_nothing);
    tests.each("determinism", DEVICES, "a_grid_that_grows_gives_the_same_bits", a_grid_that_grows_gives_the_same_bits);
    tests.each("determinism", NATIVE, "any_tuning_gives_the_same_bits", any_tuning_gives_the_same_bits);
    tests.each("determinism", DEVICES, "many_bodies_in_reach_of_full_blocks", many_bodies_in_reach_of_full_blocks);
    tests.once("determinism", "cpu::any_number_of_threads", any_number_of_threads::<f32>);
    tests.once("determinism", "cpu64::any_number_of_threads", any_number_of_threads::<f64>);
}

/// All of the busy scene is in contact by then.
const STEPS: u32 = 20;

fn hash_after(solver: &mut dyn Simulate, steps: u32) -> u64 {
    state_hash(&after(solver, steps))
}

fn twice_the_same(backend: Backend) {
    for world in [busy(), flowing()] {
        let run = || hash_after(&mut *backend.solver(&world), STEPS);
        assert_eq!(run(), run(), "{}", world.name);
    }
}

/// Cells of 2⁻⁶ m, so that every lattice point is exact and a block can be cut without moving any.
fn exact(spawns: Vec<Spawn>) -> World {
    let cell = 1.0 / 64.0;
    let mut world = World::new(DVec3::ZERO, DVec3::splat(16.0 * cell), cell);
    world.settings.scheme = Scheme::Published;
    world.settings.dt = 1.0 / 120.0;
    world.settings.iterations = 2;
    world.materials.push(Material::liquid("water"));
    world.materials.push(Material { rest_density: 700.0, ..Material::liquid("oil") });
    world.spawns = spawns;
    world
}

fn part(lo: [f64; 3], hi: [f64; 3]) -> Spawn {
    let material = if lo[1] < 3.0 { "water" } else { "oil" };
    let spawn = Spawn::cuboid(material, DVec3::from_array(lo) / 64.0, DVec3::from_array(hi) / 64.0);
    Spawn { fill: Fill::Spacing(1.0 / 128.0), velocity: DVec3::new(0.25, -0.5, 0.125), ..spawn }
}

fn by_start(solver: &mut dyn Simulate, steps: u32) -> HashMap<[u64; 3], Particle> {
    let start = particles(solver);
    let end = after(solver, steps);
    let keys = start.iter().map(|p| p.position.to_array().map(f64::to_bits));
    let found: HashMap<_, _> = keys.zip(end).collect();
    assert_eq!(found.len(), start.len(), "no two particles start at the same point");
    found
}

/// The same matter, spawned in different orders.
fn order_of_particles_does_not_matter(backend: Backend) {
    let whole = vec![part([3.0, 0.0, 3.0], [7.0, 3.0, 7.0]), part([3.0, 3.0, 3.0], [7.0, 6.0, 7.0])];
    let cut = vec![
        part([6.0, 3.0, 3.0], [7.0, 6.0, 5.0]),
        part([3.0, 0.0, 3.0], [4.5, 3.0, 7.0]),
        part([3.0, 3.0, 3.0], [6.0, 6.0, 5.0]),
        part([4.5, 0.0, 3.0], [7.0, 3.0, 7.0]),
        part([3.0, 3.0, 5.0], [7.0, 6.0, 7.0]),
    ];
    let a = by_start(&mut *backend.solver(&exact(whole)), STEPS);
    let b = by_start(&mut *backend.solver(&exact(cut)), STEPS);
    assert_eq!(a.len(), 4 * 6 * 4 * 8);
    assert_eq!(a.len(), b.len());
    for (start, p) in &a {
        assert_eq!(b.get(start), Some(p), "particle from {:?}", start.map(f64::from_bits));
    }
}

fn steps_may_be_split_over_submissions(backend: Backend) {
    let at_once = hash_after(&mut *backend.solver(&busy()), STEPS);
    let mut solver = backend.solver(&busy());
    (0..STEPS / 2).for_each(|_| solver.step().unwrap());
    let split = hash_after(&mut *solver, STEPS - STEPS / 2);
    assert_eq!(at_once, split);
}

/// Materials without matter change neither results, nor memory, nor settings, unless there is capacity for them; this
/// holds even for sand in the implicit scheme.
fn materials_of_which_there_is_nothing(backend: Backend) {
    let sand = Model::Sand { friction_angle: 30.0 };
    let absent = [
        Material { rest_density: 1e4, viscosity: 1e5, ..Material::liquid("tar") },
        Material { youngs_modulus: 1e12, ..Material::elastic("steel") },
        Material { model: sand, rest_density: 2.0, ..Material::liquid("dust") },
    ];
    for plain in [busy(), flowing()] {
        let mut more = plain.clone();
        more.materials.extend(absent.clone());
        assert_eq!(Quality::Accurate.settings(&more), Quality::Accurate.settings(&plain));
        let (mut solver, mut leaner) = (backend.solver(&more), backend.solver(&plain));
        assert_eq!(hash_after(&mut *solver, STEPS), hash_after(&mut *leaner, STEPS), "{}", plain.name);
        // Except for its constants.
        let stored = |solver: &mut dyn Simulate| {
            let Memory { particles, grid, bins, .. } = solver.memory();
            (particles, grid, bins)
        };
        assert_eq!(stored(&mut *solver), stored(&mut *leaner));
        let added = solver.add(&Spawn { material: "steel".to_owned(), ..plain.spawns[0].clone() });
        assert!(matches!(&added, Err(Error::Invalid { field, .. }) if field == "spawn.material"), "{added:?}");
        more.settings.capacity = Some(1 << 16);
        let refused = more.settings.scheme == Scheme::Implicit;
        assert_eq!(more.validate().is_err(), refused, "{}", plain.name);
    }
}

/// All that can be read, after every step and only at the end.
fn looking_changes_nothing(backend: Backend) {
    for world in [busy(), flowing()] {
        let unseen = hash_after(&mut *backend.solver(&world), STEPS);
        let mut solver = backend.solver(&world);
        for _ in 0..STEPS {
            solver.step().unwrap();
            particles(&mut *solver);
            report(&mut *solver);
            solver.loads().unwrap();
            solver.sensors().unwrap();
            solver.save().unwrap();
        }
        assert_eq!(state_hash(&particles(&mut *solver)), unseen, "{}", world.name);
    }
}

/// A grid with room for 8 blocks must grow at the first step, and again as the matter spreads.
fn a_grid_that_grows_gives_the_same_bits(backend: Backend) {
    grows_alike(backend, &busy());
    grows_alike(backend, &flowing());
}

fn grows_alike(backend: Backend, world: &World) {
    let run = |blocks| {
        let options = GpuOptions { grid_blocks: Some(blocks), ..GpuOptions::default() };
        let mut solver = backend.try_solver(world, &options).unwrap();
        let hash = hash_after(&mut *solver, STEPS);
        let report = report(&mut *solver);
        assert_eq!(report.step, u64::from(STEPS));
        assert!((report.time - f64::from(STEPS) / 120.0).abs() < 1e-12, "{}", report.time);
        (hash, report.faults.steps_deferred, solver.memory().grid, solver.poses().to_vec())
    };
    let (hash, deferred, bytes, poses) = run(8);
    let (large_hash, none, large_bytes, large_poses) = run(4096);
    assert_eq!(hash, large_hash);
    assert_eq!(poses, large_poses, "bodies do not move in steps that were not taken");
    assert!(deferred > 0 && none == 0, "{deferred} {none}");
    assert!(bytes < large_bytes, "{bytes} {large_bytes}");
}

/// For any division of passes into workgroups, and whether iterations are fused or not.
fn any_tuning_gives_the_same_bits(backend: Backend) {
    for world in [busy(), alike(), mixed_implicit()] {
        let run = |tuning| {
            let options = GpuOptions { tuning, ..GpuOptions::default() };
            after(&mut *backend.try_solver(&world, &options).unwrap(), STEPS)
        };
        let usual = run(None);
        for tuning in [
            Tuning { share: 16, ..Tuning::GPU },
            Tuning { tiles: true, lanes: 8, tile_lanes: 256, share: 3, fused: false },
            Tuning { tiles: false, ..Tuning::GPU },
        ] {
            assert_states(backend, &usual, &run(Some(tuning)), &format!("{} {tuning:?}", world.name));
        }
    }
}

/// Liquids of one density, in more iterations.
fn alike() -> World {
    let mut world = busy();
    world.name = "alike".to_owned();
    world.materials.iter_mut().for_each(|material| material.rest_density = 1000.0);
    world.settings.iterations = 5;
    world
}

fn any_number_of_threads<R: pbmpm::Real>() {
    for world in [busy(), flowing()] {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| {
                let mut solver = pbmpm::CpuSolver::<R>::new(&world).unwrap();
                assert_eq!(rayon::current_num_threads(), threads);
                hash_after(&mut solver, STEPS)
            })
        };
        let one = run(1);
        for threads in [2, 3, 7] {
            assert_eq!(one, run(threads), "{threads} threads in {}", world.name);
        }
    }
}

/// Some drivers silently leave loops after a number of iterations: see `Tuning::share`.
fn many_bodies_in_reach_of_full_blocks(backend: Backend) {
    let boxes = |bodies, scheme, boundary| {
        let mut world = full_blocks(bodies, |at| Collider { boundary, ..body(cuboid([1.5; 3]), at) });
        world.settings = Settings { scheme, iterations: 3, ..world.settings };
        world
    };
    let worlds = [
        full_blocks(120, |at| body(ball(1.6), at)),
        full_blocks(40, |_| Collider { inverted: true, ..body(cuboid([6.0; 3]), [8.5, 10.0, 8.5]) }),
        boxes(90, Scheme::Published, Boundary::Friction(0.3)),
        boxes(130, Scheme::Implicit, Boundary::Stick),
        boxes(270, Scheme::Explicit, Boundary::Stick),
    ];
    for (i, world) in worlds.iter().enumerate() {
        let expected = after(&mut *Backend::Cpu.solver(world), 2);
        assert_states(backend, &expected, &after(&mut *backend.solver(world), 2), &format!("world {i}"));
    }
}

/// Eight blocks full of liquid that fall on this many bodies, all in reach of all blocks.
fn full_blocks(bodies: u32, body: impl Fn([f64; 3]) -> Collider) -> World {
    let mut world = empty([20.0, 24.0, 20.0], Wall::Slip);
    world.settings.dt = 1.0 / 400.0;
    world.materials[0].viscosity = 1.0;
    world.spawns.push(block([4.5, 8.5, 4.5], [12.5, 16.5, 12.5], [0.1, -2.0, 0.2]));
    let places = (0..bodies).map(|i| [8.0 + 0.1 * f64::from(i % 7), 7.5 + 0.01 * f64::from(i % 11), 8.5]);
    world.colliders = places.map(|at| Collider { linear_velocity: DVec3::Y * 0.3, ..body(at) }).collect();
    world
}
