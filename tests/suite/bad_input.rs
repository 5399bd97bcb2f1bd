//! Invalid input is refused by every entry point, with the name of the field, and changes nothing.

use crate::backends::{Backend, CPUS, MOST, NATIVE, Tests};
use crate::worlds::{after, ball, block, body, busy, capsule, cuboid, cylinder, empty, particles};
use pbmpm::scene;
use pbmpm::{
    Boundary, Camera, Collider, CpuSolver, DQuat, DVec3, Error, Fill, FixedStep, GpuOptions, GpuSolver, Material,
    Model, Motion, Pose, Scheme, Shape, Simulate, Sleep, Spawn, Tuning, UVec3, Wall, World, state_hash,
};

pub fn add(tests: &mut Tests) {
    tests.once("bad_input", "every_field_of_a_world", every_field_of_a_world);
    tests.once("bad_input", "options_of_a_device", options_of_a_device);
    tests.once("bad_input", "scenes", scenes);
    tests.once("bad_input", "fixed_step", fixed_step);
    tests.each("bad_input", CPUS, "limits_themselves_are_allowed", limits_themselves_are_allowed);
    tests.each("bad_input", MOST, "changes_between_steps", changes_between_steps);
    tests.each("bad_input", MOST, "particles_too_light_for_the_sums", particles_too_light_for_the_sums);
    tests.each("bad_input", NATIVE, "a_world_that_a_device_refuses", a_world_that_a_device_refuses);
}

const NAN: f64 = f64::NAN;
const INF: f64 = f64::INFINITY;

/// Two materials, a spawn of each, a collider of each shape, a camera.
fn full() -> World {
    let mut world = busy();
    world.colliders.push(body(Shape::HalfSpace, [0.0, 0.5, 0.0]));
    world.camera = Some(Camera::overlooking(&world.domain));
    world
}

fn field(error: &Error) -> &str {
    match error {
        Error::Invalid { field, .. } => field,
        other => panic!("{other:?}"),
    }
}

/// Gives a body an oscillation: amplitude along y, frequency, phase, angular amplitude about x.
fn swing(world: &mut World, way: f64, frequency: f64, phase: f64, turn: f64) {
    let (amplitude, angular_amplitude) = (DVec3::Y * way, DVec3::X * turn);
    world.colliders[2].motion = Some(Motion::Oscillate { amplitude, frequency, phase, angular_amplitude });
}

/// Gives a body keyframes: times, positions along x, rotations about y.
fn keys(world: &mut World, times: &[f64], ways: &[f64], turns: &[f64], repeat: bool) {
    world.colliders[1].motion = Some(Motion::Keyframes {
        times: times.to_vec(),
        positions: ways.iter().map(|&x| DVec3::new(x, 0.0, 0.0)).collect(),
        rotations: turns.iter().map(|&a| DQuat::from_rotation_y(a)).collect(),
        repeat,
    });
}

