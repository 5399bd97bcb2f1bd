//! Elastic, sand and viscoplastic matter.

use crate::backends::{Backend, CPUS, MOST, Tests};
use crate::worlds::{DX, after, assert_sound, block, body, cuboid, empty, larger, mixed, particles, report, state};
use pbmpm::{
    Boundary, DVec3, Emitter, Material, Model, Particle, Quality, Rate, Scheme, Shape, Simulate, Spawn, Wall, Walls,
    World,
};

pub fn add(tests: &mut Tests) {
    tests.each("physics_solids", CPUS, "a_spinning_cube_keeps_its_spin", a_spinning_cube_keeps_its_spin);
    tests.each("physics_solids", &[Backend::Cpu], "a_slow_spin_is_kept", a_slow_spin_is_kept);
    tests.each("physics_solids", &[Backend::Cpu], "a_block_floats", a_block_floats);
    tests.each("physics_solids", MOST, "a_cube_keeps_its_spin_for_a_while", a_cube_keeps_its_spin_for_a_while);
    tests.each("physics_solids", CPUS, "a_rubber_block_comes_to_rest", a_rubber_block_comes_to_rest);
    tests.each("physics_solids", CPUS, "rubber_springs_back_and_clay_does_not", rubber_springs_back_and_clay_does_not);
    tests.each("physics_solids", CPUS, "a_softer_yield_slumps_further", a_softer_yield_slumps_further);
    tests.each("physics_solids", &[Backend::Cpu], "a_cylinder_of_clay_slumps", a_cylinder_of_clay_slumps);
    tests.each("physics_solids", CPUS, "clay_spreads_alike_on_any_floor", clay_spreads_alike_on_any_floor);
    tests.each("physics_solids", MOST, "sand_flies_apart_freely", sand_flies_apart_freely);
    tests.each("physics_solids", &[Backend::Cpu], "a_slope_gives_way_at_its_angle", a_slope_gives_way_at_its_angle);
    tests.each("physics_solids", &[Backend::Cpu], "an_hourglass_runs_steadily", an_hourglass_runs_steadily);
    tests.each(
        "physics_solids",
        &[Backend::Cpu],
        "what_falls_in_pieces_leaves_no_gaps",
        what_falls_in_pieces_leaves_no_gaps,
    );
    tests.each("physics_solids", CPUS, "a_ledge_does_not_push", a_ledge_does_not_push);
    tests.each("physics_solids", CPUS, "short_steps_see_soft_matter", short_steps_see_soft_matter);
    tests.each("physics_solids", CPUS, "vibration_fades_in_short_steps", vibration_fades_in_short_steps);
    tests.each("physics_solids", CPUS, "rest_is_the_same_in_a_moving_box", rest_is_the_same_in_a_moving_box);
    tests.each("physics_solids", MOST, "everything_on_one_grid", everything_on_one_grid);
}

/// A domain of `cells` with one material.
fn of(material: Material, cells: [f64; 3], walls: Wall) -> World {
    let mut world = empty(cells, walls);
    world.materials = vec![Material { name: "water".to_owned(), ..material }];
    world.settings.dt = 1.0 / 240.0;
    world
}

/// A cube of 8 cells that turns at 4 rad/s in free space.
fn spinning() -> World {
    let mut world = of(Material::elastic(""), [20.0; 3], Wall::Slip);
    world.gravity = DVec3::ZERO;
    let spin = DVec3::new(0.0, 4.0, 0.0);
    world.spawns.push(Spawn { angular_velocity: spin, ..block([6.0; 3], [14.0; 3], [0.0; 3]) });
    world
}

/// The share of its own angular momentum that the cube, which does not travel, has after this many steps.
fn kept_spin(backend: Backend, steps: u32) -> f64 {
    let mut solver = backend.solver(&spinning());
    let spin = |solver: &mut dyn Simulate| state(solver).angular_momentum[1];
    let before = spin(&mut *solver);
    assert_sound(&after(&mut *solver, steps));
    spin(&mut *solver) / before
}

