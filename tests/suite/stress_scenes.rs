//! The scenes of `stress`, in cells of [`DX`]: tanks of liquid unless a scene says otherwise.

use crate::stress::{Abuse, Scene, nobody, realtime, sound};
use crate::worlds::{DX, ball, block, body, cuboid, empty};
use pbmpm::{
    Boundary, Collider, DQuat, DVec3, Emitter, Fill, Material, Motion, Pose, Rate, Region, Scheme, Simulate, Spawn,
    UVec3, Wall, World,
};

pub const SCENES: &[(&str, Scene)] = &[
    ("a_thousand_particles_in_a_cell", a_thousand_particles_in_a_cell),
    ("a_piston_at_two_g_let_go", a_piston_at_two_g_let_go),
    ("liquid_between_closing_boxes", liquid_between_closing_boxes),
    ("a_box_that_jumps_about_in_liquid", a_box_that_jumps_about_in_liquid),
    ("rubber_through_a_keyhole", rubber_through_a_keyhole),
    ("rubber_pressed_to_nothing", rubber_pressed_to_nothing),
    ("rubber_turned_inside_out", rubber_turned_inside_out),
    ("a_bullet_into_a_pool", a_bullet_into_a_pool),
    ("a_bullet_into_rubber", a_bullet_into_rubber),
    ("rain_of_single_particles", rain_of_single_particles),
    ("a_deep_tank", a_deep_tank),
    ("steps_four_times_as_long_and_short", steps_four_times_as_long_and_short),
    ("gravity_upside_down", gravity_upside_down),
    ("a_domain_of_one_block_shaken", a_domain_of_one_block_shaken),
    ("particles_on_every_boundary", particles_on_every_boundary),
    ("rotors_at_absurd_speed", rotors_at_absurd_speed),
    ("two_drains_over_the_same_particles", two_drains_over_the_same_particles),
    ("emitters_into_a_full_tank", emitters_into_a_full_tank),
];

const G: f64 = 9.81;
/// Matter counts as at rest below the energy of a fall by this many cells.
const STILL: f64 = 0.5;

/// Slightly viscous, so that sloshing ends within seconds.
fn syrup() -> Material {
    Material { viscosity: 2.0, viscous_relaxation: 0.02, ..Material::liquid("water") }
}

fn tank(cells: [f64; 3], scheme: Scheme, fill: impl FnOnce(&mut World)) -> World {
    let mut world = empty(cells, Wall::Slip);
    world.materials[0] = syrup();
    fill(&mut world);
    realtime(&mut world, scheme);
    world
}

/// Energy of lifting matter by this many cells, J/kg.
fn lift(cells: f64) -> f64 {
    G * cells * DX
}

/// Energy of this speed, m/s, in J/kg.
fn kinetic(speed: f64) -> f64 {
    0.5 * speed * speed
}

/// The matter of 125 cells in one.
fn a_thousand_particles_in_a_cell(scheme: Scheme) -> Option<Abuse> {
    let mut world = tank([8.0, 12.0, 8.0], scheme, |w| {
        let eight = block([4.0, 3.0, 4.0], [5.0, 4.0, 5.0], [0.0; 3]);
        w.spawns = (0..125).map(|seed| Spawn { jitter: 0.5, seed, ..eight.clone() }).collect();
    });
    world.settings.max_fill = 256.0;
    // A liquid that is compressed to a tenth or less, the smallest volume ratio that is stored.
    let put_in = kinetic(sound(&world)) * 0.9f64.powi(2) + lift(12.0);
    Some(Abuse { world, time: 0.1, host: nobody, put_in, rest: 12.0, still: STILL, middle: 0.7..1.4 })
}

/// Keyframes of positions, in cells, at these times.
fn path(times: Vec<f64>, ways: Vec<DVec3>) -> Option<Motion> {
    Some(Motion::Keyframes {
        times,
        positions: ways.iter().map(|way| *way * DX).collect(),
        rotations: vec![],
        repeat: false,
    })
}

