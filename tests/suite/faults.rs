//! Faults inside steps are counted, by a flag that says what to change, and all else continues.

use crate::backends::{Backend, MOST, Tests};
use crate::worlds::{DX, block, busy, empty, flowing, mixed_explicit, one, particles, report};
use pbmpm::lockstep::{Array, Spoil};
use pbmpm::{
    CpuSolver, DVec3, Emitter, Fate, Faults, GpuOptions, Headless, Material, Particle, Rate, Shape, Simulate, Spawn,
    Wall, World,
};

pub fn add(tests: &mut Tests) {
    tests.each("faults", MOST, "every_flag_is_raised", every_flag_is_raised);
    tests.each("faults", MOST, "nothing_is_counted_in_a_calm_world", nothing_is_counted_in_a_calm_world);
    tests.each("faults", MOST, "no_number_is_as_if_removed", no_number_is_as_if_removed);
    tests.each("faults", MOST, "quarantine_lasts_until_it_is_released", quarantine_lasts_until_it_is_released);
}

/// A solver whose particles can be overwritten.
trait Open: Simulate + Spoil {}
impl<T: Simulate + Spoil> Open for T {}

fn open(backend: Backend, world: &World, options: &GpuOptions) -> Box<dyn Open> {
    match backend {
        Backend::Cpu => Box::new(CpuSolver::<f32>::new(world).unwrap()),
        Backend::Cpu64 => Box::new(CpuSolver::<f64>::new(world).unwrap()),
        _ => Box::new(Headless::new(world, &backend.choice(), options).unwrap()),
    }
}

fn faults(backend: Backend, world: &World, options: &GpuOptions, steps: u32) -> Faults {
    let mut solver = open(backend, world, options);
    solver.steps(steps).unwrap();
    report(&mut *solver).faults
}

/// For each flag a world that raises it and no other, except for consequences of the same cause.
fn every_flag_is_raised(backend: Backend) {
    let usual = GpuOptions::default();
    let pool = |spawn: Spawn| {
        let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
        world.settings.iterations = 2;
        world.spawns.push(spawn);
        world
    };
    let still = || block([4.0, 4.0, 4.0], [7.0, 7.0, 7.0], [0.0; 3]);
    let only = |found: Faults, raise: fn(&mut Faults, &Faults)| {
        let mut expected = Faults::default();
        raise(&mut expected, &found);
        assert_eq!(found, expected);
    };
    let none = |_: &mut Faults, _: &Faults| ();

    let mut crowded = pool(block([5.0, 5.0, 5.0], [6.0, 6.0, 6.0], [0.0; 3]));
    // 23 cell masses on a node, where 16 are counted and 32 wrap.
    crowded.spawns = vec![crowded.spawns[0].clone(); 200];
    let found = faults(backend, &crowded, &usual, 1);
    // Double precision does not use fixed-point sums.
    assert_eq!(found.saturated_nodes > 0, backend != Backend::Cpu64, "{found:?}");
    only(found, |only, found| only.saturated_nodes = found.saturated_nodes);
    // The remedy according to its documentation.
    crowded.settings.max_fill = 64.0;
    only(faults(backend, &crowded, &usual, 1), none);

    let mut fast = pool(block([4.0, 4.0, 4.0], [7.0, 7.0, 7.0], [0.0, 5.0 * DX * 120.0, 0.0]));
    let found = faults(backend, &fast, &usual, 1);
    // Clamped in each iteration.
    only(found, |only, found| only.speed_clamped = found.speed_clamped);
    assert!(found.speed_clamped >= 216, "{found:?}");
    fast.settings.max_displacement = 6.0;
    only(faults(backend, &fast, &usual, 1), none);

    let spinning = pool(Spawn { angular_velocity: DVec3::Y * 1.6 * 120.0, ..one(DVec3::splat(5.5 * DX)) });
    let found = faults(backend, &spinning, &usual, 1);
    only(found, |only, found| only.gradient_clamped = found.gradient_clamped);
    assert!(found.gradient_clamped > 0, "{found:?}");

    // With almost no resistance they keep shrinking to a third, or growing to the double, in every step.
    for (material, rate) in [(Material::liquid("water"), -0.7), (Material::elastic("water"), 1.0)] {
        let mut alone = pool(one(DVec3::splat(5.5 * DX)));
        alone.materials[0] = Material { relaxation: 1e-3, ..material };
        let mut solver = open(backend, &alone, &usual);
        solver.spoil(0, Array::Gradient, 0, rate);
        solver.steps(1).unwrap();
        only(report(&mut *solver).faults, none);
        solver.steps(4).unwrap();
        let found = report(&mut *solver).faults;
        only(found, |only, found| only.strain_clamped = found.strain_clamped);
        assert!(found.strain_clamped > 0, "{rate}: {found:?}");
    }

    let mut leaving = pool(block([4.0, 0.5, 4.0], [6.0, 1.5, 6.0], [0.0, -1.0, 0.0]));
    leaving.domain.walls.y_min = Wall::Open;
    only(faults(backend, &leaving, &usual, 8), |only, _| only.escaped = 32);

    let mut poured = pool(still());
    let source = Shape::Sphere { radius: DX };
    poured.emitters.push(Emitter::new("water", source, DVec3::new(9.0, 9.0, 9.0) * DX, Rate::Particles(1200.0)));
    poured.settings.capacity = Some(221);
    only(faults(backend, &poured, &usual, 4), |only, _| only.refused = 35);

    let mut solver = open(backend, &pool(still()), &usual);
    solver.spoil(7, Array::Position, 1, f32::NAN);
    solver.steps(2).unwrap();
    only(report(&mut *solver).faults, |only, _| only.quarantined = 1);

    let found = faults(backend, &busy(), &GpuOptions { grid_blocks: Some(8), ..usual.clone() }, 2);
    // The CPU path's grid is always large enough.
    let device = !matches!(backend, Backend::Cpu | Backend::Cpu64);
    assert_eq!(found.steps_deferred > 0, device, "{found:?}");
    only(found, |only, found| only.steps_deferred = found.steps_deferred);
    only(faults(backend, &busy(), &GpuOptions { grid_blocks: Some(4096), ..usual }, 2), none);
}