/// In the published form, whose correction is not symmetric, 11 to 18 % are lost in these two seconds.
fn a_spinning_cube_keeps_its_spin(backend: Backend) {
    let kept = kept_spin(backend, 480);
    assert!((kept - 1.0).abs() < 1e-3, "{kept} of the angular momentum");
}

fn a_cube_keeps_its_spin_for_a_while(backend: Backend) {
    let kept = kept_spin(backend, 24);
    assert!((kept - 1.0).abs() < 1e-3, "{kept} of the angular momentum");
}

/// However slow the rotation, 2·10⁻⁴ degrees per step here, rounding on the grid does not remove it, since the sums are
/// as fine as the motion. With one resolution of the sums for all worlds nothing was left of it.
fn a_slow_spin_is_kept(backend: Backend) {
    for scheme in [Scheme::Implicit, Scheme::Explicit] {
        for speed in [0.4, 0.004] {
            let mut world = spinning();
            world.settings.scheme = scheme;
            world.settings.dt = world.stable_dt();
            world.spawns[0].angular_velocity = DVec3::Y * speed;
            let mut solver = backend.solver(&world);
            let spin = |solver: &mut dyn Simulate| state(solver).angular_momentum[1];
            let before = spin(&mut *solver);
            assert_sound(&after(&mut *solver, 500));
            let kept = spin(&mut *solver) / before;
            assert!((kept - 1.0).abs() < 5e-5, "{kept} of a spin of {speed} rad/s in {scheme:?}");
        }
    }
}

/// A block of rubber of 0.7 times the density of the water that it falls into floats at the right depth within a
/// quarter of its height; remaining gaps between both used to lift it by more than a third.
fn a_block_floats(backend: Backend) {
    let mut world = empty([16.0, 20.0, 16.0], Wall::Slip);
    let rubber = Material { rest_density: 700.0, youngs_modulus: 2e5, ..Material::elastic("rubber") };
    world.materials = vec![Material::liquid("water"), rubber];
    world.spawns.push(block([0.0; 3], [16.0, 10.0, 16.0], [0.0; 3]));
    world.spawns.push(Spawn { material: "rubber".to_owned(), ..block([5.0, 10.5, 5.0], [11.0, 16.5, 11.0], [0.0; 3]) });
    world.settings = Quality::Realtime.settings(&world);
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, (3.0 / world.settings.dt) as u32);
    assert_sound(&end);
    let heights = end.iter().filter(|p| p.material == 1).map(|p| p.position.y / DX);
    let middle = heights.clone().sum::<f64>() / heights.count() as f64;
    // The block's volume under water raises the level by that volume over the pool's area.
    let level = 10.0 + 0.7 * 216.0 / 256.0;
    let above = middle - (level - 0.2 * 6.0);
    assert!(above.abs() < 1.5, "{above} cells too high");
}

/// Thrown at the floor it leaves with the energy that it has in the explicit scheme, although its stress changes the
/// motion by less than the tolerance in each step: sound takes a hundred steps to cross a cell.
fn short_steps_see_soft_matter(backend: Backend) {
    let left = |scheme: Scheme| {
        let mut world = of(Material { youngs_modulus: 4e3, ..Material::elastic("") }, [4.0, 12.0, 4.0], Wall::Slip);
        world.settings.scheme = scheme;
        world.settings.dt = 1.0 / 12_000.0;
        world.spawns.push(block([0.75, 1.0, 0.75], [3.25, 3.5, 3.25], [0.0, -4.4, 0.0]));
        let energy = |solver: &mut dyn Simulate| state(solver).kinetic_j;
        let mut solver = backend.solver(&world);
        let before = energy(&mut *solver);
        assert_sound(&after(&mut *solver, 500));
        assert_eq!(report(&mut *solver).faults.strain_clamped, 0, "{scheme:?}");
        energy(&mut *solver) / before
    };
    let [implicit, explicit] = [Scheme::Implicit, Scheme::Explicit].map(left);
    assert!((implicit - explicit).abs() < 0.03, "{implicit} of the energy, the explicit scheme {explicit}");
}

