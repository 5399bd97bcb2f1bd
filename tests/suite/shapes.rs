//! Every shape: the same distances on every device, as much matter as its volume, and nothing passes its surface.

use crate::alike::{assert_pass, assert_states, rounds_by_itself};
use crate::backends::{ALL, Backend, CPUS, DEVICES, MOST, NATIVE, Tests};
use crate::kernels::run_kernel;
use crate::worlds::{
    DX, after, apart, assert_sound, ball, block, body, capsule, cuboid, cylinder, depth, empty, larger,
};
use crate::worlds::{one, particles, state};
use pbmpm::lockstep::compare_step;
use pbmpm::math::sdf;
use pbmpm::{Boundary, Collider, CpuSolver, DQuat, DVec3, Fill, Motion, Shape, Simulate, Spawn, Wall, World};
use wide::f32x4;

pub fn add(tests: &mut Tests) {
    tests.each("shapes", DEVICES, "surfaces_have_the_bits_of_the_cpu", surfaces_have_the_bits_of_the_cpu);
    tests.once("shapes", "spawns_fill_their_volume", spawns_fill_their_volume);
    tests.each("shapes", ALL, "nothing_fast_enters_a_body", nothing_fast_enters_a_body);
    tests.each("shapes", ALL, "nothing_leaves_a_container", nothing_leaves_a_container);
    tests.each("shapes", MOST, "a_pool_in_a_cylinder_comes_to_rest", a_pool_in_a_cylinder_comes_to_rest);
    tests.each("shapes", CPUS, "a_box_of_walls_is_six_planes", a_box_of_walls_is_six_planes);
    tests.each("shapes", NATIVE, "every_pass_beside_every_shape", every_pass_beside_every_shape);
    tests.each("shapes", NATIVE, "every_pass_in_every_container", every_pass_in_every_container);
}

/// Uniformly distributed numbers in −1 … 1; the same in every run.
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A uniformly distributed direction.
pub fn direction(random: &mut impl FnMut() -> f64) -> DVec3 {
    loop {
        let v = DVec3::new(random(), random(), random());
        if (0.1..1.0).contains(&v.length()) {
            return v.normalize();
        }
    }
}

const MAIN: &str = "
struct Asked {
    point: vec3f,
    kind: u32,
    size: vec3f,
    padding: f32,
}

@group(0) @binding(0) var<storage, read> asked: array<Asked>;
@group(0) @binding(1) var<storage, read_write> results: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i < arrayLength(&asked) {
        let found = surface(asked[i].kind, asked[i].size, asked[i].point);
        results[i] = vec4f(found.normal, found.distance);
    }
}
";

#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Asked {
    point: [f32; 3],
    kind: u32,
    size: [f32; 3],
    padding: f32,
}

const KINDS: [(&str, u32); 5] = [
    ("SHAPE_BOX", sdf::BOX),
    ("SHAPE_SPHERE", sdf::SPHERE),
    ("SHAPE_CAPSULE", sdf::CAPSULE),
    ("SHAPE_CYLINDER", sdf::CYLINDER),
    ("SHAPE_HALF_SPACE", sdf::HALF_SPACE),
];

