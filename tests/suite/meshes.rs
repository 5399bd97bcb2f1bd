//! Meshes and heightfields: correct distances, the same on every device, and nothing passes their surface.

use crate::backends::{ALL, Backend, CPUS, MOST, NATIVE, Tests};
use crate::shapes::{direction, random, same_as_the_cpu};
use crate::worlds::{DX, after, apart, assert_sound, ball, block, body, depth, empty, one, particles, state};
use pbmpm::{
    Boundary, Collider, DQuat, DVec3, Emitter, Fate, Fill, Heightfield, Mesh, Motion, Quality, Rate, Region, Scheme,
    Shape, Simulate, Spawn, Wall, World,
};
use std::f64::consts::{PI, TAU};

pub fn add(tests: &mut Tests) {
    tests.once("meshes", "distances_are_those_of_the_shape", distances_are_those_of_the_shape);
    tests.once("meshes", "distances_change_by_no_more_than_root_three", distances_change_by_no_more_than_root_three);
    tests.once("meshes", "messy_meshes_have_an_inside", messy_meshes_have_an_inside);
    tests.once("meshes", "what_lies_buried_bounds_nothing", what_lies_buried_bounds_nothing);
    tests.once("meshes", "spawns_fill_their_volume", spawns_fill_their_volume);
    tests.each("meshes", NATIVE, "every_pass_beside_meshes", every_pass_beside_meshes);
    tests.each("meshes", ALL, "nothing_fast_enters_a_mesh", nothing_fast_enters_a_mesh);
    tests.each("meshes", ALL, "nothing_passes_a_thin_rotor", nothing_passes_a_thin_rotor);
    tests.each("meshes", ALL, "nothing_leaves_a_mesh_turned_inside_out", nothing_leaves_a_mesh_turned_inside_out);
    tests.each("meshes", MOST, "a_pool_on_a_heightfield_comes_to_rest", a_pool_on_a_heightfield_comes_to_rest);
    tests.each("meshes", ALL, "matter_comes_and_goes_in_meshes", matter_comes_and_goes_in_meshes);
    tests.each("meshes", MOST, "what_clamps_nothing_sticks", what_clamps_nothing_sticks);
    tests.each("meshes", CPUS, "a_pool_in_a_mesh_on_nodes_rests", a_pool_in_a_mesh_on_nodes_rests);
    tests.each("meshes", MOST, "a_mesh_of_a_box_rubs_as_a_box", a_mesh_of_a_box_rubs_as_a_box);
}

pub type Triangles = (Vec<DVec3>, Vec<[u32; 3]>);