/// The halves of a bar move towards each other: it vibrates with no more energy than at the start, although sound takes
/// 20 or 200 steps to cross a cell. With iterations that ended at a share of the motion that fell only with the cells
/// that sound travels, and sums too coarse for so small residuals, it had 93 times as much after 0.04 s.
fn vibration_fades_in_short_steps(backend: Backend) {
    for (dt, steps) in [(1e-4, 4000), (1e-5, 8000)] {
        let mut world = of(Material { youngs_modulus: 1e5, ..Material::elastic("") }, [16.0, 8.0, 8.0], Wall::Slip);
        world.gravity = DVec3::ZERO;
        world.settings.scheme = Scheme::Implicit;
        (world.settings.dt, world.settings.iterations, world.settings.tolerance) = (dt, 4, 0.01);
        for (from, to, speed) in [(2.0, 8.0, 0.1), (8.0, 14.0, -0.1)] {
            world.spawns.push(block([from, 3.0, 3.0], [to, 5.0, 5.0], [speed, 0.0, 0.0]));
        }
        let mut solver = backend.solver(&world);
        let energy = |solver: &mut dyn Simulate| state(solver).kinetic_j;
        let before = energy(&mut *solver);
        for part in 0..8 {
            assert_sound(&after(&mut *solver, steps / 8));
            let now = energy(&mut *solver);
            assert!(now < before, "{now} J of {before} J in steps of {dt} s, after {part} eighths");
        }
    }
}

/// A block of rubber is put on a tray. It comes to rest on it as well if both move at 5 m/s: iterations go on until
/// what is not common to all motion is known.
fn rest_is_the_same_in_a_moving_box(backend: Backend) {
    let left = |speed: f64| {
        let mut world = of(Material { youngs_modulus: 2e4, ..Material::elastic("") }, [400.0, 14.0, 14.0], Wall::Slip);
        world.settings.scheme = Scheme::Implicit;
        (world.settings.dt, world.settings.iterations, world.settings.tolerance) = (0.003, 4, 0.01);
        world.spawns.push(block([6.0, 1.0, 4.0], [12.0, 6.0, 10.0], [speed, 0.0, 0.0]));
        let mut tray = body(cuboid([8.0, 1.0, 7.0]), [9.0, 0.0, 7.0]);
        (tray.boundary, tray.linear_velocity) = (Boundary::Stick, DVec3::X * speed);
        world.colliders.push(tray);
        let mut solver = backend.solver(&world);
        let end = after(&mut *solver, 450);
        assert_sound(&end);
        let squares = end.iter().map(|p| (p.velocity - DVec3::X * speed).length_squared());
        (squares.sum::<f64>() / end.len() as f64).sqrt()
    };
    let [still, moving] = [0.0, 5.0].map(left);
    assert!(still < 2e-3 && moving < 2e-3, "it moves on at {still} m/s, in a box that moves at {moving} m/s");
}

/// Released on the floor it oscillates, and then stands, without drifting or gaining energy.
fn a_rubber_block_comes_to_rest(backend: Backend) {
    let mut world = of(Material::elastic(""), [16.0, 12.0, 16.0], Wall::Friction(0.5));
    world.materials[0].viscous_relaxation = 0.02;
    world.spawns.push(block([5.0, 0.0, 5.0], [11.0, 6.0, 11.0], [0.0; 3]));
    let mut solver = backend.solver(&world);
    let middle = |solver: &mut dyn Simulate| DVec3::from_array(state(solver).centre_of_mass_m) / DX;
    assert_sound(&after(&mut *solver, 480));
    let (then, start) = (middle(&mut *solver), particles(&mut *solver));
    let end = after(&mut *solver, 240);
    let drift = middle(&mut *solver).distance(then);
    assert!(drift < 1e-3, "the middle drifts by {drift} cells in a second");
    let moved = start.iter().zip(&end).map(|(a, b)| a.position.distance(b.position) / DX).fold(0.0, larger);
    assert!(moved < 0.02, "a particle moved by {moved} cells in a second");
    let now = state(&mut *solver);
    let heat = now.kinetic_j / (now.mass_kg * 9.81 * DX);
    assert!(heat < 1e-6, "kinetic energy of a fall by {heat} cells");
}

