//! The explicit scheme: what it withstands, and the same bits on all paths. Its accuracy is tested in `validation`.

use crate::backends::{Backend, CPUS, MOST, Tests};
use crate::worlds::{
    DX, after, assert_sound, block, body, cuboid, empty, larger, mixed_explicit, particles, report, state,
};
use pbmpm::{Boundary, DVec3, Material, Particle, Quality, Scheme, Shape, Simulate, Spawn, Wall, World, state_hash};

pub fn add(tests: &mut Tests) {
    let software = &[Backend::Lavapipe, Backend::Swiftshader, Backend::Gl];
    tests.each("explicit", software, "a_mixed_world_has_the_same_bits", a_mixed_world_has_the_same_bits);
    tests.each("explicit", MOST, "everything_on_one_grid", everything_on_one_grid);
    tests.each("explicit", CPUS, "a_block_bounces", a_block_bounces);
    tests.each("explicit", CPUS, "drops_beside_walls_gain_nothing", drops_beside_walls_gain_nothing);
    tests.each("explicit", CPUS, "a_block_comes_to_rest", a_block_comes_to_rest);
    tests.each("explicit", CPUS, "a_block_thrown_hard_keeps_its_shape", a_block_thrown_hard_keeps_its_shape);
    tests.each("explicit", CPUS, "a_torn_bar_keeps_within_its_energy", a_torn_bar_keeps_within_its_energy);
    tests.each("explicit", CPUS, "a_steep_pour_of_sand_ends_as_a_heap", a_steep_pour_of_sand_ends_as_a_heap);
    tests.each("explicit", CPUS, "water_of_any_step_stays_in_its_tank", water_of_any_step_stays_in_its_tank);
    tests.each("explicit", CPUS, "a_column_gains_nothing_as_it_sinks", a_column_gains_nothing_as_it_sinks);
}

/// Liquid, rubber, jelly, sand and clay that hit each other and the floor.
fn a_mixed_world_has_the_same_bits(backend: Backend) {
    let world = mixed_explicit();
    let (mut cpu, mut device) = (Backend::Cpu.solver(&world), backend.solver(&world));
    for steps in [40, 120] {
        let (a, b) = (after(&mut *cpu, steps), after(&mut *device, steps));
        assert_sound(&b);
        assert_eq!(state_hash(&a), state_hash(&b), "after {steps} more steps");
    }
}

fn everything_on_one_grid(backend: Backend) {
    let world = mixed_explicit();
    let mut solver = backend.solver(&world);
    let energy = |solver: &mut dyn Simulate| {
        let state = state(solver);
        (state.kinetic_j + state.potential_j, state.mass_kg, state.max_speed_m_s)
    };
    let (before, mass, _) = energy(&mut *solver);
    assert_sound(&after(&mut *solver, 300));
    let (now, kept, fastest) = energy(&mut *solver);
    assert!((kept / mass - 1.0).abs() < 1e-12);
    assert!(now < before, "{now} J of {before} J: the turning box stirs, but less than is lost");
    assert!(fastest < 4.0, "{fastest} m/s");
    assert_eq!(report(&mut *solver).faults.gradient_clamped, 0);
}

/// A domain of `cells` with one material, in the longest stable steps.
fn of(material: Material, cells: [f64; 3], walls: Wall) -> World {
    let mut world = empty(cells, walls);
    world.materials = vec![Material { name: "water".to_owned(), ..material }];
    world.settings.scheme = Scheme::Explicit;
    world.settings.dt = world.stable_dt().min(1.0 / 1200.0);
    world
}

fn run(solver: &mut dyn Simulate, seconds: f64) -> Vec<Particle> {
    let steps = (seconds / solver.dt()).round() as u32;
    after(solver, steps)
}

/// Kinetic and potential energy, J. Strain energy is not included; it is never negative.
fn energy(solver: &mut dyn Simulate) -> f64 {
    let state = state(solver);
    state.kinetic_j + state.potential_j
}

/// Single particles in corners and along edges: as stiff as particles amid others they would be thrown up by 34 to 54
/// cells.
fn drops_beside_walls_gain_nothing(backend: Backend) {
    for (x, z) in [(0.3, 0.2), (0.05, 0.4), (0.2, 7.6), (0.45, 15.3), (8.1, 8.6)] {
        let mut world = empty([16.0, 60.0, 16.0], Wall::Slip);
        let at = DVec3::new(x, 0.6, z) * DX;
        let drop = Shape::Sphere { radius: 1e-3 * DX };
        world.spawns.push(Spawn { shape: drop, position: at, ..Spawn::cuboid("water", at, at) });
        world.settings = Quality::Realtime.settings_in(Scheme::Explicit, &world);
        let mut solver = backend.solver(&world);
        let start = energy(&mut *solver);
        for _ in 0..200 {
            after(&mut *solver, 4);
            let now = energy(&mut *solver);
            assert!(now < 1.2 * start, "({x}, {z}): {now} of {start} J");
        }
    }
}

