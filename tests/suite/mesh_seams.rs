//! Meshes that stand on other bodies, and meshes with thin walls hold matter as boxes do.

use crate::backends::{Backend, CPUS, NATIVE, Tests};
use crate::meshes::{Triangles, boxes, closed, mesh, slab};
use crate::shapes::same_as_the_cpu;
use crate::worlds::{DX, after, assert_sound, block, body, cuboid, empty, state};
use pbmpm::{Boundary, Collider, DVec3, Fill, Quality, Scheme, Shape, Spawn, Wall};

pub fn add(tests: &mut Tests) {
    tests.once("mesh_seams", "amid_a_thin_part_there_is_a_way_out", amid_a_thin_part_there_is_a_way_out);
    tests.each("mesh_seams", CPUS, "a_mesh_stands_as_tight_as_a_box", a_mesh_stands_as_tight_as_a_box);
    tests.each("mesh_seams", &[Backend::Cpu], "a_ring_stands_tight", a_ring_stands_tight);
    tests.each("mesh_seams", &[Backend::Cpu], "a_thin_cup_holds_its_liquid", a_thin_cup_holds_its_liquid);
    tests.each("mesh_seams", NATIVE, "every_pass_at_the_foot_of_meshes", every_pass_at_the_foot_of_meshes);
}

/// Inside a plate, wherever its grid points lie, distances fall and rise across it, not along it.
fn amid_a_thin_part_there_is_a_way_out() {
    let middle = DVec3::new(0.0, 0.3, 0.2);
    for half in [0.5, 0.6, 0.75, 0.8, 1.0] {
        let plate = mesh(slab([half, 3.0, 3.0]), 0.5);
        for off in [-0.22, -0.1, 0.03, 0.15] {
            let slope = |axis: DVec3| {
                let [before, behind] =
                    [-0.01, 0.01].map(|by| plate.signed_distance((middle + axis * by).with_x(off) * DX));
                behind - before
            };
            let at = |x: f64| plate.signed_distance(middle.with_x(x) * DX);
            let across = (at(off + 0.01) - at(off - 0.01)).abs();
            let along = slope(DVec3::Y).hypot(slope(DVec3::Z));
            assert!(across > 1e-4 * DX && along < 0.01 * across, "{half} at {off}: {across} across, {along} along");
        }
    }
}

/// Nine cells of water behind a plate that stands on the domain's floor or on a box, on nodes and between them, thick
/// and thin.
fn a_mesh_stands_as_tight_as_a_box(backend: Backend) {
    let places = [(0.0, 12.0, 1.5), (0.0, 12.3, 0.6), (4.3, 12.3, 1.5), (4.3, 12.0, 0.6)];
    for (floor, at, half) in places {
        let mut world = empty([24.0, 20.0, 4.0], Wall::Slip);
        if floor > 0.0 {
            world.colliders.push(body(cuboid([20.0, floor, 8.0]), [12.0, 0.0, 2.0]));
        }
        world.colliders.push(body(mesh(slab([half, 6.0, 6.0]), 0.5), [at + half, floor + 6.0, 2.0]));
        world.spawns.push(Spawn { jitter: 0.2, ..block([0.0, floor, 0.0], [at, floor + 9.0, 4.0], [0.0; 3]) });
        for scheme in [Scheme::Implicit, Scheme::Explicit] {
            world.settings = Quality::Realtime.settings_in(scheme, &world);
            let mut solver = backend.solver(&world);
            let end = after(&mut *solver, (1.2 / world.settings.dt) as u32);
            assert_sound(&end);
            let beyond = end.iter().filter(|p| p.position.x > (at + half) * DX).count();
            let now = state(&mut *solver);
            let height = 2.0 * (now.centre_of_mass_m[1] / DX - floor) / 9.0;
            let place = format!("{scheme:?}, {half} at {at}, floor {floor}");
            assert!(beyond == 0, "{place}: {beyond} beyond the plate");
            assert!((height - 1.0).abs() < 0.04, "{place}: {height} of its height");
            assert!(now.max_speed_m_s < 0.25, "{place}: {} m/s", now.max_speed_m_s);
        }
    }
}

/// A wall around a circle, between these radii and of this height, in cells, as a polygon; its floor is open.
fn ring(inner: f64, outer: f64, height: f64) -> Triangles {
    closed(32, 4, |u, v| {
        let (radius, y) =
            [(inner, 0.0), (outer, 0.0), (outer, height), (inner, height)][(v * 4.0).round() as usize % 4];
        let (sin, cos) = (u * std::f64::consts::TAU).sin_cos();
        DVec3::new(radius * cos, y, radius * sin) * DX
    })
}