/// Height of the matter over the floor, cells, without the highest hundredth.
fn height(particles: &[Particle]) -> f64 {
    let mut heights: Vec<_> = particles.iter().map(|p| p.position.y / DX).collect();
    heights.sort_by(f64::total_cmp);
    heights[heights.len() * 99 / 100]
}

/// A block of 6 cells dropped on the floor from a height of 10 cells.
fn dropped(material: Material) -> World {
    let mut world = of(material, [24.0, 20.0, 24.0], Wall::Friction(0.5));
    world.spawns.push(block([9.0, 10.0, 9.0], [15.0, 16.0, 15.0], [0.0; 3]));
    world
}

/// Height 1.5 s after the release of a block of 6 cells.
fn dropped_height(backend: Backend, material: Material) -> f64 {
    let mut solver = backend.solver(&dropped(material));
    let end = after(&mut *solver, 360);
    assert_sound(&end);
    let volume = end.iter().map(|p| p.volume_ratio).sum::<f64>() / end.len() as f64;
    assert!((volume - 1.0).abs() < 0.08, "mean volume ratio {volume}");
    height(&end)
}

fn rubber_springs_back_and_clay_does_not(backend: Backend) {
    let damped = Material { viscous_relaxation: 0.05, ..Material::elastic("") };
    let rubber = dropped_height(backend, damped.clone());
    let clay = dropped_height(backend, Material { viscous_relaxation: 0.05, ..Material::viscoplastic("", 0.01) });
    assert!(rubber > 5.4, "rubber stands {rubber} cells high");
    assert!(clay < 5.0 && clay > 1.0, "clay stands {clay} cells high");
}

fn a_softer_yield_slumps_further(backend: Backend) {
    let clay = |y: f64| Material { viscous_relaxation: 0.05, ..Material::viscoplastic("", y) };
    let heights = [0.01, 0.03, 0.3].map(|y| dropped_height(backend, clay(y)));
    assert!(heights.is_sorted() && heights[2] > 1.3 * heights[0], "{heights:?}");
}

/// Share of its height by which a cylinder of clay, twice as wide as it is high, sinks on a rough floor under its own
/// weight, which is applied over 0.4 s. `strength` is its yield stress in shear over the weight of a column of its
/// height.
fn slump(backend: Backend, strength: f64) -> f64 {
    const HEIGHT: f64 = 8.0;
    let mut world = of(Material::viscoplastic("", 0.0), [40.0, 14.0, 40.0], Wall::Slip);
    world.domain.walls.y_min = Wall::Stick;
    world.settings.iterations = 6;
    let radius = HEIGHT * DX;
    let shape = Shape::Cylinder { radius, half_height: 0.5 * HEIGHT * DX };
    world.spawns.push(Spawn { shape, ..block([12.0, 0.0, 12.0], [28.0, HEIGHT, 28.0], [0.0; 3]) });
    // Stiffness from the iterations (docs/method.md): 2μ = ¼ a I ρ (Δx/Δt)². At yield, the stress in pure shear is 2μ
    // times the strain.
    let (material, settings) = (&world.materials[0], &world.settings);
    let wave = (DX / settings.dt).powi(2);
    let modulus = 0.25 * material.relaxation * f64::from(settings.iterations) * material.rest_density * wave;
    let weight = material.rest_density * 9.81 * HEIGHT * DX;
    world.materials[0].model = Model::Viscoplastic { yield_strain: strength * weight / modulus };
    let mut solver = backend.solver(&world);
    let top = |particles: &[Particle]| particles.iter().map(|p| p.position.y).fold(0.0, larger);
    let before = top(&particles(&mut *solver));
    for k in 1..=96 {
        let gravity = DVec3::new(0.0, -9.81 * f64::from(k) / 96.0, 0.0);
        solver.set_gravity(gravity).and_then(|()| solver.step()).unwrap_or_else(|e| panic!("{e}"));
    }
    let end = after(&mut *solver, 60);
    assert_sound(&end);
    1.0 - top(&end) / before
}