/// A surface over `n` by `m` points that is closed in both directions, with `u` and `v` in turns.
pub fn closed(n: u32, m: u32, at: impl Fn(f64, f64) -> DVec3) -> Triangles {
    let points = (0..n).flat_map(|i| (0..m).map(move |k| (f64::from(i) / f64::from(n), f64::from(k) / f64::from(m))));
    let vertices = points.map(|(u, v)| at(u, v)).collect();
    let index = |i: u32, k: u32| i % n * m + k % m;
    let quad = |i: u32, k: u32| [index(i, k), index(i + 1, k), index(i + 1, k + 1), index(i, k + 1)];
    let quads = (0..n).flat_map(|i| (0..m).map(move |k| quad(i, k)));
    (vertices, quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// A torus about the y axis, lengths in cells.
pub fn torus(ring: f64, tube: f64) -> Triangles {
    closed(96, 48, |u, v| {
        let out = ring + tube * (TAU * v).cos();
        DVec3::new(out * (TAU * u).cos(), -tube * (TAU * v).sin(), out * (TAU * u).sin()) * DX
    })
}

/// A ball from an octahedron with subdivided faces, lengths in cells. Each triangle has corners of its own.
pub fn globe(radius: f64) -> Triangles {
    const N: u32 = 24;
    let mut vertices = Vec::new();
    for sides in 0..8 {
        let sign = |axis: u32| if sides >> axis & 1 == 1 { -1.0 } else { 1.0 };
        let mirrored = sign(0) * sign(1) * sign(2) < 0.0;
        let at = |i: u32, k: u32| {
            let p = DVec3::new(f64::from(N - i - k) * sign(0), f64::from(i) * sign(1), f64::from(k) * sign(2));
            p.normalize() * radius * DX
        };
        for i in 0..N {
            for k in 0..N - i {
                let mut found = vec![[at(i, k), at(i + 1, k), at(i, k + 1)]];
                if i + k + 1 < N {
                    found.push([at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)]);
                }
                vertices.extend(found.iter().flat_map(|&[a, b, c]| if mirrored { [a, c, b] } else { [a, b, c] }));
            }
        }
    }
    let count = vertices.len() as u32 / 3;
    (vertices, (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}

/// A box of 12 triangles with these half edges in cells.
pub fn slab(half: [f64; 3]) -> Triangles {
    let corner = |i: usize| DVec3::from_array([0, 1, 2].map(|a| if i >> a & 1 == 1 { half[a] } else { -half[a] })) * DX;
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    ((0..8).map(corner).collect(), quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// A shape of triangles with a distance grid of this spacing, in cells.
pub fn mesh((vertices, triangles): Triangles, grid_spacing: f64) -> Shape {
    Shape::Mesh(Mesh::new(vertices, triangles, grid_spacing * DX).unwrap_or_else(|e| panic!("{e}")))
}

fn torus_distance(p: DVec3, ring: f64, tube: f64) -> f64 {
    (p.x.hypot(p.z) - ring).hypot(p.y) - tube
}

/// For a box of triangles distances are exact at grid points; between them, and for round bodies of flat triangles,
/// they are within the errors of interpolation and of the triangles. Outside of the grid a distance never exceeds the
/// true one, and in front of a face it is short by at most the grid's margin.
fn distances_are_those_of_the_shape() {
    let mut random = random(40);
    for (name, triangles, spacing, within, distance) in [
        (
            "box",
            slab([3.0, 2.0, 1.0]),
            0.25,
            0.13,
            &(|p| crate::worlds::cuboid([3.0, 2.0, 1.0]).signed_distance(p * DX) / DX) as &dyn Fn(DVec3) -> f64,
        ),
        ("ball", globe(2.5), 0.25, 0.02, &|p: DVec3| p.length() - 2.5),
        // Down to half of the tube's radius, where spheres of that radius curve by h²/8 over half a cell, and the ring
        // somewhat more.
        ("torus", torus(3.0, 1.0), 0.25, 0.025, &|p| torus_distance(p, 3.0, 1.0)),
    ] {
        let shape = mesh(triangles, spacing);
        let half = shape.half_extent().unwrap() / DX;
        let mut worst = 0.0f64;
        for _ in 0..4000 {
            let p = DVec3::new(random(), random(), random()) * half * 1.1;
            let (found, exact) = (shape.signed_distance(p * DX) / DX, distance(p));
            // At a ball's centre, and on a torus' centre line and axis, the distance has a crease, too.
            let on_axis = name == "torus" && p.x.hypot(p.z) < 0.5;
            if name != "box" && (exact < -0.5 * half.min_element() || on_axis) {
                continue;
            }
            worst = worst.max((found - exact).abs());
            let far = p.normalize_or_zero() * (10.0 + 5.0 * random());
            let (found, exact) = (shape.signed_distance(far * DX) / DX, distance(far));
            assert!(found <= exact + within && found > 0.5 * exact, "{name} {far}: {found}, truly {exact}");
        }
        assert!(worst < within, "{name}: {worst} cells wrong");
        let above = DVec3::new(0.0, 30.0, 0.1);
        assert!((shape.signed_distance(above * DX) / DX - distance(above)).abs() < 3.0 * spacing, "{name}");
    }
    // The faces of a slab of whole spacings are planes of grid points.
    let shape = mesh(slab([2.0, 1.0, 1.0]), 0.25);
    for _ in 0..1000 {
        let p = DVec3::new(1.2 * random(), 0.7 + 0.7 * random().abs(), 0.2 * random());
        let (found, exact) = (shape.signed_distance(p * DX) / DX, p.y - 1.0);
        assert!((found - exact).abs() < 1e-6, "{p}: {found} {exact}");
    }
}

/// Culling and contact rely on this, also across a hole of half the ball, and from the grid to points outside of it.
fn distances_change_by_no_more_than_root_three() {
    let (vertices, triangles) = globe(3.0);
    // Faces are ordered by eighths of the ball.
    let open = (vertices, triangles[triangles.len() * 3 / 8..].to_vec());
    for shape in [mesh(open, 0.3), mesh(torus(3.0, 1.0), 0.25), mesh(slab([3.0, 0.4, 1.0]), 0.2), hills()] {
        let half = shape.half_extent().unwrap();
        let mut random = random(42);
        for i in 0..20_000 {
            let p = half * DVec3::new(random(), random(), random()) * 1.5;
            let q = p + direction(&mut random) * random() * DX * [0.01, 0.3, 3.0][i % 3];
            let (a, b) = (shape.signed_distance(p), shape.signed_distance(q));
            let most = 3f64.sqrt() * p.distance(q) * 1.001 + 1e-9;
            assert!((a - b).abs() <= most, "{shape:?} {p} {q}: {a} {b}, at most {most} apart");
        }
    }
}

/// A hole, doubled faces, reversed faces, two intersecting bodies.
fn messy_meshes_have_an_inside() {
    let (vertices, triangles) = globe(2.5);
    let torn = (vertices.clone(), triangles[100..].to_vec());
    let doubled = (vertices.clone(), [&triangles[..], &triangles[..1000]].concat());
    let inside_out = (vertices.clone(), triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect());
    let shifted = vertices.iter().map(|v| *v + DVec3::X * DX);
    let second = triangles.iter().map(|t| t.map(|i| i + vertices.len() as u32));
    let two = (vertices.iter().copied().chain(shifted).collect(), triangles.iter().copied().chain(second).collect());
    for (name, triangles) in [("torn", torn), ("doubled", doubled), ("inside out", inside_out), ("two", two)] {
        let shape = mesh(triangles, 0.25);
        let mut random = random(41);
        for _ in 0..1000 {
            let out = direction(&mut random);
            assert!(shape.signed_distance(out * 2.0 * DX) < 0.0, "{name}: {out} is inside");
            assert!(shape.signed_distance(out * 4.0 * DX) > 0.0, "{name}: {out} is outside");
        }
    }
}

/// Boxes between these corners, in cells, as one mesh.
pub fn boxes(corners: &[[[f64; 3]; 2]]) -> Triangles {
    let mut all = Triangles::default();
    for corners in corners {
        let [lo, hi] = corners.map(DVec3::from_array);
        let (vertices, triangles) = slab(((hi - lo) * 0.5).to_array());
        let first = all.0.len() as u32;
        all.0.extend(vertices.into_iter().map(|v| v + (lo + hi) * 0.5 * DX));
        all.1.extend(triangles.into_iter().map(|t| t.map(|i| first + i)));
    }
    all
}

/// A cup of five boxes, 8 cells wide inside: they overlap, or abut.
fn cup(overlap: bool) -> Triangles {
    let (end, floor) = if overlap { (6.0, -6.0) } else { (4.0, -4.0) };
    boxes(&[
        [[-6.0, -6.0, -6.0], [6.0, -4.0, 6.0]],
        [[-6.0, floor, -6.0], [-4.0, 6.0, 6.0]],
        [[4.0, floor, -6.0], [6.0, 6.0, 6.0]],
        [[-end, floor, -6.0], [end, 6.0, -4.0]],
        [[-end, floor, 4.0], [end, 6.0, 6.0]],
    ])
}

/// Boxes that overlap or abut, in rows and as a cup: the distances are those of one body, also where faces go through
/// grid points.
fn what_lies_buried_bounds_nothing() {
    let row = [[[-4.0, -1.5, -1.5], [0.0, 1.5, 1.5]], [[0.0, -1.5, -1.5], [4.0, 1.5, 1.5]]];
    let overlapping = [[[-4.0, -1.5, -1.5], [1.0, 1.5, 1.5]], [[-1.3, -1.5, -1.5], [4.0, 1.5, 1.5]]];
    for spacing in [0.5, 0.3] {
        let one = mesh(slab([4.0, 1.5, 1.5]), spacing);
        let whole = mesh(cup(false), spacing);
        let pairs = [
            (&one, mesh(boxes(&row), spacing)),
            (&one, mesh(boxes(&overlapping), spacing)),
            (&whole, mesh(cup(true), spacing)),
        ];
        let mut random = random(43);
        for (i, (expected, found)) in pairs.iter().enumerate() {
            for _ in 0..4000 {
                let p = 6.5 * DX * DVec3::new(random(), random(), random());
                let [a, b] = [*expected, found].map(|shape| shape.signed_distance(p) / DX);
                assert!((a - b).abs() < 0.1 * spacing, "{i} at {}: {a} {b}", p / DX);
            }
        }
        let wall = DVec3::new(5.0, -4.0, 0.0) * DX;
        assert!((whole.signed_distance(wall) / DX + 1.0).abs() < spacing, "no crack between floor and wall");
    }
}

fn spawns_fill_their_volume() {
    let sixths = |(v, t): &Triangles| {
        t.iter().map(|t| t.map(|i| v[i as usize] / DX)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum::<f64>()
    };
    for (name, triangles, exact) in [
        ("torus", torus(6.0, 2.5), 2.0 * PI * PI * 6.0 * 6.25),
        ("ball", globe(6.0), 4.0 / 3.0 * PI * 216.0),
        ("box", slab([5.0, 3.0, 4.0]), 480.0),
    ] {
        assert!((sixths(&triangles) / exact - 1.0).abs() < 0.01, "{name}: {}", sixths(&triangles));
        let mut world = empty([30.0; 3], Wall::Slip);
        let (position, fill) = (DVec3::splat(15.0 * DX), Fill::PerCell(8.0));
        let shape = mesh(triangles, 0.25);
        world.spawns.push(Spawn { shape: shape.clone(), position, fill, ..block([0.0; 3], [1.0; 3], [0.0; 3]) });
        let cells = world.particle_count().unwrap() as f64 / 8.0;
        assert!((cells / exact - 1.0).abs() < 0.02, "{name}: {cells} cells, its volume is {exact}");
        let (a, b) = (Backend::Cpu64.solver(&world), Backend::Cpu64.solver(&world));
        let [a, b] = [a, b].map(|mut solver| particles(&mut *solver));
        assert_eq!(a, b, "the same particles each time");
        assert!(a.iter().all(|p| shape.signed_distance(p.position - position) < 1e-9), "{name}");
    }
}

/// Bodies that are not convex, thin, or much finer than a cell.
fn bodies() -> [Shape; 4] {
    [mesh(torus(3.0, 0.8), 0.25), mesh(slab([2.0, 0.15, 2.0]), 0.1), mesh(globe(1.0), 0.2), hills()]
}

/// Ground of 8 by 8 cells.
fn hills() -> Shape {
    let height = |x: f64, z: f64| ((x * 0.9).sin() + (z * 0.7).cos()) * 0.8 * DX;
    let rows = (0..17).map(|z| (0..17).map(|x| height(f64::from(x) * 0.5, f64::from(z) * 0.5)).collect()).collect();
    Shape::Heightfield(Heightfield::new(rows, 0.5 * DX, DX, 0.25 * DX).unwrap())
}

/// 60 particles from all sides at 2 to 4 cells per step: after each step none is inside the body.
fn nothing_fast_enters_a_mesh(backend: Backend) {
    for (i, shape) in (50..).zip(bodies()) {
        let mut world = empty([32.0; 3], Wall::Open);
        world.gravity = DVec3::ZERO;
        let mut random = random(i);
        let mut body = body(shape, [16.0; 3]);
        body.rotation = DQuat::from_scaled_axis(direction(&mut random) * 2.0 * random());
        let half = body.shape.half_extent().unwrap();
        for _ in 0..60 {
            let target = body.position + body.rotation * (half * 0.7 * DVec3::new(random(), random(), random()));
            let from = direction(&mut random);
            let velocity = from * -(3.0 + random()) * DX / world.settings.dt;
            world.spawns.push(Spawn { velocity, ..one(target + from * (8.0 + 2.0 * random()) * DX) });
        }
        world.colliders.push(body);
        let mut solver = backend.solver(&world);
        let mut came_near = 0;
        for step in 0..12 {
            solver.steps(1).unwrap();
            let inside = depth(&world, &mut *solver) / DX;
            assert!(inside < 2e-3, "{inside} cells inside {:?}, step {step}", world.colliders[0].shape);
            came_near += usize::from(inside > -0.05);
        }
        assert!(came_near > 0, "nothing has come to {:?}", world.colliders[0].shape);
    }
}

/// A plate of 0.3 cells that turns by 0.3 rad per step (the thesis' rotor at 10 Hz; its tips move 3 cells), in a cloud
/// of particles at up to a cell per step. None changes sides other than around an edge.
fn nothing_passes_a_thin_rotor(backend: Backend) {
    let mut world = empty([40.0; 3], Wall::Open);
    world.gravity = DVec3::ZERO;
    world.settings.dt = 0.1;
    let half = DVec3::new(10.0, 4.0, 0.15);
    let mut random = random(60);
    let mut rotor = body(mesh(slab(half.to_array()), 0.075), [20.0; 3]);
    rotor.angular_velocity = DVec3::new(0.0, 3.0, 0.0);
    while world.spawns.len() < 300 {
        let local = DVec3::new(9.0, 4.0, 9.0) * DVec3::new(random(), random(), random()) * DX;
        if rotor.signed_distance(local) > 0.3 * DX {
            let velocity = direction(&mut random) * DX / world.settings.dt;
            world.spawns.push(Spawn { velocity, ..one(rotor.position + local) });
        }
    }
    world.colliders.push(rotor);
    let mut solver = backend.solver(&world);
    let local = |solver: &mut dyn Simulate| -> Vec<DVec3> {
        let pose = solver.poses()[0];
        let of = |p: &pbmpm::Particle| pose.rotation.inverse() * (p.position - pose.position) / DX;
        particles(solver).iter().map(of).collect()
    };
    let mut before = local(&mut *solver);
    let mut pushed = 0;
    for step in 0..30 {
        solver.steps(1).unwrap();
        let now = local(&mut *solver);
        for (a, b) in before.iter().zip(&now) {
            let at = *a + (*b - *a) * (a.z / (a.z - b.z));
            let through = a.z * b.z < 0.0 && at.x.abs() < half.x - 0.2 && at.y.abs() < half.y - 0.2;
            assert!(!through, "step {step}: from {a} to {b}");
            pushed += usize::from(b.z.abs() < 0.5 && b.x.abs() < half.x && b.y.abs() < half.y);
        }
        before = now;
    }
    assert!(pushed > 100, "the rotor meets matter: {pushed}");
}

/// An inverted torus holds particles that are thrown about in it, at rest, pushed and turned.
fn nothing_leaves_a_mesh_turned_inside_out(backend: Backend) {
    for motion in 0..4 {
        let mut world = empty([32.0; 3], Wall::Open);
        world.gravity = DVec3::ZERO;
        let per_second = DX / world.settings.dt;
        let mut random = random(70 + motion);
        let mut body = Collider { inverted: true, ..body(mesh(torus(6.0, 2.5), 0.4), [16.0; 3]) };
        let half = body.shape.half_extent().unwrap();
        while world.spawns.len() < 60 {
            let local = half * DVec3::new(random(), random(), random());
            if body.signed_distance(local) > 0.5 * DX {
                let velocity = direction(&mut random) * (3.0 + random()) * per_second;
                world.spawns.push(Spawn { velocity, ..one(body.position + local) });
            }
        }
        match motion {
            1 => body.angular_velocity = direction(&mut random) * 0.05 / world.settings.dt,
            2 => body.linear_velocity = direction(&mut random) * 0.5 * per_second,
            3 => body.boundary = Boundary::Stick,
            _ => {}
        }
        world.colliders.push(body);
        let mut solver = backend.solver(&world);
        for step in 0..12 {
            solver.steps(1).unwrap();
            let outside = depth(&world, &mut *solver) / DX;
            assert!(outside < 2e-3, "{outside} cells in the wall, step {step}, motion {motion}");
        }
        assert_sound(&particles(&mut *solver));
    }
}

/// Liquid poured into a bowl of ground: after a second and a half it lies in the bowl, at rest.
fn a_pool_on_a_heightfield_comes_to_rest(backend: Backend) {
    let mut world = empty([16.0, 14.0, 16.0], Wall::Open);
    world.settings.dt = 1.0 / 240.0;
    let height = |i: i32, k: i32| (0.12 * f64::from((i - 8) * (i - 8) + (k - 8) * (k - 8))).min(8.0) * DX;
    let rows = (0..17).map(|k| (0..17).map(|i| height(i, k)).collect()).collect();
    let bowl = Heightfield::new(rows, DX, DX, 0.5 * DX).unwrap();
    world.colliders.push(body(Shape::Heightfield(bowl), [8.0, 2.0, 8.0]));
    world.spawns.push(Spawn {
        shape: ball(2.5),
        position: DVec3::new(8.0, 6.0, 8.0) * DX,
        ..block([0.0; 3], [1.0; 3], [0.0; 3])
    });
    let mut solver = backend.solver(&world);
    let end = after(&mut *solver, 360);
    assert_sound(&end);
    let inside = depth(&world, &mut *solver) / DX;
    assert!(inside < 0.01, "{inside} cells in the ground");
    let now = state(&mut *solver);
    let left = now.kinetic_j / (now.mass_kg * 9.81 * 3.0 * DX);
    assert!(left < 0.01, "{left} of the energy of the fall");
    let middle = DVec3::from_array(now.centre_of_mass_m) / DX - DVec3::new(8.0, 2.0, 8.0);
    assert!(middle.with_y(0.0).length() < 0.3 && middle.y < 3.0, "it lies at {middle}");
}

/// Faces through grid nodes, and edges: in a mesh turned inside out, and in a cup whose parts overlap.
fn a_pool_in_a_mesh_on_nodes_rests(backend: Backend) {
    for (shape, inverted) in [(mesh(slab([4.0; 3]), 0.5), true), (mesh(cup(true), 0.5), false)] {
        for scheme in [Scheme::Implicit, Scheme::Explicit] {
            let mut world = empty([24.0; 3], Wall::Slip);
            world.spawns.push(Spawn { jitter: 0.1, ..block([8.0, 8.0, 8.0], [16.0, 14.0, 16.0], [0.0; 3]) });
            world.colliders.push(Collider { inverted, ..body(shape.clone(), [12.0; 3]) });
            world.settings = Quality::Realtime.settings_in(scheme, &world);
            let mut solver = backend.solver(&world);
            for _ in 0..30 {
                solver.advance(1.0 / 60.0).unwrap();
            }
            let now = state(&mut *solver);
            assert!(now.max_speed_m_s < 0.1, "{scheme:?}, inverted {inverted}: {} m/s", now.max_speed_m_s);
            let height = (now.centre_of_mass_m[1] / DX - 8.0) / 3.0;
            assert!((height - 1.0).abs() < 0.06, "{scheme:?}, inverted {inverted}: {height} of its height");
        }
    }
}

/// A block loses the same speed to friction on a box and on a mesh of the same box.
fn a_mesh_of_a_box_rubs_as_a_box(backend: Backend) {
    let speeds = [crate::worlds::cuboid([30.0, 2.0, 6.0]), mesh(slab([30.0, 2.0, 6.0]), 0.5)].map(|shape| {
        let mut world = empty([64.0, 12.0, 12.0], Wall::Slip);
        world.spawns.push(block([8.0, 4.0, 4.0], [14.0, 7.0, 8.0], [1.5, 0.0, 0.0]));
        world.colliders.push(Collider { boundary: Boundary::Friction(0.3), ..body(shape, [32.0, 2.0, 6.0]) });
        let mut solver = backend.solver(&world);
        solver.steps(24).unwrap();
        let now = state(&mut *solver);
        now.momentum[0] / now.mass_kg
    });
    assert!(speeds[0] < 1.2 && (speeds[0] - speeds[1]).abs() < 0.02, "{speeds:?} m/s");
}

/// Only convex bodies are clamps: meshes and containers that are `Fixed` act as `Stick` in all respects.
fn what_clamps_nothing_sticks(backend: Backend) {
    let ring = body(mesh(torus(3.0, 1.5), 0.25), [8.0, 4.0, 8.0]);
    let bowl = Collider { inverted: true, ..body(ball(7.0), [8.0, 8.0, 8.0]) };
    let ends = [Boundary::Fixed, Boundary::Stick].map(|boundary| {
        let mut world = empty([16.0, 16.0, 16.0], Wall::Slip);
        world.spawns.push(block([1.0; 3], [15.0, 12.0, 15.0], [0.0, -1.0, 0.0]));
        world.colliders = vec![Collider { boundary, ..ring.clone() }, Collider { boundary, ..bowl.clone() }];
        let mut solver = backend.solver(&world);
        solver.set_collider(0, None, DVec3::X, DVec3::Y).unwrap();
        after(&mut *solver, 12)
    });
    assert!(
        ends[0] == ends[1],
        "{} and {} particles, {} m apart",
        ends[0].len(),
        ends[1].len(),
        apart(&ends[0], &ends[1])
    );
}

/// A torus that emits, another that drains, and a region that a host removes while the world runs, with a mesh that is
/// new to the solver.
fn matter_comes_and_goes_in_meshes(backend: Backend) {
    let mut world = empty([24.0, 12.0, 12.0], Wall::Slip);
    world.gravity = DVec3::ZERO;
    world.settings.capacity = Some(6000);
    let at = |x: f64| DVec3::new(x, 6.0, 6.0) * DX;
    world.spawns.push(block([13.0, 1.0, 1.0], [23.0, 11.0, 11.0], [0.0; 3]));
    world.spawns[0].fill = Fill::PerCell(4.0);
    let ring = mesh(torus(3.0, 1.5), 0.25);
    world.emitters.push(Emitter::new("water", ring.clone(), at(6.0), Rate::Particles(400.0 / world.settings.dt)));
    world.drains.push(Region::new(ring.clone(), at(18.0)));
    let mut solver = backend.solver(&world);
    let mut cpu = Backend::Cpu.solver(&world);
    let alive = |solver: &mut dyn Simulate| -> Vec<DVec3> {
        particles(solver).iter().filter(|p| p.fate == Fate::Alive).map(|p| p.position).collect()
    };
    let deepest = |points: &[DVec3], shape: &Shape, x: f64| {
        points.iter().map(|p| shape.signed_distance(*p - at(x)) / DX).fold(f64::INFINITY, f64::min)
    };
    for solver in [&mut solver, &mut cpu] {
        solver.steps(1).unwrap();
    }
    let first = alive(&mut *solver);
    let emitted: Vec<_> = first.iter().copied().filter(|p| p.x < 12.0 * DX).collect();
    assert!(emitted.len() == 400 && emitted.iter().all(|p| ring.signed_distance(*p - at(6.0)) < 1e-5 * DX));
    assert!(deepest(&first, &ring, 18.0) > -1e-4, "left in the drain: {}", deepest(&first, &ring, 18.0));
    assert_eq!(first.len(), alive(&mut *cpu).len());
    let plate = mesh(slab([4.0, 1.0, 1.0]), 0.25);
    assert!(deepest(&first, &plate, 18.0) < -0.5, "there is matter to remove");
    for solver in [&mut solver, &mut cpu] {
        solver.remove(&Region::new(plate.clone(), at(18.0))).unwrap();
        solver.steps(1).unwrap();
    }
    let second = alive(&mut *solver);
    assert!(deepest(&second, &plate, 18.0) > -1e-4, "left in the region: {}", deepest(&second, &plate, 18.0));
    assert_eq!(second.len(), alive(&mut *cpu).len());
}

/// A liquid that falls on moving meshes, one of them a container, and flows over ground.
pub fn on_meshes() -> World {
    let mut world = empty([20.0, 16.0, 12.0], Wall::Slip);
    world.settings.iterations = 2;
    world.spawns.push(block([1.0, 6.0, 1.0], [19.0, 9.0, 11.0], [0.0, -1.0, 0.0]));
    world.spawns[0].fill = Fill::PerCell(4.0);
    let ring = mesh(torus(2.5, 0.8), 0.4);
    let mut first = body(ring.clone(), [4.0, 4.0, 6.0]);
    first.rotation = DQuat::from_rotation_x(0.5);
    first.angular_velocity = DVec3::new(1.0, 6.0, 0.0);
    first.boundary = Boundary::Friction(0.4);
    let mut second = body(ring, [10.0, 3.0, 6.0]);
    second.boundary = Boundary::Stick;
    second.motion = Some(Motion::Oscillate {
        amplitude: DVec3::new(0.0, 0.5 * DX, 0.0),
        frequency: 3.0,
        phase: 0.0,
        angular_amplitude: DVec3::Z,
    });
    let ground = Collider { boundary: Boundary::Friction(0.1), ..body(hills(), [15.5, 1.5, 6.0]) };
    let room = Collider { inverted: true, ..body(mesh(slab([9.7, 7.7, 5.7]), 0.5), [10.0, 8.0, 6.0]) };
    world.colliders.extend([first, second, ground, room]);
    world
}

/// Pass by pass during the impact, and as a whole afterwards.
fn every_pass_beside_meshes(backend: Backend) {
    same_as_the_cpu(backend, &on_meshes());
}