/// It presses down on the whole surface at 2 g, by 2 of 12 cells, stays for 0.1 s and is removed within a hundredth.
fn a_piston_at_two_g_let_go(scheme: Scheme) -> Option<Abuse> {
    let ways = (0..=8).map(|i| f64::from(i) / 8.0);
    let fall = (2.0 * 2.0 * DX / (2.0 * G)).sqrt();
    let mut times: Vec<_> = ways.clone().map(|t| t * fall).collect();
    let mut places: Vec<_> = ways.map(|t| DVec3::Y * -2.0 * t * t).collect();
    times.extend([0.2, 0.21]);
    places.extend([DVec3::Y * -2.0, DVec3::Y * 12.0]);
    let world = tank([6.0, 40.0, 6.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [6.0, 12.0, 6.0], [0.0; 3]));
        w.colliders.push(Collider { motion: path(times, places), ..body(cuboid([4.0, 4.0, 4.0]), [3.0, 16.0, 3.0]) });
    });
    let put_in = kinetic(sound(&world) * 2.0 / 12.0) + kinetic(2.0 * (2.0 * 2.0 * G * 2.0 * DX).sqrt());
    Some(Abuse { world, time: 0.25, host: nobody, put_in, rest: 4.0, still: STILL, middle: 5.0..6.6 })
}

/// Two boxes close within a tenth of a second on liquid between them, and open again.
fn liquid_between_closing_boxes(scheme: Scheme) -> Option<Abuse> {
    let mut world = tank([20.0, 16.0, 8.0], scheme, |w| {
        w.spawns.push(block([7.0, 0.0, 0.0], [13.0, 5.0, 8.0], [0.0; 3]));
        for side in [-1.0, 1.0] {
            let times = vec![0.0, 0.1, 0.15, 0.25];
            let ways = [0.0, 3.0, 3.0, -1.0].map(|x| DVec3::X * -side * x);
            let jaw = body(cuboid([3.0, 8.0, 6.0]), [10.0 + 6.0 * side, 8.0, 4.0]);
            w.colliders.push(Collider { motion: path(times, ways.to_vec()), ..jaw });
        }
    });
    world.settings.max_fill = 256.0;
    // Narrowing a gap from 6 cells to one accelerates the liquid that leaves it by this factor.
    let put_in = kinetic(6.0 * 30.0 * DX) + kinetic(sound(&world)) + lift(16.0);
    Some(Abuse { world, time: 0.3, host: nobody, put_in, rest: 4.0, still: STILL, middle: 0.5..2.2 })
}

/// A box is moved elsewhere in the pool every third step, and out of it in the end.
fn a_box_that_jumps_about_in_liquid(scheme: Scheme) -> Option<Abuse> {
    fn jump(solver: &mut dyn Simulate, step: u32) {
        let at = |i: u32, n: u32| f64::from(i * 7 % n);
        let mut position = DVec3::new(2.0 + at(step, 9), 2.0 + at(step + 1, 3), 2.0 + at(step + 2, 9));
        if solver.time() > 0.25 {
            position.y = 14.0;
        }
        if step.is_multiple_of(3) {
            let pose = Pose { position: position * DX, rotation: DQuat::from_rotation_y(f64::from(step)) };
            solver.set_collider(0, Some(pose), DVec3::ZERO, DVec3::ZERO).expect("a pose");
        }
    }
    let world = tank([12.0, 20.0, 12.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [12.0, 5.0, 12.0], [0.0; 3]));
        w.colliders.push(body(cuboid([2.0, 2.0, 2.0]), [6.0, 14.0, 6.0]));
    });
    // The matter that it displaces is compressed by its volume, an eleventh of all.
    let put_in = kinetic(sound(&world) / 4.0) + lift(20.0);
    Some(Abuse { world, time: 0.3, host: jump, put_in, rest: 4.0, still: STILL, middle: 2.0..3.2 })
}

/// Rubber of 1e5 Pa. Its stress follows strains as large as those of liquids.
fn rubber() -> Material {
    Material { viscosity: 20.0, viscous_relaxation: 0.02, relaxation: 1.0, ..Material::elastic("water") }
}

/// Energy that rubber stores at this logarithmic strain, J/kg.
fn stored(strain: f64) -> f64 {
    let (young, density) = (1e5, 1000.0);
    young * strain * strain / density
}

/// The published scheme has no modulus; its stiffness follows from the iterations, about 2μ.
fn stored_in(world: &World, strain: f64) -> f64 {
    let settings = &world.settings;
    if settings.scheme != Scheme::Published {
        return stored(strain);
    }
    0.25 * f64::from(settings.iterations) * (DX / settings.dt).powi(2) * strain * strain
}

fn rubber_in(cells: [f64; 3], scheme: Scheme, fill: impl FnOnce(&mut World)) -> World {
    let mut world = empty(cells, Wall::Friction(0.5));
    world.materials[0] = rubber();
    fill(&mut world);
    realtime(&mut world, scheme);
    world
}