/// Distances and normals at random points and where shapes have special cases: axes, faces, edges, corners.
fn surfaces_have_the_bits_of_the_cpu(backend: Backend) {
    let mut random = random(1);
    let mut asked = Vec::new();
    for i in 0..100_000u32 {
        let size = [0; 3].map(|_| 2.0 + 1.9 * random() as f32);
        let special = |at: usize, x: f64| match i >> (2 * at) & 3 {
            0 => 0.0,
            1 => size[at].copysign(x as f32),
            _ => 6.0 * x as f32,
        };
        let point = [special(0, random()), special(1, random()), special(2, random())];
        let kind = KINDS[i as usize % KINDS.len()].1 | if random() < 0.0 { sdf::INVERTED } else { 0 };
        asked.push(Asked { point, kind, size, padding: 0.0 });
    }
    let names: String = KINDS
        .iter()
        .chain(&[("INVERTED", sdf::INVERTED)])
        .map(|(name, kind)| format!("const {name} = {kind}u;\n"))
        .collect();
    let text = [&*names, &*pbmpm::shaders::library("sdf"), MAIN].concat();
    let found: Vec<[f32; 4]> = run_kernel(backend, &text, &asked, asked.len());
    for (a, out) in asked.iter().zip(&found) {
        let expected = |point: [f32; 3]| {
            let lanes = |v: [f32; 3]| v.map(f32x4::splat);
            let (distance, normal) = sdf::distance_normal::<f32>(a.kind, lanes(a.size), None, lanes(point));
            let first = |v: f32x4| v.to_array()[0];
            [first(normal[0]), first(normal[1]), first(normal[2]), first(distance)]
        };
        let here = expected(a.point);
        if rounds_by_itself(backend) {
            let like = |expected: [f32; 4]| expected.iter().zip(out).all(|(a, b)| (a - b).abs() < 1e-5);
            assert!(like(here) || beside(a.point).map(expected).any(like), "{a:?}: {here:?} {out:?}");
        } else {
            assert_eq!(here, *out, "{a:?}");
        }
    }
}

/// Points within two roundings of a point's coordinates. Where two sides of a shape meet, these decide which side is
/// nearer, and thus the normal.
fn beside(point: [f32; 3]) -> impl Iterator<Item = [f32; 3]> {
    (0..6).map(move |way| {
        let mut moved = point;
        moved[way / 2] += if way % 2 == 0 { 1e-6 } else { -1e-6 };
        moved
    })
}

fn spawns_fill_their_volume() {
    use std::f64::consts::PI;
    for (shape, volume) in [
        (ball(6.0), 4.0 / 3.0 * PI * 216.0),
        (capsule(5.0, 4.0), PI * 25.0 * 8.0 + 4.0 / 3.0 * PI * 125.0),
        (cylinder(6.0, 3.0), PI * 36.0 * 6.0),
    ] {
        let mut world = empty([30.0; 3], Wall::Slip);
        let rotation = DQuat::from_scaled_axis(DVec3::new(0.3, 0.2, 0.7));
        let (position, fill) = (DVec3::splat(15.0 * DX), Fill::PerCell(8.0));
        world.spawns.push(Spawn {
            shape: shape.clone(),
            position,
            rotation,
            fill,
            ..block([0.0; 3], [1.0; 3], [0.0; 3])
        });
        let cells = world.particle_count().unwrap() as f64 / 8.0;
        assert!((cells / volume - 1.0).abs() < 0.02, "{shape:?}: {cells} cells, its volume is {volume}");
        let now = CpuSolver::<f64>::new(&world).unwrap().particles().unwrap();
        for p in now {
            let local = rotation.inverse() * (p.position - position);
            assert!(shape.signed_distance(local) < 1e-9, "{local} is not in {shape:?}");
        }
    }
}

/// Bodies that particles could pass in a step: thin, pointed, flat, at arbitrary rotations.
fn bodies() -> [Collider; 5] {
    let shapes = [cuboid([0.3, 2.0, 1.0]), ball(0.7), capsule(0.25, 2.0), cylinder(0.3, 2.5), cylinder(2.0, 0.2)];
    let mut random = random(2);
    shapes.map(|shape| {
        let mut body = body(shape, [16.0; 3]);
        body.rotation = DQuat::from_scaled_axis(direction(&mut random) * 2.0 * random());
        body
    })
}

