//! Random worlds: the valid ones run, the broken ones are refused, and nothing panics.

use crate::backends::Tests;
use pbmpm::{
    Boundary, Collider, CpuSolver, DQuat, DVec3, Emitter, Error, Fate, Fill, GpuOptions, GpuSolver, Material, Mesh,
    Model, Motion, Rate, Region, Shape, Simulate, Spawn, Wall, World,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};

pub fn add(tests: &mut Tests) {
    tests.once("bad_worlds", "random_valid_worlds_run", random_valid_worlds_run);
    tests.once("bad_worlds", "random_traffic_is_accounted_for", random_traffic_is_accounted_for);
    tests.once("bad_worlds", "random_broken_worlds_are_refused", random_broken_worlds_are_refused);
    tests.once("bad_worlds", "random_text_is_no_scene", random_text_is_no_scene);
}

const CASES: u32 = 64;

/// The same cases in every run, so that a failure is one for everybody. `PBMPM_PROPTEST_SEED` draws others.
fn runner() -> TestRunner {
    let config = Config { cases: CASES, failure_persistence: None, ..Config::default() };
    let mut seed = [7; 32];
    if let Some(n) = std::env::var("PBMPM_PROPTEST_SEED").ok().and_then(|text| text.parse::<u64>().ok()) {
        seed[..8].copy_from_slice(&n.to_le_bytes());
    }
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &seed))
}

fn log(lo: f64, hi: f64) -> impl Strategy<Value = f64> {
    (lo.log10()..hi.log10()).prop_map(move |x| 10f64.powf(x).clamp(lo, hi))
}

fn vector(size: f64) -> impl Strategy<Value = DVec3> {
    [-size..size, -size..size, -size..size].prop_map(DVec3::from_array)
}

fn rotation() -> impl Strategy<Value = DQuat> {
    vector(3.0).prop_map(DQuat::from_scaled_axis)
}

fn wall() -> impl Strategy<Value = Wall> {
    prop_oneof![Just(Wall::Slip), Just(Wall::Stick), Just(Wall::Open), (0.0..10.0).prop_map(Wall::Friction)]
}

fn boundary() -> impl Strategy<Value = Boundary> {
    prop_oneof![Just(Boundary::Slip), Just(Boundary::Stick), (0.0..10.0).prop_map(Boundary::Friction)]
}

fn model() -> impl Strategy<Value = Model> {
    prop_oneof![
        Just(Model::Liquid),
        (0.0..=1.0).prop_map(|shape_weight| Model::Elastic { shape_weight }),
        (0.0..=60.0).prop_map(|friction_angle| Model::Sand { friction_angle }),
        (0.0..=2.0).prop_map(|yield_strain| Model::Viscoplastic { yield_strain }),
    ]
}

fn material() -> impl Strategy<Value = Material> {
    (model(), log(1e-3, 1e5), 0.0..1.9, 0.0..1.0).prop_map(|(model, rest_density, relaxation, viscous_relaxation)| {
        Material { model, rest_density, relaxation, viscous_relaxation, ..Material::liquid("") }
    })
}

/// In cells, about a domain of 1: scaled afterwards.
fn shape(largest: f64) -> impl Strategy<Value = Shape> {
    let edge = || 0.05..largest;
    prop_oneof![
        [edge(), edge(), edge()].prop_map(|half| Shape::Box { half_size: DVec3::from_array(half) }),
        edge().prop_map(|radius| Shape::Sphere { radius }),
        // No longer than a box is, from its middle.
        [edge(), edge()].prop_map(|[r, h]| Shape::Capsule { radius: 0.5 * r, half_height: 0.5 * h }),
        [edge(), edge()].prop_map(|[radius, half_height]| Shape::Cylinder { radius, half_height }),
        [0.25..1.0, 0.25..1.0, 0.25..1.0].prop_map(move |half| gem(DVec3::from_array(half) * largest, largest / 12.0)),
    ]
}

/// An octahedron with these half axes.
fn gem(half: DVec3, grid_spacing: f64) -> Shape {
    let tips = DVec3::AXES.iter().flat_map(|axis| [*axis * half, *axis * -half]).collect();
    let faces = (0..8u32).map(|i| {
        let [a, b, c] = [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1)];
        if i.count_ones() % 2 == 0 { [a, b, c] } else { [a, c, b] }
    });
    Shape::Mesh(Mesh::new(tips, faces.collect(), grid_spacing).expect("a mesh"))
}