/// A plate pushes a block of 6 by 6 by 6 cells through a hole of 4 by 4, and withdraws.
fn rubber_through_a_keyhole(scheme: Scheme) -> Option<Abuse> {
    let world = rubber_in([12.0, 36.0, 12.0], scheme, |w| {
        w.spawns.push(block([3.0, 20.0, 3.0], [9.0, 26.0, 9.0], [0.0; 3]));
        for side in [-1.0, 1.0] {
            w.colliders.push(body(cuboid([4.0, 2.0, 6.0]), [6.0 + 6.0 * side, 17.5, 6.0]));
            w.colliders.push(body(cuboid([6.0, 2.0, 4.0]), [6.0, 17.5, 6.0 + 6.0 * side]));
        }
        let plate = body(cuboid([1.9, 3.0, 1.9]), [6.0, 30.0, 6.0]);
        w.colliders.push(Collider {
            motion: path(vec![0.0, 0.6, 0.7], vec![DVec3::ZERO, DVec3::Y * -14.0, DVec3::ZERO]),
            ..plate
        });
    });
    let put_in = stored_in(&world, 1.0) + kinetic(2.0 * 140.0 * DX) + lift(10.0);
    // Parts that the plate tears out of it may hang over the plate.
    Some(Abuse { world, time: 0.8, host: nobody, put_in, rest: 3.0, still: STILL, middle: 0.5..32.0 })
}

/// Plates meet in the middle of a block and separate again.
fn rubber_pressed_to_nothing(scheme: Scheme) -> Option<Abuse> {
    let mut world = rubber_in([20.0, 14.0, 14.0], scheme, |w| {
        w.spawns.push(block([7.0, 0.0, 4.0], [13.0, 6.0, 10.0], [0.0; 3]));
        for side in [-1.0, 1.0] {
            let ways = [0.0, 3.0, 3.0, -1.0].map(|x| DVec3::X * -side * x);
            let plate = body(cuboid([3.0, 8.0, 8.0]), [10.0 + 6.0 * side, 7.0, 7.0]);
            w.colliders.push(Collider { motion: path(vec![0.0, 0.3, 0.35, 0.5], ways.to_vec()), ..plate });
        }
    });
    world.settings.max_fill = 256.0;
    let put_in = stored_in(&world, 10f64.ln()) + kinetic(6.0 * 27.0 * DX) + lift(14.0);
    Some(Abuse { world, time: 0.5, host: nobody, put_in, rest: 3.0, still: STILL, middle: 0.3..5.0 })
}

/// A tool turns the middle of a block by some radians in each step, against the rest of it.
fn rubber_turned_inside_out(scheme: Scheme) -> Option<Abuse> {
    fn stir(solver: &mut dyn Simulate, _: u32) {
        let turn = if solver.time() < 0.1 { 2.0 / solver.dt() } else { 0.0 };
        let action = pbmpm::Action::Stir { angular_velocity: DVec3::new(0.3, 1.0, -0.4) * turn, time: 0.0 };
        let tool =
            pbmpm::Tool { action, radius: 3.0 * DX, position: DVec3::new(8.0, 3.0, 8.0) * DX, velocity: DVec3::ZERO };
        solver.set_tools(if turn > 0.0 { std::slice::from_ref(&tool) } else { &[] }).expect("a tool");
    }
    let world = rubber_in([16.0, 16.0, 16.0], scheme, |w| {
        w.spawns.push(block([5.0, 0.0, 5.0], [11.0, 6.0, 11.0], [0.0; 3]));
    });
    let fastest = world.settings.max_displacement * DX / world.settings.dt;
    let put_in = kinetic(fastest) + stored_in(&world, 10f64.ln());
    Some(Abuse { world, time: 0.15, host: stir, put_in, rest: 4.0, still: STILL, middle: 0.3..5.0 })
}

/// 8 cells of matter at 100 cells per step.
fn shot(world: &mut World, way: DVec3) {
    let speed = 100.0 * DX / world.settings.dt;
    world.spawns.push(Spawn { velocity: way * speed, ..block([7.0, 14.0, 3.0], [9.0, 16.0, 5.0], [0.0; 3]) });
}

fn a_bullet_into_a_pool(scheme: Scheme) -> Option<Abuse> {
    let mut world = tank([16.0, 20.0, 8.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [16.0, 5.0, 8.0], [0.0; 3]));
    });
    shot(&mut world, DVec3::NEG_Y);
    Some(Abuse { world, time: 0.1, host: nobody, put_in: 0.0, rest: 4.0, still: STILL, middle: 2.0..3.2 })
}

