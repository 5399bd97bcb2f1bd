//! Random worlds: valid ones run, broken ones are refused, and nothing panics.

use crate::backends::Tests;
use crate::random::{Host, world};
use crate::worlds::larger;
use pbmpm::{
    Action, Boundary, CpuSolver, DVec3, Emitter, Error, Fate, Fill, GpuOptions, GpuSolver, Model, Motion, Particle,
    Rate, Shape, Simulate, Spawn, Wall, World,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::cell::Cell;

pub fn add(tests: &mut Tests) {
    tests.once("bad_worlds", "random_valid_worlds_run", random_valid_worlds_run);
    tests.once("bad_worlds", "random_broken_worlds_are_refused", random_broken_worlds_are_refused);
    tests.once("bad_worlds", "random_text_is_no_scene", random_text_is_no_scene);
}

/// The same cases in every run, so that a failure can be reproduced: 128, or as many as `PBMPM_PROPTEST_CASES` states.
/// `PBMPM_PROPTEST_SEED` draws others.
fn runner() -> TestRunner {
    let cases = std::env::var("PBMPM_PROPTEST_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(128);
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let mut seed = [7; 32];
    if let Some(n) = std::env::var("PBMPM_PROPTEST_SEED").ok().and_then(|text| text.parse::<u64>().ok()) {
        seed[..8].copy_from_slice(&n.to_le_bytes());
    }
    TestRunner::new_with_rng(config, TestRng::from_seed(RngAlgorithm::ChaCha, &seed))
}

/// Mass of each particle of a spawn.
fn mass(world: &World, spawn: &Spawn) -> f64 {
    let spacing = match spawn.fill {
        Fill::PerCell(n) => world.domain.cell_size / n.cbrt(),
        Fill::Spacing(s) => s,
        _ => unreachable!("none are drawn"),
    };
    let steps = match spawn.shape {
        Shape::Box { half_size } => {
            let edges = 2.0 * half_size;
            (edges / (edges / spacing).round().max(DVec3::ONE)).max(DVec3::splat(0.25 * spacing))
        }
        _ => DVec3::splat(spacing),
    };
    steps.element_product() * density(world, &spawn.material)
}

fn density(world: &World, material: &str) -> f64 {
    world.materials.iter().find(|m| m.name == material).expect("a known material").rest_density
}

/// Whether particles were refused for being too light beside others.
fn too_light(error: &Error) -> bool {
    matches!(error, Error::Invalid { field, .. } if field == "mass of the lightest particle")
}

/// 5 steps, during which a host wields tools, adds, removes and changes rates: all numbers are finite, every particle
/// is accounted for and has a mass that particles are made with, nothing is outside. Returns how many particles came
/// and went, by reason.
fn runs(world: &World, host: &Host, mut solver: impl Simulate) -> Result<[u64; 6], TestCaseError> {
    let fates = |particles: &[Particle], fate| particles.iter().filter(|p| p.fate == fate).count() as u64;
    let before = solver.particles().unwrap();
    let spawned = fates(&before, Fate::Alive);
    prop_assert_eq!(spawned, world.particle_count().unwrap() as u64);
    prop_assert_eq!(before.len(), world.capacity().unwrap());
    solver.steps(2).unwrap();
    solver.set_tools(&host.tools).unwrap();
    (0..world.emitters.len()).for_each(|i| solver.set_emission(i, host.rate).unwrap());
    let added = match solver.add(&host.spawn) {
        Ok(added) => added,
        Err(e) if too_light(&e) => 0,
        Err(e) => {
            let named = world.spawns.iter().map(|s| &s.material).chain(world.emitters.iter().map(|e| &e.material));
            let named: Vec<_> = named.collect();
            let stated = world.settings.capacity.is_some() || named.is_empty();
            let absent = !stated && !named.contains(&&host.spawn.material);
            let field = if absent { "spawn.material" } else { "spawn.fill" };
            prop_assert!(matches!(&e, Error::Invalid { field: found, .. } if found == field), "{}", e);
            0
        }
    };
    solver.step().unwrap();
    solver.remove(&host.region).unwrap();
    solver.step().unwrap();
    // Particles that are there at the end have taken a step.
    (0..world.emitters.len()).for_each(|i| solver.set_emission(i, Rate::Particles(0.0)).unwrap());
    solver.step().unwrap();

    let particles = solver.particles().unwrap();
    let report = solver.report().unwrap();
    let faults = report.faults;
    prop_assert_eq!(faults.quarantined, 0);
    let balance = spawned + report.emitted - report.drained - faults.escaped;
    prop_assert_eq!((u64::from(report.alive), fates(&particles, Fate::Alive)), (balance, balance), "{:?}", report);
    prop_assert!(fates(&particles, Fate::Escaped) <= faults.escaped, "{:?}", report);
    prop_assert!(fates(&particles, Fate::Drained) <= report.drained, "{:?}", report);
    let due: f64 = world.emitters.iter().map(|e| due(world, host, e)).sum();
    let seen = (report.emitted + report.withheld + faults.refused - added as u64) as f64;
    prop_assert!((seen - due).abs() <= world.emitters.len() as f64 + 1e-3, "{} due: {:?}", due, report);

    let emitted =
        world.emitters.iter().map(|e| world.domain.cell_size.powi(3) / e.per_cell * density(world, &e.material));
    let masses: Vec<_> = world.spawns.iter().chain([&host.spawn]).map(|s| mass(world, s)).chain(emitted).collect();
    // Positions are converted from cells in f32.
    let slack = 1e-5 * (world.domain.max - world.domain.min).max_element();
    let (lo, hi) = (world.domain.min - slack, world.domain.max + slack);
    for p in particles.iter().filter(|p| p.fate != Fate::Vacant) {
        let finite = p.position.is_finite() && p.velocity.is_finite() && p.velocity_gradient.is_finite();
        prop_assert!(finite && p.volume_ratio.is_finite(), "{:?}", p);
        prop_assert!(masses.iter().any(|m| (p.mass / m - 1.0).abs() < 1e-6), "{:?} of {:?}", p, masses);
        prop_assert!(p.position.clamp(lo, hi) == p.position, "{:?}", p);
        let cells = p.velocity.length() * world.settings.dt / world.domain.cell_size;
        prop_assert!(cells <= world.settings.max_displacement * 1.0001, "{} cells in a step", cells);
    }
    let dt = world.settings.dt;
    let densest = world.materials.iter().map(|m| m.rest_density).fold(0.0, larger);
    for (sensor, reading) in world.sensors.iter().zip(solver.sensors().unwrap()) {
        let pose = sensor.pose(solver.time());
        let within = |slack: f64| {
            let inside = |p: &&Particle| {
                let distance = sensor.shape.signed_distance(pose.rotation.inverse() * (p.position - pose.position));
                p.fate == Fate::Alive && (if sensor.inverted { -distance } else { distance }) < slack
            };
            particles.iter().filter(inside).fold((0, 0.0), |(count, mass), p| (count + 1, mass + p.mass))
        };
        let (least, most) = (within(-slack), within(slack));
        prop_assert!((least.0..=most.0).contains(&reading.count), "{:?}: {:?} to {:?}", reading, least, most);
        // Each particle's share is rounded to 2⁻³¹ of a cell of the densest material.
        let unit = f64::from(most.0) * densest * world.domain.cell_size.powi(3) / f64::from(1u32 << 31);
        let right = reading.mass >= least.1 * (1.0 - 1e-6) - unit && reading.mass <= most.1 * (1.0 + 1e-6) + unit;
        prop_assert!(right, "{:?}: {:?} to {:?}", reading, least, most);
        let cells = reading.momentum.length() * dt / world.domain.cell_size;
        let fastest = world.settings.max_displacement * 1.0001;
        prop_assert!(cells <= most.1 * fastest + 2.0 * unit, "{:?}: {:?}", reading, most);
    }
    let mut pushed = 0;
    let loads = solver.loads().unwrap();
    for (i, collider) in world.colliders.iter().enumerate() {
        let load = loads.of(i);
        prop_assert_eq!(load.is_some(), collider.measure);
        let load = load.unwrap_or_default();
        prop_assert!(load.impulse.is_finite() && load.angular_impulse.is_finite(), "{:?}", load);
        pushed += u64::from(load.impulse != DVec3::ZERO);
    }
    Ok([report.emitted, report.drained, report.withheld, faults.refused, faults.escaped, pushed])
}

/// Number of particles that an emitter should emit in the first two steps at its own rate, and in the next two at the
/// host's.
fn due(world: &World, host: &Host, emitter: &Emitter) -> f64 {
    let dt = world.settings.dt;
    let span = |from: f64, to: f64| to.min(emitter.end.unwrap_or(to)) - from.max(emitter.start);
    let changed = Emitter { rate: host.rate, ..emitter.clone() };
    let rates = [emitter, &changed].map(|e| e.particles_per_second(world.domain.cell_size));
    rates[0] * span(0.0, 2.0 * dt).max(0.0) + rates[1] * span(2.0 * dt, 4.0 * dt).max(0.0)
}

fn random_valid_worlds_run() {
    let seen = Cell::new([0; 6]);
    let result = runner().run(&world(), |(world, host)| {
        prop_assert_eq!(world.validate(), Ok(()));
        // A spawn may happen to lie within a body, which is an error.
        let buried =
            |e: &Error| matches!(e, Error::Invalid { allowed, .. } if allowed.contains("outside of the colliders"));
        prop_assume!(!world.particle_count().is_err_and(|e| buried(&e)));
        prop_assume!(!CpuSolver::<f32>::new(&world).is_err_and(|e| too_light(&e)));
        let failed = |e: Error| TestCaseError::fail(e.to_string());
        let came = runs(&world, &host, CpuSolver::<f32>::new(&world).map_err(failed)?)?;
        seen.set(std::array::from_fn(|i| seen.get()[i] + came[i]));
        runs(&world, &host, CpuSolver::<f64>::new(&world).map_err(failed)?)?;
        prop_assert!(GpuSolver::required_limits(&world, &GpuOptions::default()).is_ok());
        prop_assert_eq!(pbmpm::scene::from_json(&pbmpm::scene::to_json(&world)), Ok(world));
        Ok(())
    });
    result.unwrap_or_else(|e| panic!("{e}"));
    let seen = seen.get();
    assert!(seen.iter().all(|n| *n >= 10), "emitted, drained, withheld, refused, escaped, pushed: {seen:?}");
}

/// Puts a value into a field; `None` if the world has no such field.
type Spoil = fn(&mut World, f64) -> Option<()>;

/// Components of vectors may be negative, but not this large.
fn far(value: f64) -> f64 {
    if value < 0.0 { -1e9 } else { value }
}

fn steady(value: f64) -> Option<Motion> {
    Some(Motion::Steady { linear_velocity: DVec3::Y * far(value), angular_velocity: DVec3::ZERO })
}

macro_rules! fields {
    ($($name:literal: |$world:ident, $value:ident| $target:expr => $new:expr;)*) => {
        &[$(($name, |$world, $value| { $target = $new; Some(()) })),*]
    };
}

/// Fields that allow neither NaN, infinities nor negative numbers, by the names that errors use.
#[rustfmt::skip]
const FIELDS: &[(&str, Spoil)] = fields![
    "domain.cell_size": |w, x| w.domain.cell_size => x;
    "domain.min": |w, x| w.domain.min.y => far(x);
    "domain.max": |w, x| w.domain.max.z => far(x);
    "domain.walls.y_min": |w, x| w.domain.walls.y_min => Wall::Friction(x);
    "gravity": |w, x| w.gravity.x => far(x);
    "settings.dt": |w, x| w.settings.dt => x;
    "settings.max_displacement": |w, x| w.settings.max_displacement => x;
    "settings.max_fill": |w, x| w.settings.max_fill => x;
    "settings.volume_correction_time": |w, x| w.settings.volume_correction_time => x;
    "settings.tolerance": |w, x| w.settings.tolerance => x;
    "settings.bulk_limit": |w, x| w.settings.bulk_limit => Some(x);
    "settings.courant": |w, x| w.settings.courant => x;
    "settings.tension_limit": |w, x| w.settings.tension_limit => x;
    "materials[0].rest_density": |w, x| w.materials[0].rest_density => x;
    "materials[0].relaxation": |w, x| w.materials[0].relaxation => x;
    "materials[0].viscous_relaxation": |w, x| w.materials[0].viscous_relaxation => x;
    "materials[0].bulk_modulus": |w, x| w.materials[0].bulk_modulus => x;
    "materials[0].viscosity": |w, x| w.materials[0].viscosity => x;
    "materials[0].youngs_modulus": |w, x| w.materials[0].youngs_modulus => x;
    "materials[0].poisson_ratio": |w, x| w.materials[0].poisson_ratio => x;
    "materials[0].yield_stress": |w, x| w.materials[0].yield_stress => Some(x);
    "materials[0].model.elastic.shape_weight": |w, x| w.materials[0].model => Model::Elastic { shape_weight: x };
    "materials[0].model.viscoplastic.yield_strain": |w, x| w.materials[0].model => Model::Viscoplastic { yield_strain: x };
    "materials[0].color": |w, x| w.materials[0].color[1] => x as f32;
    "spawns[0].position": |w, x| w.spawns.first_mut()?.position.x => far(x);
    "spawns[0].velocity": |w, x| w.spawns.first_mut()?.velocity.y => far(x);
    "spawns[0].jitter": |w, x| w.spawns.first_mut()?.jitter => x;
    "spawns[0].fill.per_cell": |w, x| w.spawns.first_mut()?.fill => Fill::PerCell(x);
    "spawns[0].fill.spacing": |w, x| w.spawns.first_mut()?.fill => Fill::Spacing(x);
    "spawns[0].shape.sphere.radius": |w, x| w.spawns.first_mut()?.shape => Shape::Sphere { radius: x };
    "spawns[0].rotation": |w, x| w.spawns.first_mut()?.rotation.z => far(x);
    "colliders[0].position": |w, x| w.colliders.first_mut()?.position.y => far(x);
    "colliders[0].linear_velocity": |w, x| w.colliders.first_mut()?.linear_velocity.x => far(x);
    "colliders[0].angular_velocity": |w, x| w.colliders.first_mut()?.angular_velocity.z => far(x);
    "colliders[0].boundary": |w, x| w.colliders.first_mut()?.boundary => Boundary::Friction(x);
    "colliders[0].shape.box.half_size": |w, x| w.colliders.first_mut()?.shape => Shape::Box { half_size: DVec3::new(1.0, x, 1.0) };
    "colliders[0].rotation": |w, x| w.colliders.first_mut()?.rotation.w => far(x);
    "emitters[0].position": |w, x| w.emitters.first_mut()?.position.z => far(x);
    "emitters[0].rotation": |w, x| w.emitters.first_mut()?.rotation.x => far(x);
    "emitters[0].velocity": |w, x| w.emitters.first_mut()?.velocity.y => far(x);
    "emitters[0].rate.particles": |w, x| w.emitters.first_mut()?.rate => Rate::Particles(x);
    "emitters[0].rate.litres": |w, x| w.emitters.first_mut()?.rate => Rate::Litres(x);
    "emitters[0].per_cell": |w, x| w.emitters.first_mut()?.per_cell => x;
    "emitters[0].fill_limit": |w, x| w.emitters.first_mut()?.fill_limit => x;
    "emitters[0].start": |w, x| w.emitters.first_mut()?.start => x;
    "emitters[0].end": |w, x| w.emitters.first_mut()?.end => Some(x);
    "emitters[0].shape.capsule.half_height": |w, x| w.emitters.first_mut()?.shape => Shape::Capsule { radius: 1.0, half_height: x };
    "emitters[0].motion.steady.linear_velocity": |w, x| w.emitters.first_mut()?.motion => steady(x);
    "drains[0].position": |w, x| w.drains.first_mut()?.position.x => far(x);
    "drains[0].rotation": |w, x| w.drains.first_mut()?.rotation.y => far(x);
    "drains[0].shape.cylinder.radius": |w, x| w.drains.first_mut()?.shape => Shape::Cylinder { radius: x, half_height: 1.0 };
    "drains[0].motion.steady.linear_velocity": |w, x| w.drains.first_mut()?.motion => steady(x);
    "sensors[0].position": |w, x| w.sensors.first_mut()?.position.z => far(x);
    "sensors[0].rotation": |w, x| w.sensors.first_mut()?.rotation.w => far(x);
    "sensors[0].shape.sphere.radius": |w, x| w.sensors.first_mut()?.shape => Shape::Sphere { radius: x };
    "sensors[0].motion.steady.linear_velocity": |w, x| w.sensors.first_mut()?.motion => steady(x);
    "tools[0].position": |w, x| w.tools.first_mut()?.position.y => far(x);
    "tools[0].radius": |w, x| w.tools.first_mut()?.radius => x;
    "tools[0].start": |w, x| w.tools.first_mut()?.start => 10.0 * far(x);
    "tools[0].end": |w, x| w.tools.first_mut()?.end => Some(far(x));
    "tools[0].motion.steady.linear_velocity": |w, x| w.tools.first_mut()?.motion => steady(x);
    "tools[0].action.push.acceleration": |w, x| w.tools.first_mut()?.action => Action::Push { acceleration: DVec3::Z * far(x) };
    "tools[0].action.sweep.acceleration": |w, x| w.tools.first_mut()?.action => Action::Sweep { acceleration: far(x) };
    "tools[0].action.attract.acceleration": |w, x| w.tools.first_mut()?.action => Action::Attract { acceleration: far(x) };
    "tools[0].action.grab.time": |w, x| w.tools.first_mut()?.action => Action::Grab { time: x };
    "tools[0].action.stir.time": |w, x| w.tools.first_mut()?.action => Action::Stir { angular_velocity: DVec3::Y, time: x };
    "tools[0].action.stir.angular_velocity": |w, x| w.tools.first_mut()?.action => Action::Stir { angular_velocity: DVec3::X * far(x), time: 0.0 };
];

/// The field that an error names.
fn blamed<T>(result: Result<T, Error>) -> Option<String> {
    match result {
        Err(Error::Invalid { field, .. }) => Some(field),
        _ => None,
    }
}

fn random_broken_worlds_are_refused() {
    let bad = prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY), -1e3..-1e-3];
    let changes = prop::collection::vec((0..FIELDS.len(), bad), 1..4);
    let result = runner().run(&(world(), changes), |((mut world, _), changes)| {
        let spoilt = changes.into_iter().filter(|(which, value)| FIELDS[*which].1(&mut world, *value).is_some());
        let spoilt: Vec<_> = spoilt.map(|(which, _)| FIELDS[which].0).collect();
        if !spoilt.is_empty() {
            let found = blamed(world.validate());
            prop_assert!(found.as_deref().is_some_and(|field| spoilt.contains(&field)), "{:?}: {:?}", spoilt, found);
            prop_assert_eq!(&blamed(world.particle_count()), &found);
            prop_assert_eq!(&blamed(CpuSolver::<f32>::new(&world)), &found);
            prop_assert_eq!(&blamed(GpuSolver::required_limits(&world, &GpuOptions::default())), &found);
        }
        Ok(())
    });
    result.unwrap_or_else(|e| panic!("{e}"));
    // Each field separately, so that none is refused only because of another.
    let mut runner = runner();
    let worlds: Vec<World> = (0..8).map(|_| world().new_tree(&mut runner).expect("a world").current().0).collect();
    for (name, spoil) in FIELDS {
        let mut spoilt = 0;
        for world in &worlds {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
                let mut world = world.clone();
                if spoil(&mut world, value).is_some() {
                    assert_eq!(blamed(world.validate()).as_deref(), Some(*name), "with {value}");
                    spoilt += 1;
                }
            }
        }
        assert!(spoilt >= 8, "{name}: {spoilt}");
    }
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