/// Pashias et al. 1996: s/H = 1 − 2τ (1 − ln 2τ); measurements agree within 0.05.
fn a_cylinder_of_clay_slumps(backend: Backend) {
    for strength in [0.1f64, 0.3] {
        let expected = 1.0 - 2.0 * strength * (1.0 - (2.0 * strength).ln());
        let found = slump(backend, strength);
        assert!((found - expected).abs() < 0.1, "strength {strength}: {found} for {expected}");
    }
}

/// Height of the centre of a block of clay, 6 cells high, that has spread for 0.6 s over a smooth floor that lies
/// this far above a row of nodes, in cells.
fn spread(backend: Backend, above: f64) -> f64 {
    let floor = 2.0 + above;
    let material = Material { youngs_modulus: 1e5, yield_stress: Some(300.0), ..Material::viscoplastic("", 0.1) };
    let mut world = of(material, [24.0, 14.0, 24.0], Wall::Slip);
    world.colliders.push(body(cuboid([24.0, floor, 24.0]), [12.0, 0.0, 12.0]));
    world.spawns.push(block([8.0, floor, 8.0], [16.0, floor + 6.0, 16.0], [0.0; 3]));
    world.settings = Quality::Realtime.settings(&world);
    let mut solver = backend.solver(&world);
    (0..36).for_each(|_| assert!(solver.advance(1.0 / 60.0).is_ok()));
    state(&mut *solver).centre_of_mass_m[1] / DX - floor
}

/// Where the nodes before the floor come no nearer, 1.6 times as high as on a floor of nodes.
fn clay_spreads_alike_on_any_floor(backend: Backend) {
    let on_nodes = spread(backend, 0.0);
    for above in [0.2, 0.4, 0.6, 0.8] {
        let height = spread(backend, above) / on_nodes;
        assert!((height - 1.0).abs() < 0.25, "{height} of its height, {above} above the nodes");
    }
}

/// Two halves of a block separate. Where they touch at first, one column of the grid shares their motion and slows the
/// nearest grains; after that nothing holds them.
fn sand_flies_apart_freely(backend: Backend) {
    let mut world = of(Material::sand("", 35.0), [32.0; 3], Wall::Slip);
    world.gravity = DVec3::ZERO;
    for (x, velocity) in [(10.0, -0.5), (16.0, 0.5)] {
        world.spawns.push(block([x, 14.0, 14.0], [x + 6.0, 18.0, 18.0], [velocity, 0.0, 0.0]));
    }
    let mut solver = backend.solver(&world);
    let before = state(&mut *solver).kinetic_j;
    assert_sound(&after(&mut *solver, 12));
    let parted = state(&mut *solver).kinetic_j;
    assert!(parted > 0.75 * before, "{} of the energy is left", parted / before);
    assert_sound(&after(&mut *solver, 24));
    let kept = state(&mut *solver).kinetic_j / parted;
    assert!((kept - 1.0).abs() < 0.02, "{kept} of the energy in free flight");
}