fn a_bullet_into_rubber(scheme: Scheme) -> Option<Abuse> {
    let mut world = rubber_in([16.0, 20.0, 8.0], scheme, |w| {
        w.spawns.push(block([5.0, 0.0, 1.0], [11.0, 6.0, 7.0], [0.0; 3]));
    });
    shot(&mut world, DVec3::NEG_Y);
    Some(Abuse { world, time: 0.1, host: nobody, put_in: 0.0, rest: 4.0, still: STILL, middle: 0.3..5.0 })
}

/// Isolated particles at 3 m/s.
fn rain_of_single_particles(scheme: Scheme) -> Option<Abuse> {
    let mut world = tank([12.0, 40.0, 12.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [12.0, 4.0, 12.0], [0.0; 3]));
        let cloud =
            Emitter::new("water", cuboid([5.0, 1.0, 5.0]), DVec3::new(6.0, 38.0, 6.0) * DX, Rate::Particles(1e3));
        w.emitters.push(Emitter { velocity: DVec3::NEG_Y * 3.0, end: Some(0.8), ..cloud });
    });
    world.settings.capacity = Some(6000);
    let put_in = kinetic(3.0) + lift(38.0);
    Some(Abuse { world, time: 1.0, host: nobody, put_in, rest: 3.0, still: STILL, middle: 2.0..3.0 })
}

/// 256 cells deep.
fn a_deep_tank(scheme: Scheme) -> Option<Abuse> {
    let world = tank([2.0, 260.0, 2.0], scheme, |w| {
        let few = Fill::PerCell(8.0);
        w.spawns.push(Spawn { fill: few, jitter: 0.2, ..block([0.0; 3], [2.0, 256.0, 2.0], [0.0; 3]) });
    });
    let depth = 256.0 * DX;
    let (mut still, mut middle) = (STILL, 100.0..130.0);
    if scheme == Scheme::Published {
        // At this depth it is too soft for gravity; released as if weightless it oscillates about its height at rest
        // for a minute.
        let strain = G * depth / sound(&world).powi(2);
        (still, middle) = (256.0 * strain / 6.0, 0.5 * (1.0 - 0.5 * strain) * 256.0..130.0);
    }
    Some(Abuse { world, time: 0.5, host: nobody, put_in: 0.0, rest: 1.0, still, middle })
}

/// Step lengths alternate while a block falls into a pool.
fn steps_four_times_as_long_and_short(scheme: Scheme) -> Option<Abuse> {
    fn jump(solver: &mut dyn Simulate, step: u32) {
        let dt = solver.dt() * if step.is_multiple_of(2) { 0.25 } else { 4.0 };
        solver.set_dt(dt).expect("a step");
    }
    let world = tank([14.0, 20.0, 8.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [14.0, 5.0, 8.0], [0.0; 3]));
        w.spawns.push(block([4.0, 10.0, 2.0], [9.0, 15.0, 6.0], [0.0, -1.0, 0.0]));
    });
    Some(Abuse { world, time: 0.6, host: jump, put_in: lift(0.5), rest: 4.0, still: STILL, middle: 2.2..3.4 })
}

/// Reversed every tenth of a second for six tenths.
fn gravity_upside_down(scheme: Scheme) -> Option<Abuse> {
    fn flip(solver: &mut dyn Simulate, _: u32) {
        let up = (solver.time() / 0.1) as u32 % 2 == 1 && solver.time() < 0.59;
        solver.set_gravity(DVec3::Y * if up { G } else { -G }).expect("a gravity");
    }
    let world = tank([8.0, 14.0, 8.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [8.0, 7.0, 8.0], [0.0; 3]));
    });
    // Each time the middle may end up below the other side.
    Some(Abuse { world, time: 0.65, host: flip, put_in: 6.0 * lift(14.0), rest: 4.0, still: STILL, middle: 2.8..4.5 })
}

/// Back and forth along all axes, half full.
fn a_domain_of_one_block_shaken(scheme: Scheme) -> Option<Abuse> {
    fn shake(solver: &mut dyn Simulate, step: u32) {
        let way = [DVec3::X, DVec3::NEG_Z, DVec3::Y, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y][step as usize / 3 % 6];
        solver.set_gravity(if solver.time() < 0.28 { way * 20.0 * G } else { DVec3::Y * -G }).expect("a gravity");
    }
    let world = tank([4.0, 4.0, 4.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [4.0, 2.0, 4.0], [0.0; 3]));
    });
    // Falls from one end of the block to the other, in succession without loss.
    let put_in = 20.0 * lift(4.0) * 4.0;
    Some(Abuse { world, time: 0.3, host: shake, put_in, rest: 4.0, still: STILL, middle: 0.8..1.5 })
}