/// 60 particles from all sides at 2 to 4 cells per step, aimed at the body's inside: after each step none is inside it.
/// For a body at rest the bound on motion is exact up to rounding.
fn nothing_fast_enters_a_body(backend: Backend) {
    for (i, body) in (3..).zip(bodies()) {
        let mut world = empty([32.0; 3], Wall::Open);
        world.gravity = DVec3::ZERO;
        let mut random = random(i);
        let half = body.shape.half_extent().unwrap();
        for _ in 0..60 {
            let target = body.position + body.rotation * (half * 0.7 * DVec3::new(random(), random(), random()));
            let from = direction(&mut random);
            let velocity = from * -(3.0 + random()) * DX / world.settings.dt;
            world.spawns.push(Spawn { velocity, ..one(target + from * (8.0 + 3.0 * random()) * DX) });
        }
        world.colliders.push(body);
        let mut solver = backend.solver(&world);
        let mut came_near = 0;
        for _ in 0..12 {
            solver.steps(1).unwrap();
            let inside = depth(&world, &mut *solver) / DX;
            assert!(inside < backend.pick(1e-9, 1e-4), "{inside} cells inside {:?}", world.colliders[0].shape);
            came_near += usize::from(inside > -0.01);
        }
        assert!(came_near > 0, "nothing has come to {:?}", world.colliders[0].shape);
    }
}

/// A container of each shape, at arbitrary rotations.
fn containers() -> [Collider; 4] {
    let shapes = [cuboid([5.0, 3.0, 4.0]), ball(5.0), capsule(3.0, 4.0), cylinder(5.0, 3.0)];
    let mut random = random(12);
    shapes.map(|shape| {
        let mut body = body(shape, [16.0; 3]);
        body.rotation = DQuat::from_scaled_axis(direction(&mut random) * 2.0 * random());
        body.inverted = true;
        body
    })
}

/// 60 particles at up to 4 cells per step in a container that is at rest, is moved or turned, or has friction; a third
/// of them are aimed at corners and edges. After each step all are inside. Where the wall moves and the bound on speed
/// shortens the motion of a particle that is carried along, the end of the step corrects that.
fn nothing_leaves_a_container(backend: Backend) {
    for (i, container) in (30..).zip(containers()) {
        for motion in 0..6 {
            let mut world = empty([32.0; 3], Wall::Open);
            world.gravity = DVec3::ZERO;
            let per_second = DX / world.settings.dt;
            let mut random = random(i);
            let (body, half) = (container.clone(), container.shape.half_extent().unwrap());
            let mut wanted = 60;
            while wanted > 0 {
                let local = half * DVec3::new(random(), random(), random());
                if body.signed_distance(local) < 0.3 * DX {
                    continue;
                }
                wanted -= 1;
                let corner = half * DVec3::new(random(), random(), random()).signum();
                let aim = if wanted % 3 == 0 { (corner - local).normalize() } else { direction(&mut random) };
                let velocity = body.rotation * aim * (3.0 + random()) * per_second;
                world.spawns.push(Spawn { velocity, ..one(body.position + body.rotation * local) });
            }
            world.colliders.push(body);
            let body = &mut world.colliders[0];
            match motion {
                1 => body.angular_velocity = direction(&mut random) * 0.05 / world.settings.dt,
                2 => body.linear_velocity = direction(&mut random) * 0.5 * per_second,
                3 => body.boundary = Boundary::Stick,
                4 => {
                    body.motion = Some(Motion::Oscillate {
                        amplitude: direction(&mut random) * DX,
                        frequency: 10.0,
                        phase: 0.0, // begins where the particles were placed
                        angular_amplitude: direction(&mut random) * 0.1,
                    });
                }
                5 => {
                    let dt = world.settings.dt;
                    body.motion = Some(Motion::Keyframes {
                        times: vec![0.0, 2.5 * dt, 7.1 * dt],
                        positions: vec![DVec3::ZERO, direction(&mut random) * DX, DVec3::ZERO],
                        rotations: [0.0, 0.2, 0.0].map(DQuat::from_rotation_x).to_vec(),
                        repeat: true,
                    });
                }
                _ => {}
            }
            let mut solver = backend.solver(&world);
            for step in 0..12 {
                let before = particles(&mut *solver);
                let end = after(&mut *solver, 1);
                let outside = depth(&world, &mut *solver) / DX;
                let most = backend.pick(1e-9, 1e-4);
                assert!(outside < most, "{outside} cells in the wall of {:?}, step {step}", world.colliders[0]);
                // In one at rest the motion itself ends inside, and nothing needs correction.
                let moved =
                    before.iter().zip(&end).map(|(a, b)| b.position - a.position - b.velocity * world.settings.dt);
                let mended = moved.map(|rest| rest.length() / DX).fold(0.0, larger);
                assert!(motion != 0 || mended < most, "{mended} cells mended, step {step}: {:?}", world.colliders[0]);
            }
            assert_sound(&particles(&mut *solver));
        }
    }
}