/// Speed down the slope in the middle of a layer, in cells per second, 0.2 and 0.4 s after it was tilted to `angle`.
///
/// The layer of 0.16 m lies on a rough floor and has settled before. It is so long that effects of its ends have not
/// reached the middle by then. Steps are proportional to the cells, which keeps its stiffness.
fn slide(backend: Backend, layer: f64, friction_angle: f64, angle: f64) -> [f64; 2] {
    let (dx, length) = (0.16 / layer, 30.0 * layer);
    let mut world = World::new(DVec3::ZERO, DVec3::new(length, 2.0 * layer, 2.0) * dx, dx);
    world.domain.walls.y_min = Wall::Stick;
    world.settings.scheme = Scheme::Published;
    world.settings.dt = 1.0 / (30.0 * layer);
    world.settings.iterations = 8;
    world.materials.push(Material { relaxation: 1.0, ..Material::sand("sand", friction_angle) });
    world.spawns.push(Spawn::cuboid("sand", DVec3::ZERO, DVec3::new(length, layer, 2.0) * dx));
    let tilted = |degrees: f64| DVec3::new(degrees.to_radians().sin(), -degrees.to_radians().cos(), 0.0) * 9.81;
    let run = |solver: &mut dyn Simulate, steps| solver.steps(steps).unwrap_or_else(|e| panic!("{e}"));
    world.gravity = tilted(0.0);
    let mut solver = backend.solver(&world);
    let tenth = 3 * layer as u32;
    run(&mut *solver, 4 * tenth);
    for k in 1..=6 {
        solver.set_gravity(tilted(angle * f64::from(k) / 6.0)).unwrap_or_else(|e| panic!("{e}"));
        run(&mut *solver, tenth / 3);
    }
    [(); 2].map(|()| {
        run(&mut *solver, 2 * tenth);
        let middle = 0.4 * length * dx..0.6 * length * dx;
        let speeds: Vec<_> = particles(&mut *solver)
            .iter()
            .filter(|p| middle.contains(&p.position.x))
            .map(|p| p.velocity.x / dx)
            .collect();
        speeds.iter().sum::<f64>() / speeds.len() as f64
    })
}

/// Two degrees below the angle of friction a layer on a rough slope comes to rest, two above it slides ever faster.
fn a_slope_gives_way_at_its_angle(backend: Backend) {
    for (layer, friction_angle) in [(4.0, 30.0), (8.0, 30.0), (4.0, 20.0)] {
        let [slower, held] = slide(backend, layer, friction_angle, friction_angle - 2.0);
        let [then, now] = slide(backend, layer, friction_angle, friction_angle + 2.0);
        assert!(
            held < 0.8 && held < slower,
            "{layer} cells, {friction_angle}°: {slower}, then {held} cells/s two degrees below"
        );
        assert!(now > then + 0.5, "{layer} cells, {friction_angle}°: {then}, then {now} cells/s two degrees above");
    }
}

/// A block of rubber, 8 cells wide, sticks out over a smooth ledge by three, whose edge lies on nodes or off them: it
/// does not slide off (2 cm/s, from settling). Where nodes on the edge are stopped along a normal between the faces, it
/// does, at 25 cm/s. Another block that falls past the ledge is pushed away by 0.2 cells instead of by one, and by 0.4
/// between walls six cells apart: gaps are those to the nearest body, which beside a wall is the wall.
fn a_ledge_does_not_push(backend: Backend) {
    let seconds = 0.2;
    let slide = |beside: bool, off: f64, walls: Option<f64>| {
        let depth = walls.unwrap_or(12.0);
        let mut world = of(Material { youngs_modulus: 1e5, ..Material::elastic("") }, [30.0, 24.0, depth], Wall::Slip);
        if walls.is_none() {
            world.domain.walls = Walls { z_min: Wall::Periodic, z_max: Wall::Periodic, ..world.domain.walls };
        }
        let [width, height] = [5.0 + off, if beside { 10.0 } else { 5.0 }];
        world.colliders.push(body(cuboid([width, height, depth]), [5.0, 0.0, depth / 2.0]));
        let [x, y] = if beside { [10.0, 15.0] } else { [5.0, 5.0] };
        let spawn = block([x, y, 0.0], [x + if beside { 4.0 } else { 8.0 }, y + 4.0, depth], [0.0; 3]);
        world.spawns.push(Spawn { jitter: 0.2, ..spawn });
        world.settings = Quality::Realtime.settings(&world);
        let mut solver = backend.solver(&world);
        let mean = |solver: &mut dyn Simulate| state(solver).centre_of_mass_m;
        let before = mean(&mut *solver);
        let steps = (seconds / world.settings.dt).ceil() as u32;
        assert_sound(&after(&mut *solver, steps));
        let now = mean(&mut *solver);
        ((now[0] - before[0]) / DX, state(&mut *solver).momentum[0] / state(&mut *solver).mass_kg)
    };
    for off in [0.0, 0.25] {
        let (_, speed) = slide(false, off, Some(6.0));
        assert!(speed.abs() < 0.04, "edge {off} off the nodes: {speed} m/s");
    }
    for (walls, most) in [(None, 0.3), (Some(6.0), 0.5)] {
        let (away, _) = slide(true, 0.0, walls);
        assert!(away.abs() < most, "{away} cells, walls {walls:?} apart");
    }
}

