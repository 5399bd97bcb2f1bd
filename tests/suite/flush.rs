//! Bodies that lie flush beside each other: their joints are no obstacles.

use crate::backends::{Backend, MOST, Tests};
use crate::worlds::{DX, block, body, cuboid, empty, larger, mean_velocity, particles};
use pbmpm::{Collider, DVec3, Model, Scheme, Shape, Wall, World};

pub fn add(tests: &mut Tests) {
    tests.each("flush", MOST, "matter_slides_over_joints", matter_slides_over_joints);
    tests.each("flush", MOST, "flush_walls_hold_nothing_up", flush_walls_hold_nothing_up);
    tests.each("flush", MOST, "a_box_is_the_same_along_all_axes", a_box_is_the_same_along_all_axes);
}

/// A slab that slides along a floor of these bodies, whose top is `up` cells above the nodes.
fn sliding(scheme: Scheme, model: Model, bodies: Vec<Collider>, up: f64) -> World {
    let mut world = empty([60.0, 16.0, 16.0], Wall::Open);
    world.materials[0].model = model;
    world.settings.scheme = scheme;
    let explicit = scheme == Scheme::Explicit;
    world.settings.dt = if explicit { 1.0 / 1200.0 } else { 1.0 / 240.0 };
    world.settings.iterations = if explicit { 1 } else { 6 };
    world.colliders = bodies;
    let top = 6.0 + up;
    world.spawns.push(block([6.0, top, 4.0], [16.0, top + 4.0, 12.0], [2.0, 0.0, 0.0]));
    world
}

/// A box between two corners, in cells.
fn cells(lo: [f64; 3], hi: [f64; 3]) -> Collider {
    let [lo, hi] = [lo, hi].map(DVec3::from_array);
    body(cuboid((0.5 * (hi - lo)).to_array()), (0.5 * (lo + hi)).to_array())
}

/// A floor of tiles six cells wide whose joints are `along` cells off the nodes, in rows that are shifted by half a tile.
fn tiles(up: f64, along: f64) -> Vec<Collider> {
    let row = |z: f64, first: f64| {
        (0..11).map(move |i| {
            let x = first + 6.0 * f64::from(i);
            cells([x, 1.0 + up, z], [x + 6.0, 6.0 + up, z + 8.0])
        })
    };
    row(0.0, along - 3.0).chain(row(8.0, along - 6.0)).collect()
}

/// On tiles, and over boxes sunk into the ground, as on one box.
fn matter_slides_over_joints(backend: Backend) {
    let water = Model::Liquid;
    let rubber = Model::Elastic { shape_weight: 1.0 };
    let sand = Model::Sand { friction_angle: 30.0 };
    for (scheme, model, up, along) in [
        (Scheme::Implicit, water, 0.0, 0.0),
        (Scheme::Implicit, rubber, 0.3, 0.4),
        (Scheme::Explicit, sand, 0.0, 0.0),
        (Scheme::Published, rubber, 0.0, 0.0),
    ] {
        let one = vec![cells([-4.0, 0.0, -4.0], [64.0, 6.0 + up, 20.0])];
        let ground = body(Shape::HalfSpace, [0.0, 6.0 + up, 0.0]);
        let sunk = vec![ground, cells([18.0, 2.0, 2.0], [24.0, 6.0 + up, 14.0])];
        let speeds = [one, tiles(up, along), sunk].map(|bodies| {
            let world = sliding(scheme, model, bodies, up);
            let mut solver = backend.solver(&world);
            solver.steps((0.2 / world.settings.dt).round() as u32).unwrap();
            mean_velocity(&mut *solver).x
        });
        assert!(speeds[0] > 1.9, "{scheme:?}, {model:?}: {speeds:?}");
        let off = speeds.map(|v| (v - speeds[0]).abs()).into_iter().fold(0.0, larger);
        assert!(off < 0.01, "{scheme:?}, {model:?}: {speeds:?}");
    }
}

/// Water that falls along a wall of boxes, a third of a cell before it: what it meets are the boxes' fronts.
fn flush_walls_hold_nothing_up(backend: Backend) {
    let mut world = empty([24.0, 60.0, 12.0], Wall::Open);
    world.settings.scheme = Scheme::Implicit;
    world.settings.dt = 1.0 / 240.0;
    world.settings.iterations = 6;
    let wall = (0..10).map(|i| cells([0.0, 6.0 * f64::from(i), -2.0], [6.0, 6.0 * f64::from(i) + 6.0, 14.0]));
    world.colliders = wall.collect();
    // It drifts towards the wall.
    world.spawns.push(block([6.3, 44.0, 3.0], [12.3, 52.0, 9.0], [-0.3, -1.0, 0.0]));
    let mut solver = backend.solver(&world);
    solver.steps(48).unwrap();
    // Velocities are those half a step before.
    let fallen = mean_velocity(&mut *solver).y + 1.0 + 9.81 * (solver.time() - 0.5 * world.settings.dt);
    assert!(fallen.abs() < 0.005, "{fallen} m/s");
    let inside = particles(&mut *solver).iter().map(|p| 6.0 * DX - p.position.x).fold(0.0, larger);
    assert!(inside < 1e-3 * DX, "{inside}");
}

/// A column collapses against a box that stands on the floor, between the walls, with its edges on nodes: in whichever
/// order the axes are taken, it ends alike.
fn a_box_is_the_same_along_all_axes(backend: Backend) {
    let ends = [[0, 1, 2], [2, 1, 0], [1, 2, 0], [0, 2, 1]].map(|axes| {
        let turned = |v: [f64; 3]| {
            let mut turned = [0.0; 3];
            axes.iter().zip(v).for_each(|(axis, v)| turned[*axis] = v);
            turned
        };
        let mut world = empty(turned([28.0, 16.0, 8.0]), Wall::Slip);
        world.gravity = DVec3::from_array(turned([0.0, -9.81, 0.0]));
        world.materials[0].model = Model::Viscoplastic { yield_strain: 0.02 };
        world.materials[0].youngs_modulus = 1e5;
        world.materials[0].yield_stress = Some(200.0);
        world.settings.scheme = Scheme::Explicit;
        world.settings.dt = 1.0 / 1200.0;
        world.colliders = vec![cells(turned([14.0, 0.0, 0.0]), turned([18.0, 4.0, 8.0]))];
        world.spawns.push(block([0.0; 3], turned([12.0, 12.0, 8.0]), [0.0; 3]));
        let mut solver = backend.solver(&world);
        solver.steps(240).unwrap();
        let all = particles(&mut *solver);
        let mean = all.iter().map(|p| p.position).sum::<DVec3>() / (all.len() as f64 * DX);
        DVec3::from_array(axes.map(|axis| mean[axis]))
    });
    let apart = ends.map(|end| end.distance(ends[0])).into_iter().fold(0.0, larger);
    assert!(ends[0].x > 6.3, "it has not come to the box: {ends:?}");
    assert!(apart < 0.003, "{apart} cells apart: {ends:?}");
}