fn scaled(shape: Shape, cell: f64) -> Shape {
    match shape {
        Shape::Box { half_size } => Shape::Box { half_size: half_size * cell },
        Shape::Sphere { radius } => Shape::Sphere { radius: radius * cell },
        Shape::Capsule { radius: r, half_height: h } => Shape::Capsule { radius: r * cell, half_height: h * cell },
        Shape::Cylinder { radius: r, half_height: h } => Shape::Cylinder { radius: r * cell, half_height: h * cell },
        Shape::Mesh(mesh) => {
            let grid_spacing = mesh.grid_spacing().expect("it is built") * cell;
            let vertices = mesh.vertices().iter().map(|v| *v * cell).collect();
            Shape::Mesh(Mesh::new(vertices, mesh.triangles().to_vec(), grid_spacing).expect("a mesh"))
        }
        other => other,
    }
}

fn spawn() -> impl Strategy<Value = Spawn> {
    let fill = prop_oneof![(0.05..20.0).prop_map(Fill::PerCell), (0.3..2.0).prop_map(Fill::Spacing),];
    (shape(1.5), [0.0..1.0, 0.0..1.0, 0.0..1.0], rotation(), fill, vector(6.0), 0.0..0.5, any::<u64>()).prop_map(
        |(shape, at, rotation, fill, velocity, jitter, seed)| Spawn {
            shape,
            position: DVec3::from_array(at),
            rotation,
            fill,
            velocity,
            jitter,
            seed,
            ..Spawn::cuboid("", DVec3::ZERO, DVec3::ONE)
        },
    )
}

fn collider() -> impl Strategy<Value = Collider> {
    let any_shape = prop_oneof![4 => shape(6.0), 1 => Just(Shape::HalfSpace)];
    (any_shape, vector(1.2), rotation(), vector(3.0), vector(1.8), boundary(), any::<bool>()).prop_map(
        |(shape, position, rotation, linear_velocity, angular_velocity, boundary, inverted)| Collider {
            rotation,
            linear_velocity,
            angular_velocity,
            boundary,
            inverted,
            ..Collider::new(shape, position)
        },
    )
}

/// Any valid world that is small enough to run: lengths in cells and velocities in cells per step become metres here.
fn world() -> impl Strategy<Value = World> {
    let domain = (
        log(1e-4, 1e3),
        vector(50.0),
        [7.0..20.0, 7.0..20.0, 7.0..20.0],
        [wall(), wall(), wall(), wall(), wall(), wall()],
    );
    let settings = (log(1e-5, 0.2), 1u32..4, 0.5..16.0, log(2.0, 4096.0), log(1e-4, 1e3), 1.0..4.0);
    let matter = (
        prop::collection::vec(material(), 1..4),
        prop::collection::vec((spawn(), 0usize..4), 0..4),
        prop::collection::vec(collider(), 0..5),
        vector(1.0),
    );
    (domain, settings, matter).prop_map(
        |((cell, min, size, w), (dt, iterations, displacement, fill, time, tension), matter)| {
            let (mut materials, spawns, mut colliders, gravity) = matter;
            let (min, size) = (min * cell, DVec3::from_array(size) * cell);
            let mut world = World::new(min, min + size, cell);
            let [x_min, x_max, y_min, y_max, z_min, z_max] = w;
            world.domain.walls = pbmpm::Walls { x_min, x_max, y_min, y_max, z_min, z_max };
            // Up to two cells per step gained in a step, within what is allowed.
            let limit = |v: DVec3, most: f64| v.clamp(DVec3::splat(-most), DVec3::splat(most));
            world.gravity = limit(gravity * 2.0 * cell / (dt * dt), 1e6);
            materials.iter_mut().enumerate().for_each(|(i, m)| m.name = format!("m{i}"));
            for (mut spawn, material) in spawns {
                spawn.material = materials[material % materials.len()].name.clone();
                spawn.shape = scaled(spawn.shape.clone(), cell);
                // Three cells of room for a turned box of half edges up to 1.5 and its jitter.
                let room = DVec3::splat(3.2 * cell);
                spawn.position = min + room + spawn.position * (size - room * 2.0);
                spawn.velocity = limit(spawn.velocity * cell / dt, 1e6);
                if let Fill::Spacing(s) = &mut spawn.fill {
                    *s *= cell;
                }
                world.spawns.push(spawn);
            }
            for collider in &mut colliders {
                collider.shape = scaled(collider.shape.clone(), cell);
                collider.position = min + size * 0.5 + collider.position * size * 0.5;
                collider.linear_velocity = limit(collider.linear_velocity * cell / dt, 1e6);
                collider.angular_velocity = limit(collider.angular_velocity / dt, 5e3).clamp_length_max(3.0 / dt);
            }
            world.materials = materials;
            world.colliders = colliders;
            world.settings = pbmpm::Settings {
                dt,
                iterations,
                max_displacement: displacement,
                max_fill: fill,
                volume_correction_time: time,
                tension_limit: tension,
                capacity: None,
            };
            world
        },
    )
}