type Break = (&'static str, fn(&mut World));

const BROKEN: &[Break] = &[
    ("domain.cell_size", |w| w.domain.cell_size = 0.0),
    ("domain.cell_size", |w| w.domain.cell_size = NAN),
    ("domain.cell_size", |w| w.domain.cell_size = -0.02),
    ("domain.cell_size", |w| w.domain.cell_size = 2e4),
    ("domain.cell_size", |w| w.domain.cell_size = 1e-5), // too many cells
    ("domain.min", |w| w.domain.min.y = NAN),
    ("domain.min", |w| w.domain.min.x = -INF),
    ("domain.max", |w| w.domain.max.z = 2e6),
    ("domain.max", |w| w.domain.max.z = w.domain.min.z),
    ("domain.max", |w| w.domain.max.y = -1.0),
    ("domain.walls.x_min", |w| w.domain.walls.x_min = Wall::Friction(-0.1)),
    ("domain.walls.y_max", |w| w.domain.walls.y_max = Wall::Friction(NAN)),
    ("domain.walls.z_max", |w| w.domain.walls.z_max = Wall::Friction(10.1)),
    ("gravity", |w| w.gravity.x = NAN),
    ("gravity", |w| w.gravity.y = -1.1e6),
    ("materials", |w| w.materials = (0..257).map(|i| Material::liquid(format!("{i}"))).collect()),
    ("materials[0].name", |w| w.materials[0].name.clear()),
    ("materials[1].name", |w| w.materials[1].name = "water".to_owned()),
    ("materials[1].rest_density", |w| w.materials[1].rest_density = 0.0),
    ("materials[1].rest_density", |w| w.materials[1].rest_density = INF),
    ("materials[0].relaxation", |w| w.materials[0].relaxation = 1.91),
    ("materials[0].relaxation", |w| w.materials[0].relaxation = -1e-9),
    ("materials[1].bulk_modulus", |w| w.materials[1].bulk_modulus = 0.0),
    ("materials[0].viscosity", |w| w.materials[0].viscosity = NAN),
    ("materials[0].model", |w| {
        w.materials[0].model = Model::Sand { friction_angle: 30.0 };
        w.settings.scheme = Scheme::Implicit;
    }),
    ("materials[0].youngs_modulus", |w| w.materials[0].youngs_modulus = 0.0),
    ("materials[1].poisson_ratio", |w| w.materials[1].poisson_ratio = 0.5),
    ("materials[1].poisson_ratio", |w| w.materials[1].poisson_ratio = -0.1),
    ("materials[0].yield_stress", |w| w.materials[0].yield_stress = Some(NAN)),
    ("settings.dt", |w| {
        w.settings.scheme = Scheme::Implicit;
        w.settings.iterations = 2;
        // Gravity moves matter by more than one cell in a step.
        w.settings.dt = 1.001 * (w.domain.cell_size / w.gravity.length()).sqrt();
    }),
    ("settings.dt", |w| {
        w.materials[0].model = Model::Elastic { shape_weight: 1.0 };
        w.settings.scheme = Scheme::Explicit;
    }),
    ("settings.dt", |w| {
        w.materials[1].model = Model::Sand { friction_angle: 30.0 };
        w.settings.scheme = Scheme::Explicit;
        w.settings.dt = 1.001 * w.stable_dt();
    }),
    ("materials[0].youngs_modulus", |w| {
        w.materials[0].model = Model::Elastic { shape_weight: 1.0 };
        w.materials[0].youngs_modulus = 1e12;
        w.settings.scheme = Scheme::Explicit;
    }),
    ("materials[0].viscous_relaxation", |w| w.materials[0].viscous_relaxation = 1.1),
    ("materials[0].viscous_relaxation", |w| w.materials[0].viscous_relaxation = NAN),
    ("materials[1].color", |w| w.materials[1].color[2] = f32::NAN),
    ("materials[1].color", |w| w.materials[1].color[0] = 1.5),
    ("spawns[0].material", |w| w.spawns[0].material = "wine".to_owned()),
    ("spawns[1].material", |w| w.materials.truncate(1)),
    ("spawns[0].shape", |w| w.spawns[0].shape = Shape::HalfSpace),
    ("spawns[0].shape.box.half_size", |w| w.spawns[0].shape = cuboid([1.0, -1.0, 1.0])),
    ("spawns[0].shape.box.half_size", |w| w.spawns[0].shape = cuboid([1.0, NAN, 1.0])),
    ("spawns[0].shape.sphere.radius", |w| w.spawns[0].shape = ball(0.0)),
    ("spawns[0].shape.capsule.radius", |w| w.spawns[0].shape = capsule(-1.0, 1.0)),
    ("spawns[0].shape.capsule.half_height", |w| w.spawns[0].shape = capsule(1.0, 0.0)),
    ("spawns[0].shape.cylinder.radius", |w| w.spawns[0].shape = cylinder(INF, 1.0)),
    ("spawns[0].shape.cylinder.half_height", |w| w.spawns[0].shape = cylinder(1.0, NAN)),
    ("spawns[1].position", |w| w.spawns[1].position.z = NAN),
    ("spawns[1].rotation", |w| w.spawns[1].rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.9)),
    ("spawns[1].rotation", |w| w.spawns[1].rotation.x = NAN),
    ("spawns[1].velocity", |w| w.spawns[1].velocity.x = INF),
    ("spawns[1].velocity", |w| w.spawns[1].velocity.x = 1.1e6),
    ("spawns[1].angular_velocity", |w| w.spawns[1].angular_velocity.z = NAN),
    ("materials[0].model.elastic.shape_weight", |w| w.materials[0].model = Model::Elastic { shape_weight: 1.1 }),
    ("materials[0].model.sand.friction_angle", |w| w.materials[0].model = Model::Sand { friction_angle: 61.0 }),
    ("materials[0].model.viscoplastic.yield_strain", |w| {
        w.materials[0].model = Model::Viscoplastic { yield_strain: -0.1 };
    }),
    ("spawns[1].jitter", |w| w.spawns[1].jitter = 0.51),
    ("spawns[1].jitter", |w| w.spawns[1].jitter = -0.1),
    ("spawns[0].fill.per_cell", |w| w.spawns[0].fill = Fill::PerCell(0.0)),
    ("spawns[0].fill.per_cell", |w| w.spawns[0].fill = Fill::PerCell(NAN)),
    ("spawns[0].fill.spacing", |w| w.spawns[0].fill = Fill::Spacing(0.0)),
    ("spawns[0].fill.spacing", |w| w.spawns[0].fill = Fill::Spacing(-0.01)),
    ("spawns[0].fill.inclusive", |w| w.spawns[0].fill = Fill::Inclusive(UVec3::new(1, 4, 4))),
    ("spawns[0].fill.inclusive", |w| w.spawns[0].fill = Fill::Inclusive(UVec3::splat(4097))),
    ("spawns[0].fill.inclusive", |w| {
        w.spawns[0].shape = ball(2.0);
        w.spawns[0].fill = Fill::Inclusive(UVec3::splat(4));
    }),
    ("spawns[0].fill", |w| w.spawns[0].fill = Fill::Spacing(1e-6)), // 10¹⁵ particles
    ("spawns[1].fill", |w| w.spawns[1].fill = Fill::Inclusive(UVec3::splat(4096))),
    ("colliders", |w| w.colliders = vec![w.colliders[0].clone(); 4097]),
    ("colliders[0].shape.box.half_size", |w| w.colliders[0].shape = cuboid([0.0, 1.0, 1.0])),
    ("colliders[1].shape.sphere.radius", |w| w.colliders[1].shape = ball(INF)),
    ("colliders[1].position", |w| w.colliders[1].position.x = NAN),
    ("colliders[0].rotation", |w| w.colliders[0].rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
    ("colliders[2].linear_velocity", |w| w.colliders[2].linear_velocity.y = NAN),
    ("colliders[2].angular_velocity", |w| w.colliders[2].angular_velocity.y = 1.1e4),
    ("colliders[0].angular_velocity", |w| w.colliders[0].angular_velocity.y = 380.0), // more than half a turn per step
    ("colliders[2].motion.oscillate.amplitude", |w| swing(w, INF, 1.0, 0.0, 0.1)),
    ("colliders[2].motion.oscillate.frequency", |w| swing(w, 0.1, -1.0, 0.0, 0.1)),
    ("colliders[2].motion.oscillate.frequency", |w| swing(w, 1e5, 100.0, 0.0, 0.1)), // too fast
    ("colliders[2].motion.oscillate.phase", |w| swing(w, 0.1, 1.0, NAN, 0.1)),
    ("colliders[2].motion.oscillate.angular_amplitude", |w| swing(w, 0.1, 1.0, 0.0, NAN)),
    ("colliders[2].motion.oscillate.angular_amplitude", |w| swing(w, 0.1, 61.0, 0.0, 1.0)), // 1.02 half turns per step
    ("colliders[2].linear_velocity", |w| {
        swing(w, 0.1, 1.0, 0.0, 0.1);
        w.colliders[2].linear_velocity.x = 1.0;
    }),
    ("colliders[2].angular_velocity", |w| {
        swing(w, 0.1, 1.0, 0.0, 0.1);
        w.colliders[2].angular_velocity.x = 1.0;
    }),
    ("colliders[1].motion.keyframes.times", |w| keys(w, &[], &[], &[], false)),
    ("colliders[1].motion.keyframes.times", |w| keys(w, &[0.0], &[0.0], &[], true)),
    ("colliders[1].motion.keyframes.times", |w| keys(w, &vec![0.0; 65537], &[], &[], false)),
    ("colliders[1].motion.keyframes.times[1]", |w| keys(w, &[1.0, 1.0], &[0.0, 0.0], &[], false)),
    ("colliders[1].motion.keyframes.times[2]", |w| keys(w, &[0.0, 2.0, 1.0], &[0.0; 3], &[], false)),
    ("colliders[1].motion.keyframes.times[0]", |w| keys(w, &[NAN, 1.0], &[0.0; 2], &[], false)),
    ("colliders[1].motion.keyframes.times[1]", |w| keys(w, &[0.0, INF], &[0.0; 2], &[], false)),
    ("colliders[1].motion.keyframes.positions", |w| keys(w, &[0.0, 1.0], &[0.0], &[], false)),
    ("colliders[1].motion.keyframes.positions[1]", |w| keys(w, &[0.0, 1.0], &[0.0, NAN], &[], false)),
    ("colliders[1].motion.keyframes.positions[1]", |w| keys(w, &[0.0, 1e-9], &[0.0, 1.0], &[], false)), // too fast
    ("colliders[1].motion.keyframes.positions[1]", |w| keys(w, &[0.0, 1.0], &[0.0, 0.1], &[], true)),
    ("colliders[1].motion.keyframes.rotations", |w| keys(w, &[0.0, 1.0], &[0.0; 2], &[0.0], false)),
    ("colliders[1].motion.keyframes.rotations[0]", |w| keys(w, &[0.0, 1.0], &[0.0; 2], &[NAN, 0.0], false)),
    ("colliders[1].motion.keyframes.rotations[1]", |w| keys(w, &[0.0, 1.0], &[0.0; 2], &[0.0, 0.1], true)),
    ("colliders[1].motion.keyframes.rotations", |w| keys(w, &[0.0, 0.004], &[0.0; 2], &[0.0, 1.7], false)),
    ("colliders[0].boundary", |w| w.colliders[0].boundary = Boundary::Friction(-1.0)),
    ("camera.position", |w| w.camera.as_mut().unwrap().position.x = NAN),
    ("camera.target", |w| w.camera.as_mut().unwrap().target.y = INF),
    ("camera.target", |w| w.camera.as_mut().unwrap().target = w.camera.unwrap().position),
    ("camera.vertical_fov", |w| w.camera.as_mut().unwrap().vertical_fov = 0.5),
    ("settings.dt", |w| w.settings.dt = 0.0),
    ("settings.dt", |w| w.settings.dt = 0.21),
    ("settings.dt", |w| w.settings.dt = NAN),
    ("settings.iterations", |w| w.settings.iterations = 0),
    ("settings.iterations", |w| w.settings.iterations = 1001),
    ("settings.max_displacement", |w| w.settings.max_displacement = 0.4),
    ("settings.max_displacement", |w| w.settings.max_displacement = INF),
    ("settings.max_fill", |w| w.settings.max_fill = 1.0),
    ("settings.max_fill", |w| w.settings.max_fill = 4097.0),
    ("settings.volume_correction_time", |w| w.settings.volume_correction_time = 0.0),
    ("settings.sleep.speed", |w| w.settings.sleep = Some(Sleep { speed: -1.0, time: 1.0 })),
    ("settings.sleep.speed", |w| w.settings.sleep = Some(Sleep { speed: NAN, time: 1.0 })),
    ("settings.sleep.time", |w| w.settings.sleep = Some(Sleep { speed: 0.1, time: 1001.0 })),
    ("colliders[0].measure", |w| {
        w.settings.sleep = Some(Sleep { speed: 0.1, time: 1.0 });
        w.colliders[0].measure = true;
    }),
    ("settings.tolerance", |w| w.settings.tolerance = -0.1),
    ("settings.tolerance", |w| w.settings.tolerance = 0.051),
    ("settings.bulk_limit", |w| w.settings.bulk_limit = Some(0.0)),
    ("settings.bulk_limit", |w| w.settings.bulk_limit = Some(f64::NAN)),
    ("settings.courant", |w| w.settings.courant = 0.04),
    ("settings.courant", |w| w.settings.courant = NAN),
    ("settings.courant", |w| w.settings.courant = 17.0),
    ("settings.tension_limit", |w| w.settings.tension_limit = 0.9),
    ("settings.tension_limit", |w| w.settings.tension_limit = NAN),
];

fn every_field_of_a_world() {
    assert_eq!(full().validate(), Ok(()));
    for (expected, spoil) in BROKEN {
        let mut world = full();
        spoil(&mut world);
        let error = world.validate().expect_err(expected);
        assert_eq!(field(&error), *expected, "{error}");
        assert!(error.to_string().starts_with(&format!("{expected} = ")), "{error}");
        assert!(error.to_string().contains("must be "), "{error}");
        // Debug text, because a NaN is not equal to itself.
        let same = format!("{error:?}");
        assert_eq!(format!("{:?}", world.particle_count().unwrap_err()), same);
        assert_eq!(format!("{:?}", CpuSolver::<f32>::new(&world).unwrap_err()), same);
        assert_eq!(format!("{:?}", GpuSolver::required_limits(&world, &GpuOptions::default()).unwrap_err()), same);
    }
    let mut world = full();
    swing(&mut world, 0.1, 59.0, 0.3, 1.0);
    keys(&mut world, &[0.0, 0.5, 1.0], &[0.1, 0.0, 0.1], &[0.0, 1.0, 0.0], true);
    assert_eq!(world.validate(), Ok(()));
    assert_eq!(scene::from_json(&scene::to_json(&world)), Ok(world));
    // Only the particles show that a spawn extends out of the domain.
    let mut world = full();
    world.spawns[1].position.x = 0.0;
    assert_eq!(world.validate(), Ok(()));
    assert_eq!(field(&CpuSolver::<f64>::new(&world).unwrap_err()), "spawns[1]");
    assert_eq!(field(&world.particle_count().unwrap_err()), "spawns[1]");
    // Nor does one vanish inside of a body.
    let mut world = full();
    let around = Collider::new(world.spawns[1].shape.clone(), world.spawns[1].position);
    world.colliders.push(around);
    assert_eq!(world.validate(), Ok(()));
    assert_eq!(field(&CpuSolver::<f64>::new(&world).unwrap_err()), "spawns[1]");
    assert_eq!(field(&world.particle_count().unwrap_err()), "spawns[1]");
}

fn limits_themselves_are_allowed(backend: Backend) {
    type Change = fn(&mut World);
    let changes: [Change; 9] = [
        |w| w.settings.dt = 1e-5,
        |w| w.settings.iterations = 1000,
        |w| w.settings.max_displacement = 16.0,
        |w| w.settings.max_displacement = 0.5,
        |w| w.settings.max_fill = 4096.0,
        |w| w.settings.max_fill = 2.0,
        |w| w.materials[0].relaxation = 1.9,
        |w| w.gravity = DVec3::splat(1e6),
        |w| w.spawns[0].fill = Fill::PerCell(0.01),
    ];
    for change in changes {
        let mut world = empty([8.0, 8.0, 8.0], Wall::Friction(10.0));
        world.spawns.push(block([3.0, 3.0, 3.0], [5.0, 5.0, 5.0], [0.0; 3]));
        change(&mut world);
        crate::worlds::assert_sound(&after(&mut *backend.solver(&world), 2));
    }
}

fn options_of_a_device() {
    let tuned = |tuning| GpuOptions { tuning: Some(tuning), ..GpuOptions::default() };
    for (expected, options) in [
        ("options.steps_in_flight", GpuOptions { steps_in_flight: 3, ..GpuOptions::default() }),
        ("options.steps_in_flight", GpuOptions { steps_in_flight: 1025, ..GpuOptions::default() }),
        ("options.grid_blocks", GpuOptions { grid_blocks: Some(7), ..GpuOptions::default() }),
        ("options.grid_blocks", GpuOptions { grid_blocks: Some((1 << 24) + 1), ..GpuOptions::default() }),
        ("options.tuning.lanes", tuned(Tuning { lanes: 4, ..Tuning::GPU })),
        ("options.tuning.lanes", tuned(Tuning { lanes: 48, ..Tuning::GPU })),
        ("options.tuning.tile_lanes", tuned(Tuning { tile_lanes: 32, ..Tuning::GPU })),
        ("options.tuning.share", tuned(Tuning { share: 0, ..Tuning::GPU })),
        ("options.tuning.share", tuned(Tuning { share: 17, ..Tuning::GPU })),
    ] {
        let error = GpuSolver::required_limits(&full(), &options).unwrap_err();
        assert_eq!(field(&error), expected, "{error}");
    }
}

/// On a device, a world's error is returned before the device is touched.
fn a_world_that_a_device_refuses(backend: Backend) {
    let mut world = full();
    world.materials[0].rest_density = NAN;
    let error = backend.try_solver(&world, &GpuOptions::default()).err().expect("a bad world");
    assert_eq!(field(&error), "materials[0].rest_density");
    let options = GpuOptions { steps_in_flight: 0, ..GpuOptions::default() };
    let error = backend.try_solver(&full(), &options).err().expect("bad options");
    assert_eq!(field(&error), "options.steps_in_flight");
}

fn scenes() {
    let place = |error: Error| match error {
        Error::Scene { path, .. } | Error::Io { path, .. } | Error::Invalid { field: path, .. } => path,
        other => panic!("{other:?}"),
    };
    let good = scene::to_json(&full());
    assert_eq!(scene::from_json(&good), Ok(full()));
    for (from, to, expected) in [
        ("\"dt\": 0.008333333333333333", "\"dt\": 0", "settings.dt"),
        ("\"dt\": 0.008333333333333333", "\"dt\": \"fast\"", "settings.dt"),
        ("\"iterations\": 2", "\"iterations\": -2", "settings.iterations"),
        ("\"gravity\": [", "\"gravity\": [0, ", "gravity"),
        ("\"materials\": [", "\"materials\": [3, ", "materials[0]"),
    ] {
        assert!(good.contains(from), "{from} in {good}");
        assert_eq!(place(scene::from_json(&good.replacen(from, to, 1)).unwrap_err()), expected);
    }
    for text in ["", "{", "[]", "null", "{}", "\u{0}", "{\"domain\": {}}", &good[..good.len() / 2]] {
        assert!(matches!(scene::from_json(text), Err(Error::Scene { .. })), "{text}");
    }
    assert_eq!(place(scene::from_file("/nowhere/scene.json").unwrap_err()), "/nowhere/scene.json");
    let folder = std::env::temp_dir();
    assert!(matches!(scene::from_file(&folder), Err(Error::Io { .. })), "a folder is no scene");
}

fn fixed_step() {
    for (dt, max_steps, expected) in [(0.0, 1, "dt"), (NAN, 1, "dt"), (0.01, 0, "max_steps"), (0.01, 1001, "max_steps")]
    {
        assert_eq!(field(&FixedStep::new(dt, max_steps).unwrap_err()), expected);
    }
    let mut driver = FixedStep::new(0.01, 4).unwrap();
    assert_eq!(field(&driver.set_dt(-1.0).unwrap_err()), "dt");
    assert_eq!(driver.advance(0.02).steps, 2, "an error changed nothing");
}

/// Errors between steps name the field and leave the simulation unchanged.
fn changes_between_steps(backend: Backend) {
    let mut solver = backend.solver(&busy());
    let mut twin = backend.solver(&busy());
    solver.steps(2).unwrap();
    let (still, slow) = (DVec3::ZERO, DVec3::splat(0.1));
    let pose = solver.poses()[0];
    let bad_pose = |position, rotation| Some(Pose { position, rotation });
    type Change<'a> = Box<dyn FnOnce(&mut dyn Simulate) -> pbmpm::Result<()> + 'a>;
    let changes: Vec<(&str, Change<'_>)> = vec![
        ("dt", Box::new(|s| s.set_dt(0.0))),
        ("dt", Box::new(|s| s.set_dt(NAN))),
        ("dt", Box::new(|s| s.set_dt(0.3))),
        ("frame", Box::new(|s| s.plan_frame(-0.01).map(drop))),
        ("frame", Box::new(|s| s.plan_frame(NAN).map(drop))),
        ("frame", Box::new(|s| s.advance(1e-6).map(drop))),
        ("frame", Box::new(|s| s.advance(61.0).map(drop))),
        ("gravity", Box::new(|s| s.set_gravity(DVec3::new(0.0, NAN, 0.0)))),
        ("gravity", Box::new(|s| s.set_gravity(DVec3::new(0.0, -2e6, 0.0)))),
        ("collider", Box::new(|s| s.set_collider(2, None, still, still))),
        ("collider", Box::new(|s| s.set_collider(usize::MAX, None, still, still))),
        ("colliders[0].linear_velocity", Box::new(|s| s.set_collider(0, None, DVec3::splat(NAN), still))),
        ("colliders[1].angular_velocity", Box::new(|s| s.set_collider(1, None, slow, DVec3::splat(2e4)))),
        ("colliders[1].angular_velocity", Box::new(|s| s.set_collider(1, None, slow, DVec3::Y * 400.0))),
        (
            "colliders[0].position",
            Box::new(|s| s.set_collider(0, bad_pose(DVec3::splat(INF), pose.rotation), slow, slow)),
        ),
        (
            "colliders[0].rotation",
            Box::new(|s| s.set_collider(0, bad_pose(still, DQuat::from_xyzw(1.0, 1.0, 0.0, 0.0)), slow, slow)),
        ),
    ];
    for (expected, change) in changes {
        let error = change(&mut *solver).expect_err(expected);
        assert_eq!(field(&error), expected, "{error}");
    }
    assert_eq!((solver.dt(), solver.gravity(), solver.poses()[0]), (1.0 / 120.0, busy().gravity, pose));
    let a = after(&mut *solver, 6);
    twin.steps(8).unwrap();
    assert_eq!(state_hash(&a), state_hash(&particles(&mut *twin)), "an error changed the simulation");
    // A longer step may be refused because of a solid …
    let mut elastic = busy();
    elastic.settings.scheme = Scheme::Explicit;
    elastic.materials[0].model = Model::Elastic { shape_weight: 1.0 };
    elastic.settings.dt = elastic.stable_dt();
    let mut stiff = backend.solver(&elastic);
    stiff.step().unwrap();
    assert_eq!(field(&stiff.set_dt(1.01 * elastic.stable_dt()).unwrap_err()), "settings.dt");
    assert_eq!(stiff.dt(), elastic.stable_dt());
    stiff.set_dt(0.5 * elastic.stable_dt()).unwrap();
    // … or because of a body.
    solver.set_collider(1, None, still, DVec3::Y * 100.0).unwrap();
    assert_eq!(field(&solver.set_dt(0.1).unwrap_err()), "colliders[1].angular_velocity");
    assert_eq!(solver.dt(), 1.0 / 120.0);
}

/// Beside particles that are thousands of times as heavy the sums would round them away: they are refused, and what was
/// there moves on.
fn particles_too_light_for_the_sums(backend: Backend) {
    let refused = |error: Error| assert_eq!(field(&error), "mass of the lightest particle", "{error}");
    let mut world = busy();
    world.materials[1].rest_density = world.materials[0].rest_density / 2000.0;
    assert!(backend.try_solver(&world, &GpuOptions::default()).is_ok());
    world.materials[1].rest_density /= 5.0;
    refused(backend.try_solver(&world, &GpuOptions::default()).map(drop).unwrap_err());
    let mut world = busy();
    world.settings.capacity = Some(4000);
    let mut solver = backend.solver(&world);
    let mut twin = backend.solver(&world);
    let coarse = Spawn { fill: Fill::Spacing(50.0), ..block([3.0; 3], [5.0; 3], [0.0; 3]) };
    refused(solver.add(&coarse).map(drop).unwrap_err());
    assert_eq!(state_hash(&after(&mut *solver, 3)), state_hash(&after(&mut *twin, 3)));
}