/// A block of 8 cells falls 0.1 m: it leaves the floor, rises most of that height, and never has more energy than at
/// the start.
fn a_block_bounces(backend: Backend) {
    for poisson_ratio in [0.0, 0.3, 0.45] {
        let mut world = of(Material { poisson_ratio, ..Material::elastic("") }, [20.0, 20.0, 20.0], Wall::Slip);
        world.spawns.push(block([6.0, 5.0, 6.0], [14.0, 13.0, 14.0], [0.0; 3]));
        let mut solver = backend.solver(&world);
        let start = energy(&mut *solver);
        let lowest = |p: &[Particle]| p.iter().map(|p| p.position.y / DX).fold(f64::INFINITY, f64::min);
        let (mut touched, mut risen) = (false, 0.0f64);
        for _ in 0..45 {
            let now = run(&mut *solver, 0.01);
            assert_sound(&now);
            touched |= lowest(&now) < 1.0;
            risen = risen.max(if touched { lowest(&now) } else { 0.0 });
            let energy = energy(&mut *solver);
            assert!(energy < 1.001 * start, "{energy} J of {start} J");
        }
        assert!(touched && risen > 2.5, "it rises to {risen} cells");
    }
}

/// On a floor with friction, with some viscosity of its own, it stops, without drifting or gaining energy.
fn a_block_comes_to_rest(backend: Backend) {
    let rubber = Material { viscosity: 60.0, ..Material::elastic("") };
    let mut world = of(rubber, [20.0, 12.0, 20.0], Wall::Friction(0.5));
    world.spawns.push(block([6.0, 0.0, 6.0], [14.0, 8.0, 14.0], [0.0; 3]));
    let mut solver = backend.solver(&world);
    run(&mut *solver, 1.5);
    let middle = |solver: &mut dyn Simulate| DVec3::from_array(state(solver).centre_of_mass_m) / DX;
    let then = middle(&mut *solver);
    assert_sound(&run(&mut *solver, 0.5));
    let drift = middle(&mut *solver).distance(then);
    assert!(drift < 2e-3, "the middle drifts by {drift} cells in half a second");
    let now = state(&mut *solver);
    let heat = now.kinetic_j / (now.mass_kg * 9.81 * DX);
    assert!(heat < 1e-6, "kinetic energy of a fall by {heat} cells");
}