/// 5 steps: finite, no mass lost that was not told of, nothing outside.
fn runs(world: &World, mut solver: impl Simulate) -> Result<(), TestCaseError> {
    let before: f64 = solver.particles().unwrap().iter().map(|p| p.mass).sum();
    solver.steps(5).unwrap();
    let particles = solver.particles().unwrap();
    let report = solver.report().unwrap();
    let escaped = particles.iter().filter(|p| p.fate == Fate::Escaped).count();
    prop_assert_eq!(report.faults.quarantined, 0);
    prop_assert_eq!(report.faults.escaped as usize, escaped);
    prop_assert_eq!(report.alive as usize, particles.len() - escaped);
    prop_assert_eq!(particles.iter().map(|p| p.mass).sum::<f64>(), before);
    // Positions come back from cells in f32.
    let slack = 1e-5 * (world.domain.max - world.domain.min).max_element();
    let (lo, hi) = (world.domain.min - slack, world.domain.max + slack);
    for p in &particles {
        let finite = p.position.is_finite() && p.velocity.is_finite() && p.velocity_gradient.is_finite();
        prop_assert!(finite && p.volume_ratio.is_finite(), "{:?}", p);
        prop_assert!(p.position.clamp(lo, hi) == p.position, "{:?}", p);
        let cells = p.velocity.length() * world.settings.dt / world.domain.cell_size;
        prop_assert!(cells <= world.settings.max_displacement * 1.0001, "{} cells in a step", cells);
    }
    Ok(())
}

fn random_valid_worlds_run() {
    let result = runner().run(&world(), |world| {
        prop_assert_eq!(world.validate(), Ok(()));
        runs(&world, CpuSolver::<f32>::new(&world).map_err(|e| TestCaseError::fail(e.to_string()))?)?;
        runs(&world, CpuSolver::<f64>::new(&world).map_err(|e| TestCaseError::fail(e.to_string()))?)?;
        prop_assert!(GpuSolver::required_limits(&world, &GpuOptions::default()).is_ok());
        prop_assert_eq!(pbmpm::scene::from_json(&pbmpm::scene::to_json(&world)), Ok(world));
        Ok(())
    });
    result.unwrap_or_else(|e| panic!("{e}"));
}

/// Emitters, drains, sensors and what a host adds and deletes, in cells and steps; whether there is room for it.
type Traffic = (Vec<(Shape, DVec3, DQuat, DVec3, f64)>, Vec<(Region, bool)>, Spawn, Region, bool);

fn region() -> impl Strategy<Value = Region> {
    let any_shape = prop_oneof![4 => shape(4.0), 1 => Just(Shape::HalfSpace)];
    (any_shape, vector(1.0), rotation(), any::<bool>(), vector(0.5)).prop_map(
        |(shape, position, rotation, inverted, linear_velocity)| Region {
            rotation,
            inverted,
            motion: Some(Motion::Steady { linear_velocity, angular_velocity: linear_velocity }),
            ..Region::new(shape, position)
        },
    )
}

fn traffic() -> impl Strategy<Value = Traffic> {
    let emitter = (shape(2.0), vector(1.0), rotation(), vector(3.0), 0.0..40.0);
    (
        prop::collection::vec(emitter, 0..3),
        prop::collection::vec((region(), any::<bool>()), 0..4),
        spawn(),
        region(),
        any::<bool>(),
    )
}