/// 6 cells of liquid in a cylinder with a radius of 4 cells, in a domain without walls: after a second it is in the
/// cylinder and at rest.
///
/// Its weight takes 7 % of the height (see `a_pool_at_rest_stays_at_rest`), and walls oblique to the grid one and a
/// half times as much: 18 % in all, 19 % between four upright half-spaces turned by an eighth.
fn a_pool_in_a_cylinder_comes_to_rest(backend: Backend) {
    let mut world = empty([12.0, 12.0, 12.0], Wall::Open);
    world.settings.dt = 1.0 / 240.0;
    world.colliders.push(Collider { inverted: true, ..body(cylinder(4.0, 5.0), [6.0; 3]) });
    let position = DVec3::new(6.0, 4.0, 6.0) * DX;
    world.spawns.push(Spawn { shape: cylinder(4.0, 3.0), position, ..block([0.0; 3], [1.0; 3], [0.0; 3]) });
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, 240);
    assert_sound(&end);
    let outside = depth(&world, &mut *solver) / DX;
    assert!(outside < 1e-4, "{outside} cells in the wall");
    let now = state(&mut *solver);
    let height = end.len() as f64 / 8.0 / (std::f64::consts::PI * 16.0);
    let lost = 1.0 - 2.0 * (now.centre_of_mass_m[1] / DX - 1.0) / height;
    assert!(lost > 0.0 && lost < 0.2, "{lost} of the height is lost");
    let left = now.kinetic_j / (now.mass_kg * 9.81 * 6.0 * DX);
    assert!(left < 1e-3, "{left} of the energy of a fall");
    let middle = DVec3::from_array(now.centre_of_mass_m) / DX - DVec3::splat(6.0);
    assert!(middle.with_y(0.0).length() < 0.05, "the liquid leans: {middle}");
}

/// A rotated box as a container and the six half-spaces of its faces are equivalent, friction and corners included.
fn a_box_of_walls_is_six_planes(backend: Backend) {
    let rotation = DQuat::from_scaled_axis(DVec3::new(0.5, 0.3, -0.2));
    let half = DVec3::new(4.0, 3.0, 5.0);
    let boundary = Boundary::Friction(0.3);
    let mut world = empty([16.0; 3], Wall::Open);
    world.spawns.push(Spawn { rotation, ..block([5.0, 6.0, 4.0], [11.0, 10.0, 12.0], [1.0, -0.5, 0.5]) });
    let mut planes = world.clone();
    world.colliders.push(Collider { inverted: true, rotation, boundary, ..body(cuboid(half.to_array()), [8.0; 3]) });
    for normal in [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z] {
        let at = DVec3::splat(8.0) - rotation * (normal * half);
        let rotation = rotation * DQuat::from_rotation_arc(DVec3::Y, normal);
        planes.colliders.push(Collider { rotation, boundary, ..body(Shape::HalfSpace, at.to_array()) });
    }
    let (mut one, mut six) = (backend.solver(&world), backend.solver(&planes));
    let (a, b) = (after(&mut *one, 25), after(&mut *six, 25));
    let far = apart(&a, &b) / DX;
    assert!(far < backend.pick(1e-9, 1e-2), "{far} cells apart");
    assert!(apart(&a, &after(&mut *backend.solver(&world), 0)) > DX, "they have moved");
}