/// A column of water collapses in a ring that stands on a box, with its foot on nodes and between them.
fn a_ring_stands_tight(backend: Backend) {
    for (floor, at) in [(4.0, 12.0), (4.3, 12.3)] {
        let mut world = empty([24.0, 18.0, 24.0], Wall::Slip);
        world.colliders.push(body(cuboid([20.0, floor, 20.0]), [12.0, 0.0, 12.0]));
        world.colliders.push(body(mesh(ring(6.0, 8.0, 12.0), 0.5), [at, floor, at]));
        let (lo, hi) = (at - 4.5, at + 4.5);
        world.spawns.push(Spawn { jitter: 0.2, ..block([lo, floor, lo], [hi, floor + 9.0, hi], [0.0; 3]) });
        world.settings = Quality::Realtime.settings(&world);
        let mut solver = backend.solver(&world);
        let end = after(&mut *solver, (1.5 / world.settings.dt) as u32);
        assert_sound(&end);
        let middle = DVec3::new(at, 0.0, at) * DX;
        let out = end.iter().filter(|p| (p.position - middle).with_y(0.0).length() > 7.0 * DX).count();
        // The area of the circle as a polygon of 32 sides.
        let height = 9.0 * 81.0 / (16.0 * 36.0 * (std::f64::consts::TAU / 32.0).sin());
        let found = 2.0 * (state(&mut *solver).centre_of_mass_m[1] / DX - floor) / height;
        assert!(out == 0 && (found - 1.0).abs() < 0.08, "at {at}: {out} out, {found} of its height");
    }
}

/// A cup with walls a cell thick, between nodes. When its distances did not tell which way is out, it lost a quarter of
/// its height and kept losing.
fn a_thin_cup_holds_its_liquid(backend: Backend) {
    let cup = boxes(&[
        [[-7.0, -7.0, -7.0], [7.0, -6.0, 7.0]],
        [[-7.0, -7.0, -7.0], [-6.0, 6.0, 7.0]],
        [[6.0, -7.0, -7.0], [7.0, 6.0, 7.0]],
        [[-7.0, -7.0, -7.0], [7.0, 6.0, -6.0]],
        [[-7.0, -7.0, 6.0], [7.0, 6.0, 7.0]],
    ]);
    let mut world = empty([24.0; 3], Wall::Slip);
    world.colliders.push(body(mesh(cup, 0.5), [12.3, 10.3, 12.3]));
    world.spawns.push(Spawn { jitter: 0.2, ..block([6.3, 4.3, 6.3], [18.3, 14.3, 18.3], [0.0; 3]) });
    world.settings = Quality::Realtime.settings(&world);
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, (2.0 / world.settings.dt) as u32);
    assert_sound(&end);
    let now = state(&mut *solver);
    let height = 2.0 * (now.centre_of_mass_m[1] / DX - 4.3) / 10.0;
    assert!(height > 0.85 && now.max_speed_m_s < 0.5, "{height} of its height, {} m/s", now.max_speed_m_s);
}

/// Water that runs against a plate and a thin plate, which stand on a box, on the domain's floor and on each other.
fn every_pass_at_the_foot_of_meshes(backend: Backend) {
    let mut world = empty([20.0, 12.0, 10.0], Wall::Slip);
    world.settings.iterations = 3;
    let mut spawn = block([1.0, 2.3, 1.0], [9.0, 8.0, 9.0], [1.0, 0.0, 0.3]);
    spawn.fill = Fill::PerCell(4.0);
    world.spawns.push(spawn);
    let plate = |half: [f64; 3]| -> Shape { mesh(slab(half), 0.5) };
    let stands = |half: [f64; 3], at: [f64; 3]| -> Collider { body(plate(half), at) };
    world.colliders.push(body(cuboid([6.0, 2.3, 8.0]), [5.0, 0.0, 5.0]));
    world.colliders.push(stands([0.5, 3.0, 6.0], [9.8, 5.3, 5.0]));
    world.colliders.push(stands([3.0, 1.5, 1.5], [5.0, 3.8, 5.0]));
    world.colliders.push(Collider { boundary: Boundary::Stick, ..stands([1.0, 1.0, 1.0], [5.0, 6.3, 5.0]) });
    world.colliders.push(Collider { linear_velocity: DVec3::X * 0.2, ..stands([0.6, 4.0, 3.0], [16.0, 4.0, 5.0]) });
    same_as_the_cpu(backend, &world);
}