/// Random worlds in which matter comes and goes: whatever overlaps, moves, falls outside or finds no slot, the counts agree with
/// what is there.
fn random_traffic_is_accounted_for() {
    let result = runner().run(&(world(), traffic()), |(mut world, (emitters, regions, splash, hole, roomy))| {
        let (cell, dt) = (world.domain.cell_size, world.settings.dt);
        let (min, size) = (world.domain.min, world.domain.max - world.domain.min);
        let placed = |mut region: Region| {
            region.shape = scaled(region.shape, cell);
            region.position = min + size * 0.5 + region.position * size * 0.5;
            if let Some(Motion::Steady { linear_velocity, angular_velocity }) = &mut region.motion {
                *linear_velocity *= (cell / dt).min(1e6);
                *angular_velocity *= (1.0 / dt).min(1e4);
            }
            region
        };
        for (shape, position, rotation, velocity, per_step) in emitters {
            let position = min + size * 0.5 + position * size * 0.6;
            let rate = Rate::Particles(per_step / dt);
            let velocity = velocity * (cell / dt).min(3e5);
            let material = world.materials[0].name.clone();
            world.emitters.push(Emitter {
                rotation,
                velocity,
                ..Emitter::new(material, scaled(shape, cell), position, rate)
            });
        }
        for (region, drains) in regions {
            if drains { &mut world.drains } else { &mut world.sensors }.push(placed(region));
        }
        let spawned = world.particle_count().map_err(|e| TestCaseError::fail(e.to_string()))? as u32;
        world.settings.capacity = Some(if roomy { spawned + 20_000 } else { spawned });
        let mut solver = CpuSolver::<f32>::new(&world).map_err(|e| TestCaseError::fail(e.to_string()))?;
        solver.steps(2).unwrap();
        let room = DVec3::splat(3.2 * cell);
        let splash = Spawn {
            material: world.materials[0].name.clone(),
            shape: scaled(splash.shape.clone(), cell),
            position: min + room + splash.position * (size - room * 2.0),
            fill: Fill::PerCell(8.0),
            velocity: DVec3::ZERO,
            ..splash
        };
        // Refused where it has more particles than there are slots.
        let added = solver.add(&splash).unwrap_or(0) as u64;
        solver.remove(&placed(hole)).unwrap();
        solver.steps(3).unwrap();
        let (particles, report) = (solver.particles().unwrap(), solver.report().unwrap());
        let count = |fate| particles.iter().filter(|p| p.fate == fate).count() as u64;
        prop_assert_eq!(count(Fate::Alive), u64::from(report.alive));
        let (left, lost) = (report.drained + u64::from(report.faults.escaped), u64::from(report.faults.quarantined));
        prop_assert_eq!(u64::from(spawned) + report.emitted, u64::from(report.alive) + left + lost);
        prop_assert_eq!(lost, 0);
        let asked: f64 = world.emitters.iter().map(|e| e.particles_per_second(cell) * 5.0 * dt).sum();
        let came = report.emitted + report.withheld + report.faults.refused - added;
        prop_assert!((came as f64 - asked).abs() <= world.emitters.len() as f64 + 1e-6, "{} of {}", came, asked);
        for p in particles.iter().filter(|p| p.fate == Fate::Alive) {
            prop_assert!(p.position.is_finite() && p.velocity.is_finite() && p.mass > 0.0, "{:?}", p);
        }
        let most = solver.sensors().unwrap().iter().map(|reading| reading.count).max().unwrap_or(0);
        prop_assert!(most <= report.alive);
        prop_assert_eq!(pbmpm::scene::from_json(&pbmpm::scene::to_json(&world)), Ok(world));
        Ok(())
    });
    result.unwrap_or_else(|e| panic!("{e}"));
}