/// A liquid that falls on a body of each shape, all rotated and moving in every way.
fn on_every_shape() -> World {
    let mut world = empty([18.0, 14.0, 12.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns.push(block([1.0, 5.0, 1.0], [17.0, 8.0, 11.0], [0.0, -1.0, 0.0]));
    world.spawns[0].fill = Fill::PerCell(4.0);
    let shapes = [cuboid([2.0, 1.0, 1.0]), ball(1.5), capsule(0.75, 2.0), cylinder(1.5, 1.0), cylinder(0.5, 3.0)];
    let mut random = random(8);
    for (i, shape) in (0..).zip(shapes) {
        let mut body = body(shape, [3.0 + 3.0 * f64::from(i), 3.0, 6.0 + 2.0 * random()]);
        body.rotation = DQuat::from_scaled_axis(direction(&mut random) * 1.5 * random());
        match i {
            0 | 1 => body.angular_velocity = direction(&mut random) * 6.0,
            2 => {
                body.motion = Some(Motion::Oscillate {
                    amplitude: DVec3::new(0.0, 0.5 * DX, 0.0),
                    frequency: 3.0,
                    phase: 0.0,
                    angular_amplitude: direction(&mut random),
                });
            }
            3 => {
                body.motion = Some(Motion::Keyframes {
                    times: vec![0.0, 0.07, 0.3],
                    positions: vec![DVec3::ZERO, DVec3::new(0.0, DX, DX), DVec3::X * DX],
                    rotations: [0.0, 1.0, -1.0].map(DQuat::from_rotation_z).to_vec(),
                    repeat: false,
                });
            }
            _ => {}
        }
        body.boundary = [Boundary::Slip, Boundary::Friction(0.4), Boundary::Stick][i as usize % 3];
        world.colliders.push(body);
    }
    world
}

/// A liquid thrown about in a turning container of a shape, with a body in it.
fn in_a_container(container: Collider, boundary: Boundary) -> World {
    let mut world = empty([32.0; 3], Wall::Open);
    world.settings.iterations = 2;
    world.spawns.push(block([14.0; 3], [18.0; 3], [4.0, -2.0, 3.0]));
    world.colliders.push(Collider { angular_velocity: DVec3::new(1.0, 2.0, -3.0), boundary, ..container });
    world.colliders.push(body(ball(1.0), [16.0, 14.0, 16.0]));
    world.colliders.push(Collider { inverted: true, ..body(Shape::HalfSpace, [0.0, 30.0, 0.0]) });
    world
}

/// Both paths pass by pass during the impact, and as a whole afterwards. Drivers that run on a CPU give the CPU's bits;
/// a GPU may round differently.
fn every_pass_beside_every_shape(backend: Backend) {
    same_as_the_cpu(backend, &on_every_shape());
}

fn every_pass_in_every_container(backend: Backend) {
    for (container, boundary) in containers().into_iter().zip([
        Boundary::Friction(0.4),
        Boundary::Slip,
        Boundary::Stick,
        Boundary::Friction(0.1),
    ]) {
        same_as_the_cpu(backend, &in_a_container(container, boundary));
    }
}

pub fn same_as_the_cpu(backend: Backend, world: &World) {
    for d in compare_step(world, 15, &backend.choice(), None).unwrap() {
        assert_pass(&d, backend);
    }
    let (mut cpu, mut gpu) = (Backend::Cpu.solver(world), backend.solver(world));
    let (a, b) = (after(&mut *cpu, 30), after(&mut *gpu, 30));
    assert_sound(&b);
    assert_states(backend, &a, &b, "in the midst of the impact");
}