/// From wall to wall, on nodes and middles of edges, with velocities along each.
fn particles_on_every_boundary(scheme: Scheme) -> Option<Abuse> {
    let mut world = tank([8.0, 16.0, 8.0], scheme, |w| {
        let matter = block([0.0; 3], [8.0, 4.0, 8.0], [0.5, 0.0, -0.5]);
        w.spawns.push(Spawn { fill: Fill::Inclusive(UVec3::new(17, 9, 17)), ..matter });
        // A box whose faces coincide with particles.
        w.colliders.push(body(cuboid([1.0, 1.0, 1.0]), [4.0, 5.0, 4.0]));
    });
    // Half a cell more on each side than fits.
    world.settings.max_fill = 32.0;
    let put_in = kinetic(sound(&world) * 0.15) + lift(2.0);
    Some(Abuse { world, time: 0.1, host: nobody, put_in, rest: 3.0, still: STILL, middle: 1.8..3.0 })
}

/// Almost half a turn per step, for a fifth of a second.
fn rotors_at_absurd_speed(scheme: Scheme) -> Option<Abuse> {
    fn turn(solver: &mut dyn Simulate, _: u32) {
        let speed = if solver.time() < 0.18 { (3.1 / solver.dt()).min(9.9e3) } else { 0.0 };
        for (i, axis) in [DVec3::Y, DVec3::new(0.6, 0.0, 0.8)].into_iter().enumerate() {
            solver.set_collider(i, None, DVec3::ZERO, axis * speed).expect("a speed");
        }
    }
    let world = tank([16.0, 20.0, 12.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [16.0, 6.0, 12.0], [0.0; 3]));
        for (at, boundary) in [([5.0, 2.5, 6.0], Boundary::Stick), ([12.0, 3.0, 6.0], Boundary::Friction(0.5))] {
            w.colliders.push(Collider { boundary, ..body(cuboid([3.5, 1.0, 0.75]), at) });
        }
    });
    let put_in = kinetic(world.settings.max_displacement * DX / world.settings.dt);
    Some(Abuse { world, time: 0.2, host: turn, put_in, rest: 4.0, still: STILL, middle: 2.2..4.0 })
}

/// Each particle is removed once, and particles outside of both stay.
fn two_drains_over_the_same_particles(scheme: Scheme) -> Option<Abuse> {
    fn remove(solver: &mut dyn Simulate, step: u32) {
        let floor = Region::new(cuboid([4.0, 0.4, 4.0]), DVec3::new(6.0, 0.0, 6.0) * DX);
        if step < 20 {
            solver.remove(&floor).expect("a region");
        }
    }
    let world = tank([12.0, 12.0, 12.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [12.0, 6.0, 12.0], [0.0; 3]));
        for shape in [ball(2.0), cuboid([1.0, 1.5, 2.0])] {
            w.drains.push(Region::new(shape, DVec3::new(6.0, 4.5, 6.0) * DX));
        }
    });
    // The remaining matter is higher for a while.
    Some(Abuse { world, time: 0.3, host: remove, put_in: lift(1.0), rest: 4.0, still: STILL, middle: 0.3..3.2 })
}

/// Full to the lid; one emitter has the gate, the other does not.
fn emitters_into_a_full_tank(scheme: Scheme) -> Option<Abuse> {
    let mut world = tank([8.0, 8.0, 8.0], scheme, |w| {
        w.spawns.push(block([0.0; 3], [8.0, 8.0, 8.0], [0.0; 3]));
        for (x, fill_limit) in [(2.0, 1.2), (6.0, 1.6)] {
            let at = DVec3::new(x, 4.0, 4.0) * DX;
            let emitter = Emitter::new("water", ball(1.0), at, Rate::Particles(2e4));
            w.emitters.push(Emitter { velocity: DVec3::NEG_Y, fill_limit, end: Some(0.3), ..emitter });
        }
    });
    world.settings.capacity = Some(8000);
    world.settings.max_fill = 64.0;
    let put_in = kinetic(1.0) + kinetic(sound(&world) * 0.4) + lift(4.0);
    Some(Abuse { world, time: 0.35, host: nobody, put_in, rest: 3.0, still: STILL, middle: 3.0..4.5 })
}