/// Unlike a liquid, sand runs at a rate independent of how much of it is still above (Beverloo et al. 1961).
fn an_hourglass_runs_steadily(backend: Backend) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/sand_hourglass.json");
    let world = pbmpm::scene::from_file(file).expect("the scene is valid");
    let mut solver = backend.solver(&world);
    let mut below = |steps| after(&mut *solver, steps).iter().filter(|p| p.position.y < 0.36).count() as f64;
    // It begins with a gush of the sand that fell on the opening.
    let mut before = below(144);
    let rates = [(); 6].map(|()| {
        let now = below(24);
        now - std::mem::replace(&mut before, now)
    });
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    assert!(mean > 500.0 && rates.iter().all(|rate| (rate / mean - 1.0).abs() < 0.15), "{rates:?} grains in 0.1 s");
}

/// Three layers of four cells fall onto each other without gaps remaining between them. Sand from a jet fills a bin to
/// the right height.
fn what_falls_in_pieces_leaves_no_gaps(backend: Backend) {
    let clay = Material { yield_stress: Some(200.0), ..Material::viscoplastic("", 0.05) };
    for (material, jet) in [(Material::sand("", 30.0), false), (clay, false), (Material::sand("", 30.0), true)] {
        let name = if jet { "jet" } else { "layers" };
        let mut world = of(material, [8.0, 30.0, 8.0], Wall::Slip);
        if jet {
            let nozzle = Shape::Box { half_size: DVec3::new(2.0, 0.5, 2.0) * DX };
            let rate = Rate::Litres(16.0 * DX * DX * 1e3);
            let mut emitter = Emitter::new("water", nozzle, DVec3::new(4.0, 27.0, 4.0) * DX, rate);
            emitter.velocity = DVec3::NEG_Y;
            emitter.end = Some(48.0 * DX);
            world.emitters.push(emitter);
        } else {
            world.spawns.extend([0.0, 8.0, 16.0].map(|y| block([0.0, y, 0.0], [8.0, y + 4.0, 8.0], [0.0; 3])));
        }
        world.settings = Quality::Realtime.settings(&world);
        let mut solver = backend.solver(&world);
        let seconds = 2.0;
        assert_sound(&after(&mut *solver, (seconds / world.settings.dt) as u32));
        let end = particles(&mut *solver);
        // The layers' twelve cells, or the matter from the jet.
        let full = end.len() as f64 / (8.0 * 64.0);
        let height = 2.0 * end.iter().map(|p| p.position.y / DX).sum::<f64>() / end.len() as f64;
        assert!(
            (height / full - 1.0).abs() < if jet { 0.1 } else { 0.05 },
            "{name}, {:?}: {height} cells high for {full}",
            world.materials[0].model
        );
    }
}

/// Liquid, rubber, sand and clay fall on a floor and on each other.
fn everything_on_one_grid(backend: Backend) {
    let world = mixed();
    let mut solver = backend.solver(&world);
    let before = state(&mut *solver).mass_kg;
    assert_sound(&after(&mut *solver, 120));
    let now = state(&mut *solver);
    assert!((now.mass_kg / before - 1.0).abs() < 1e-12);
    assert!(now.max_speed_m_s < 4.0, "{} m/s", now.max_speed_m_s);
}