fn nothing_is_counted_in_a_calm_world(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns.push(block([0.0, 0.0, 0.0], [12.0, 3.0, 12.0], [0.0; 3]));
    assert_eq!(faults(backend, &world, &GpuOptions::default(), 12), Faults::default());
}

fn bits(p: &Particle) -> Vec<u64> {
    let lanes =
        p.position.to_array().into_iter().chain(p.velocity.to_array()).chain(p.velocity_gradient.to_cols_array());
    lanes.chain([p.volume_ratio, p.mass]).map(f64::to_bits).collect()
}

/// Particles with a NaN or infinity in any of their lanes, or a negative volume ratio, leave no trace: in every scheme
/// all others move, bit for bit, as if these had been deleted.
fn no_number_is_as_if_removed(backend: Backend) {
    let spoilt = [
        (40, Array::Position, 0, f32::NAN),
        (41, Array::Position, 2, f32::INFINITY),
        (42, Array::Position, 3, f32::NAN),
        (43, Array::Position, 3, f32::INFINITY),
        (44, Array::Position, 3, f32::NEG_INFINITY),
        (45, Array::Position, 3, -0.5),
        (100, Array::Displacement, 1, f32::NEG_INFINITY),
        (101, Array::Displacement, 3, f32::NAN),
        (300, Array::Gradient, 0, f32::NAN),
        (301, Array::Gradient, 3, f32::NAN),
        (302, Array::Gradient, 7, f32::INFINITY),
        (303, Array::Gradient, 11, f32::NAN),
    ];
    let escaped = -1.0;
    for world in [busy(), flowing(), mixed_explicit()] {
        let run = |quarantine: bool| {
            let mut solver = open(backend, &world, &GpuOptions::default());
            solver.steps(6).unwrap();
            for (slot, array, lane, value) in spoilt {
                match quarantine {
                    true => solver.spoil(slot, array, lane, value),
                    false => solver.spoil(slot, Array::Position, 3, escaped),
                }
            }
            solver.steps(6).unwrap();
            (particles(&mut *solver), report(&mut *solver))
        };
        let ((with, counted), (without, _)) = (run(true), run(false));
        assert_eq!(counted.faults.quarantined as usize, spoilt.len(), "{}", world.name);
        assert_eq!(counted.alive as usize, with.len() - spoilt.len(), "{}", world.name);
        for (slot, (a, b)) in with.iter().zip(&without).enumerate() {
            if spoilt.iter().any(|s| s.0 == slot) {
                assert_eq!((a.fate, b.fate), (Fate::Quarantined, Fate::Escaped), "{slot} in {}", world.name);
            } else {
                assert_eq!(a.fate, Fate::Alive, "{slot} in {}", world.name);
                assert_eq!(bits(a), bits(b), "{slot} in {}", world.name);
            }
        }
    }
}

/// A quarantined particle keeps its slot and its state while others come and go; once released, its slot is used again.
fn quarantine_lasts_until_it_is_released(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns.push(block([4.0, 4.0, 4.0], [6.0, 6.0, 6.0], [0.0, 0.0, 0.5]));
    world.settings.capacity = Some(64);
    let mut solver = open(backend, &world, &GpuOptions::default());
    solver.spoil(9, Array::Displacement, 0, f32::NAN);
    solver.steps(2).unwrap();
    let kept = particles(&mut *solver)[9];
    assert_eq!(kept.fate, Fate::Quarantined);
    assert!(kept.velocity.x.is_nan() && kept.velocity.z > 0.4 && kept.position.is_finite(), "{kept:?}");

    // There is no room for another particle meanwhile.
    let another = one(DVec3::new(9.0, 9.0, 9.0) * DX);
    assert_eq!(solver.add(&another), Ok(1));
    solver.step().unwrap();
    let full = report(&mut *solver);
    assert_eq!((full.faults.refused, full.alive, full.emitted), (1, 63, 0));
    assert_eq!(bits(&particles(&mut *solver)[9]), bits(&kept));

    solver.release_quarantined();
    assert_eq!(particles(&mut *solver)[9].fate, Fate::Quarantined, "until the end of the next step");
    solver.step().unwrap();
    assert_eq!(particles(&mut *solver)[9].fate, Fate::Vacant);
    assert_eq!(solver.add(&another), Ok(1));
    solver.steps(2).unwrap();
    let now = particles(&mut *solver)[9];
    assert_eq!(now.fate, Fate::Alive);
    assert!(now.position.distance(DVec3::new(9.0, 9.0, 9.0) * DX) < DX, "{now:?}");
    let end = report(&mut *solver);
    assert_eq!((end.faults.quarantined, end.alive, end.emitted), (1, 64, 1));
}
