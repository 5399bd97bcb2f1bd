//! Readings of sensors.

use crate::backends::{ALL, Backend, MOST, NATIVE, Tests};
use crate::worlds::{DX, after, ball, block, busy, cuboid, cylinder, empty, mixed, particles, report};
use pbmpm::lockstep::compare_step;
use pbmpm::{DVec3, Emitter, Error, Fate, GpuOptions, Motion, Particle, Rate, Reading, Region, Shape, Wall, World};

pub fn add(tests: &mut Tests) {
    tests.each("sensors", NATIVE, "the_same_sums_on_devices", the_same_sums_on_devices);
    tests.each("sensors", ALL, "counts_are_those_of_the_host", counts_are_those_of_the_host);
    tests.each("sensors", MOST, "flow_through_a_box", flow_through_a_box);
    tests.each("sensors", MOST, "a_step_that_waits_is_not_sensed", a_step_that_waits_is_not_sensed);
    tests.once("sensors", "bad_sensors_are_refused", bad_sensors_are_refused);
}

fn at(cells: [f64; 3]) -> DVec3 {
    DVec3::from_array(cells) * DX
}

/// A box that moves and turns, a ball, the outside of a cylinder, the lower half, and a place that no matter reaches.
fn watched(mut world: World) -> World {
    let motion =
        Motion::Steady { linear_velocity: DVec3::new(0.2, -0.1, 0.0), angular_velocity: DVec3::new(0.5, 1.0, 0.0) };
    world.sensors = vec![
        Region { motion: Some(motion), ..Region::new(cuboid([3.0, 2.5, 4.0]), at([5.0, 6.0, 5.0])) },
        Region::new(ball(4.0), at([10.0, 6.0, 8.0])),
        Region { inverted: true, ..Region::new(cylinder(5.0, 6.0), at([7.0, 7.0, 7.0])) },
        Region::new(Shape::HalfSpace, at([0.0, 7.0, 0.0])),
        Region::new(ball(1.0), at([1.0, 13.0, 1.0])),
    ];
    world
}

fn the_same_sums_on_devices(backend: Backend) {
    for (world, steps) in [(busy(), 0), (busy(), 45), (mixed(), 30)] {
        let found = compare_step(&watched(world), steps, &backend.choice(), None).unwrap_or_else(|e| panic!("{e}"));
        let sums = found.iter().find(|d| d.stage.name() == "sense").expect("the stage ran");
        let before: usize = found.iter().filter(|d| d.stage.name() == "integrate").map(|d| d.unequal).sum();
        // Where the particles have the same bits, the sums have, too.
        assert!(before > 0 || sums.unequal == 0, "{sums:?}");
        assert_eq!(sums.compared, 25);
    }
}

/// The readings computed by the host from the particles.
fn by_hand(world: &World, particles: &[Particle], time: f64) -> Vec<Reading> {
    let alive = || particles.iter().filter(|p| p.fate == Fate::Alive);
    let sum = |sensor: &Region| {
        let pose = sensor.pose(time);
        let inside = |p: &&Particle| {
            let distance = sensor.shape.signed_distance(pose.rotation.inverse() * (p.position - pose.position));
            (if sensor.inverted { -distance } else { distance }) < 0.0
        };
        let found: Vec<_> = alive().filter(inside).collect();
        let mut reading = Reading::default();
        reading.count = found.len() as u32;
        reading.mass = found.iter().map(|p| p.mass).sum();
        reading.momentum = found.iter().map(|p| p.velocity * p.mass).sum();
        reading
    };
    world.sensors.iter().map(sum).collect()
}