/// Puts a value into one field that takes neither NaN, infinities nor negative numbers; false if there is no such field.
fn spoil(world: &mut World, which: usize, value: f64) -> bool {
    let spawn = world.spawns.first_mut();
    let collider = world.colliders.first_mut();
    // Vectors may be negative, but not that large.
    let in_vector = if value < 0.0 { -1e9 } else { value };
    match which {
        0 => world.domain.cell_size = value,
        1 => world.domain.min.y = in_vector,
        2 => world.domain.max.z = in_vector,
        3 => world.gravity.x = in_vector,
        4 => world.settings.dt = value,
        5 => world.settings.max_displacement = value,
        6 => world.settings.max_fill = value,
        7 => world.settings.volume_correction_time = value,
        8 => world.settings.tension_limit = value,
        9 => world.materials[0].rest_density = value,
        10 => world.materials[0].relaxation = value,
        11 => world.materials[0].viscous_relaxation = value,
        12 => world.materials[0].color[1] = value as f32,
        13 => world.domain.walls.y_min = Wall::Friction(value),
        14..=20 => match (which, spawn) {
            (14, Some(s)) => s.position.x = in_vector,
            (15, Some(s)) => s.velocity.y = in_vector,
            (16, Some(s)) => s.jitter = value,
            (17, Some(s)) => s.fill = Fill::PerCell(value),
            (18, Some(s)) => s.fill = Fill::Spacing(value),
            (19, Some(s)) => s.shape = Shape::Sphere { radius: value },
            (20, Some(s)) => s.rotation.z = in_vector,
            _ => return false,
        },
        _ => match (which, collider) {
            (21, Some(c)) => c.position.y = in_vector,
            (22, Some(c)) => c.linear_velocity.x = in_vector,
            (23, Some(c)) => c.angular_velocity.z = in_vector,
            (24, Some(c)) => c.boundary = Boundary::Friction(value),
            (25, Some(c)) => c.shape = Shape::Box { half_size: DVec3::new(1.0, value, 1.0) },
            (26, Some(c)) => c.rotation.w = in_vector,
            _ => return false,
        },
    }
    true
}

fn random_broken_worlds_are_refused() {
    let bad = prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), -1e3..-1e-3];
    let mut spoilt = 0;
    let result = runner().run(&(world(), prop::collection::vec((0usize..27, bad), 1..4)), |(mut world, changes)| {
        let changed = changes.into_iter().filter(|(which, value)| spoil(&mut world, *which, *value)).count();
        if changed > 0 {
            let invalid = |result: Result<(), Error>| matches!(result, Err(Error::Invalid { .. }));
            prop_assert!(invalid(world.validate()));
            prop_assert!(invalid(world.particle_count().map(drop)));
            prop_assert!(invalid(CpuSolver::<f32>::new(&world).map(drop)));
            prop_assert!(invalid(GpuSolver::required_limits(&world, &GpuOptions::default()).map(drop)));
        }
        Ok(())
    });
    result.unwrap_or_else(|e| panic!("{e}"));
    // Each field by itself, so that none is only ever refused for another's sake.
    for which in 0..27 {
        let mut runner = runner();
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
            let mut world = world().new_tree(&mut runner).expect("a world").current();
            if spoil(&mut world, which, value) {
                assert!(matches!(world.validate(), Err(Error::Invalid { .. })), "field {which} with {value}");
                spoilt += 1;
            }
        }
    }
    assert!(spoilt > 80, "{spoilt}");
}

/// Scene text with a byte changed, cut or doubled: a world or an error, never a panic.
fn random_text_is_no_scene() {
    let text = pbmpm::scene::to_json(&crate::worlds::busy());
    let length = text.len();
    let strategy = prop::collection::vec((0..length, any::<u8>(), 0u8..3), 1..4);
    let result = TestRunner::new_with_rng(
        Config { cases: 512, failure_persistence: None, ..Config::default() },
        TestRng::from_seed(RngAlgorithm::ChaCha, &[3; 32]),
    )
    .run(&strategy, |changes| {
        let mut bytes = text.clone().into_bytes();
        for (at, byte, how) in changes {
            let at = at.min(bytes.len() - 1);
            match how {
                0 => bytes[at] = byte & 0x7f,
                1 => drop(bytes.remove(at)),
                _ => bytes.insert(at, byte & 0x7f),
            }
        }
        let changed = String::from_utf8(bytes).expect("ASCII stays ASCII");
        if let Ok(world) = pbmpm::scene::from_json(&changed) {
            prop_assert_eq!(world.validate(), Ok(()));
        }
        Ok(())
    });
    result.unwrap_or_else(|e| panic!("{e}"));
}