/// At 0.4 of the speed of sound a block of 8 cells hits the floor and is compressed to less than three quarters of its
/// height. In flight it regains its shape, with no more energy than at the start.
fn a_block_thrown_hard_keeps_its_shape(backend: Backend) {
    let rubber = Material { viscosity: 60.0, ..Material::elastic("") };
    let mut world = of(rubber, [20.0, 50.0, 20.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.spawns.push(block([6.0, 2.0, 6.0], [14.0, 10.0, 14.0], [0.0, -5.0, 0.0]));
    let mut solver = backend.solver(&world);
    // Root mean square distance from the middle along each axis, in cells.
    let size = |p: &[Particle]| {
        let count = p.len() as f64;
        let middle = p.iter().map(|p| p.position / DX).sum::<DVec3>() / count;
        let squares = p.iter().map(|p| (p.position / DX - middle).powf(2.0)).sum::<DVec3>() / count;
        squares.map(f64::sqrt)
    };
    let (shape, start) = (size(&particles(&mut *solver)), energy(&mut *solver));
    let flattest = (0..14).map(|_| size(&run(&mut *solver, 0.005)).y / shape.y).fold(1.0, f64::min);
    assert!(flattest < 0.75, "{flattest} of its height");
    let end = run(&mut *solver, 0.15);
    assert_sound(&end);
    let kept = size(&end) / shape;
    assert!((kept - 1.0).abs().max_element() < 0.03, "{kept} of its size");
    let left = energy(&mut *solver) / start;
    assert!(left > 0.2 && left < 1.0, "{left} of its energy");
}

/// Clamps pull a bar apart until it tears. The halves snap back with the energy stored in them.
fn a_torn_bar_keeps_within_its_energy(backend: Backend) {
    let mut world = of(Material::elastic(""), [60.0, 14.0, 14.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.spawns.push(block([20.0, 5.0, 5.0], [40.0, 9.0, 9.0], [0.0; 3]));
    for (x, way) in [(20.0, -1.0), (40.0, 1.0)] {
        let mut clamp = body(cuboid([2.0, 4.0, 4.0]), [x, 7.0, 7.0]);
        clamp.boundary = Boundary::Fixed;
        clamp.linear_velocity = DVec3::X * way;
        world.colliders.push(clamp);
    }
    let mut solver = backend.solver(&world);
    // Stretching to less than three times the length, at 1e5 Pa and 16 by 4 by 4 cells, stores at most this energy, J.
    let stored = 0.5 * 1e5 * 2f64.powi(2) * 16.0 * 4.0 * 4.0 * DX.powi(3);
    for _ in 0..15 {
        assert_sound(&run(&mut *solver, 0.02));
        let energy = energy(&mut *solver);
        assert!(energy < stored, "{energy} J of {stored} J");
    }
    let [lo, hi] = state(&mut *solver).bounds_m;
    assert!(hi[0] - lo[0] > 36.0 * DX, "the ends are held");
}

/// Dropped from 0.2 m onto the middle of a rough floor.
fn a_steep_pour_of_sand_ends_as_a_heap(backend: Backend) {
    let mut world = of(Material::sand("", 35.0), [40.0, 24.0, 4.0], Wall::Slip);
    world.domain.walls.y_min = Wall::Stick;
    world.spawns.push(block([15.0, 10.0, 0.0], [25.0, 22.0, 4.0], [0.0; 3]));
    let mut solver = backend.solver(&world);
    run(&mut *solver, 1.2);
    let before = particles(&mut *solver);
    let end = run(&mut *solver, 0.3);
    assert_sound(&end);
    let moved = before.iter().zip(&end).map(|(a, b)| a.position.distance(b.position) / DX).fold(0.0, larger);
    assert!(moved < 0.2, "a grain moves by {moved} cells in 0.3 s");
    // Height over the floor in strips of two cells, from the middle outwards.
    let strip = |k: f64| {
        let near = |p: &&Particle| (2.0 * k..2.0 * k + 2.0).contains(&(p.position.x / DX - 20.0).abs());
        let mut heights: Vec<_> = end.iter().filter(near).map(|p| p.position.y / DX).collect();
        heights.sort_by(f64::total_cmp);
        heights.get(heights.len() * 98 / 100).copied().unwrap_or(0.0)
    };
    let heights = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(strip);
    assert!(heights[0] > 2.5 && heights[0] < 7.0 && heights[5] < 0.7 * heights[0], "{heights:?}");
    assert!(heights.windows(2).all(|w| w[0] - w[1] < 2.0 * 36f64.to_radians().tan()), "steeper than 36°: {heights:?}");
}

/// Liquids are softened to the step length; no step makes anything explode.
fn water_of_any_step_stays_in_its_tank(backend: Backend) {
    for hertz in [100.0, 400.0, 1600.0] {
        let mut world = of(Material::liquid(""), [16.0, 24.0, 8.0], Wall::Slip);
        world.settings.dt = 1.0 / hertz;
        world.spawns.push(block([0.0; 3], [16.0, 6.0, 8.0], [0.0; 3]));
        world.spawns.push(block([5.0, 12.0, 1.0], [11.0, 18.0, 7.0], [0.0; 3]));
        let mut solver = backend.solver(&world);
        let start = energy(&mut *solver);
        for _ in 0..10 {
            assert_sound(&run(&mut *solver, 0.05));
            let energy = energy(&mut *solver);
            assert!(energy < 1.001 * start, "{hertz} Hz: {energy} J of {start} J");
        }
    }
}

/// As the column spreads to twice its length, its particles lie in layers a cell apart. If sound travelled a cell per
/// step at any viscosity, the columns would gain up to 0.17 and 0.8 of their initial energy. In shorter steps, liquids
/// with the largest stable stiffness gain 0.05 to 0.07 within 0.01 s.
fn a_column_gains_nothing_as_it_sinks(backend: Backend) {
    let cases = [(30.0, 1.0, true), (30.0, 1.0, false), (100.0, 1.0, false), (0.0, 0.25, true), (30.0, 0.25, true)];
    for (viscosity, share, limited) in cases {
        let column = Material { viscosity, ..Material::liquid("") };
        let mut world = of(column, [40.0, 20.0, 6.0], Wall::Slip);
        world.spawns.push(Spawn { jitter: 0.1, ..block([0.0; 3], [10.0, 16.0, 6.0], [0.0; 3]) });
        world.settings = Quality::Realtime.settings_in(Scheme::Explicit, &world);
        world.settings.dt *= share;
        world.settings.bulk_limit = world.settings.bulk_limit.filter(|_| limited);
        let mut solver = backend.solver(&world);
        let start = energy(&mut *solver);
        let mut before = start;
        for _ in 0..60 {
            assert_sound(&run(&mut *solver, 0.01));
            let now = energy(&mut *solver);
            assert!(now < before + 1e-3 * start, "{viscosity} Pa s: from {before} to {now} J of {start} J");
            before = now;
        }
        let thin = viscosity == 0.0;
        assert!(thin || before < 0.8 * start, "{viscosity} Pa s: {before} J are left of {start} J");
    }
}