fn counts_are_those_of_the_host(backend: Backend) {
    let mut world = watched(busy());
    world.settings.capacity = Some(4000);
    world.emitters = vec![Emitter::new("oil", ball(1.0), at([10.0, 11.0, 8.0]), Rate::Particles(2400.0))];
    world.drains = vec![Region::new(cuboid([2.0, 1.0, 2.0]), at([3.0, 1.0, 3.0]))];
    let mut solver = backend.solver(&world);
    assert_eq!(solver.sensors(), Ok(vec![Reading::default(); 5]));
    for (steps, dt) in [(1, 1.0 / 120.0), (14, 1.0 / 100.0), (15, 1.0 / 160.0)] {
        solver.set_dt(dt).unwrap_or_else(|e| panic!("{e}"));
        let end = after(&mut *solver, steps);
        let (found, expected) =
            (solver.sensors().unwrap_or_else(|e| panic!("{e}")), by_hand(&world, &end, solver.time()));
        for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert_eq!(found.count, expected.count, "sensor {i}");
            assert!((found.mass - expected.mass).abs() <= 1e-6 * expected.mass, "sensor {i}: {found:?} {expected:?}");
            let size = expected.mass * 0.1;
            assert!(found.momentum.distance(expected.momentum) <= 1e-5 * size, "sensor {i}: {found:?} {expected:?}");
        }
        assert!(found[..4].iter().all(|r| r.count > 0), "{found:?}");
        assert_eq!(found[4], Reading::default());
        assert_eq!(found[4].velocity(), DVec3::ZERO);
    }
}

/// A beam of 4 by 6 cells that flies at 1.5 m/s carries ρ A v through any cross-section.
fn flow_through_a_box(backend: Backend) {
    let mut world = empty([40.0, 12.0, 12.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.spawns = vec![block([2.0, 4.0, 3.0], [30.0, 8.0, 9.0], [1.5, 0.0, 0.0])];
    world.sensors = vec![Region::new(cuboid([5.0, 4.0, 4.0]), at([20.0, 6.0, 6.0]))];
    let mut solver = backend.solver(&world);
    solver.steps(4).unwrap_or_else(|e| panic!("{e}"));
    let reading = solver.sensors().unwrap_or_else(|e| panic!("{e}"))[0];
    let expected = 1000.0 * (4.0 * 6.0 * DX * DX) * 1.5;
    let flow = reading.flow(10.0 * DX);
    // One layer of particles more or less in the sensor is a twentieth.
    assert!((flow.x / expected - 1.0).abs() < 0.051, "{flow} for {expected}");
    assert!(flow.y.abs().max(flow.z.abs()) < 1e-4 * expected, "{flow}");
    assert!(reading.velocity().distance(DVec3::X * 1.5) < 1e-4, "{reading:?}");
}

/// A device that had to make room and repeat steps gives the same readings as one that had room at once.
fn a_step_that_waits_is_not_sensed(backend: Backend) {
    let world = watched(busy());
    let solver = |blocks| {
        let options = GpuOptions { grid_blocks: blocks, ..GpuOptions::default() };
        backend.try_solver(&world, &options).unwrap_or_else(|e| panic!("{e}"))
    };
    let (mut roomy, mut cramped) = (solver(Some(4096)), solver(Some(8)));
    for steps in [1, 2, 2] {
        let (a, b) = (after(&mut *roomy, steps), after(&mut *cramped, steps));
        assert_eq!(a, b);
        assert_eq!(roomy.sensors(), cramped.sensors());
    }
    let deferred = report(&mut *cramped).faults.steps_deferred > 0;
    assert_eq!(deferred, !matches!(backend, Backend::Cpu | Backend::Cpu64));
    assert_eq!(particles(&mut *roomy).len(), particles(&mut *cramped).len());
}

fn bad_sensors_are_refused() {
    type Change = fn(&mut World);
    let broken: [(&str, Change); 4] = [
        ("sensors[1].shape.sphere.radius", |w| w.sensors[1].shape = Shape::Sphere { radius: 0.0 }),
        ("sensors[2].position", |w| w.sensors[2].position.x = f64::NAN),
        ("sensors[0].motion.steady.angular_velocity", |w| {
            let fast = DVec3::splat(1e5);
            w.sensors[0].motion = Some(Motion::Steady { linear_velocity: DVec3::ZERO, angular_velocity: fast });
        }),
        ("sensors", |w| w.sensors = vec![w.sensors[0].clone(); 257]),
    ];
    for (field, change) in broken {
        let mut world = watched(busy());
        change(&mut world);
        let error = pbmpm::CpuSolver::<f32>::new(&world).err();
        assert!(matches!(&error, Some(Error::Invalid { field: found, .. }) if found == field), "{field}: {error:?}");
    }
}
