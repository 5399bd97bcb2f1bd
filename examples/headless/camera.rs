//! The place from which the picture is taken, and the faces of colliders that hide the scene from there.

use glam::{DVec3, Mat4, Vec3};
use pbmpm::{Camera, Collider, Shape, Units, World};

/// A camera in cell units.
pub struct View {
    pub clip_from_cells: Mat4,
    pub eye: Vec3,
    pub forward: Vec3,
    pub up: Vec3,
    pub near: f32,
    /// Half the picture's height at distance 1.
    pub half_height: f32,
    /// Towards the sun: high, from the right and a little from behind the eye.
    pub sun: Vec3,
}

impl View {
    pub fn new(world: &World, units: &Units, aspect: f32) -> Self {
        let camera = camera_of(world);
        let eye = units.position_in(camera.position).as_vec3();
        let forward = (camera.target - camera.position).normalize().as_vec3();
        // Seen straight from above or below there is no horizon: −z is up in the picture.
        let zenith = if forward.y.abs() > 0.999 { Vec3::NEG_Z } else { Vec3::Y };
        let right = forward.cross(zenith).normalize();
        let up = right.cross(forward);
        // A fraction of a cell, or of the distance where cells are small compared with it.
        let near = 0.25f32.max(1e-3 * units.length_in((camera.target - camera.position).length()) as f32);
        let fov = (camera.vertical_fov as f32).to_radians();
        let clip = glam::camera::rh::proj::directx::perspective_infinite_reverse(fov, aspect, near);
        let view = glam::camera::rh::view::look_to_mat4(eye, forward, up);
        let back = right.cross(zenith);
        let sun = (0.85 * Vec3::Y + 0.5 * right + 0.3 * back).normalize();
        View { clip_from_cells: clip * view, eye, forward, up, near, half_height: (fov * 0.5).tan(), sun }
    }
}

pub fn camera_of(world: &World) -> Camera {
    world.camera.unwrap_or_else(|| Camera::overlooking(&world.domain))
}

/// A face of a collider at time 0: outward normal, middle and half edge vectors, m.
struct Face {
    normal: DVec3,
    middle: DVec3,
    edges: [DVec3; 2],
}

fn faces(world: &World, collider: &Collider) -> Vec<(u32, Face)> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| collider.rotation * axis);
    match collider.shape {
        // Containers are open to the view in any case.
        Shape::Box { .. } if collider.inverted => Vec::new(),
        Shape::Box { half_size } => (0..6)
            .map(|id| {
                let (axis, sign) = (id / 2, if id % 2 == 1 { 1.0 } else { -1.0 });
                let edge = |k: usize| axes[(axis + k) % 3] * half_size[(axis + k) % 3];
                let normal = axes[axis] * sign;
                let middle = collider.position + normal * half_size[axis];
                (id as u32, Face { normal, middle, edges: [edge(1), edge(2)] })
            })
            .collect(),
        Shape::HalfSpace => {
            let (centre, half) = plane_patch(world, collider.position, axes[1]);
            vec![(3, Face { normal: axes[1], middle: centre, edges: [axes[2] * half, axes[0] * half] })]
        }
        _ => Vec::new(),
    }
}

/// Middle and half edge, m, of the square that represents an unbounded plane through `point`.
pub fn plane_patch(world: &World, point: DVec3, normal: DVec3) -> (DVec3, f64) {
    let centre = (world.domain.min + world.domain.max) * 0.5;
    let half = (world.domain.max - world.domain.min).length() * 0.75;
    (centre - normal * (centre - point).dot(normal), half)
}

/// The faces of a resting collider that stand between the eye and much of the domain, as a mask over `2·axis + side`:
/// those whose plane separates the eye from the domain's middle and that cut more than a tenth of the sight lines to
/// the free space or to the matter at the start. They are drawn see-through; pillars, rims and floors stay solid.
pub fn hiding_faces(world: &World, collider: &Collider) -> u32 {
    const PER_AXIS: u32 = 6;
    let eye = camera_of(world).position;
    let (lo, size) = (world.domain.min, world.domain.max - world.domain.min);
    let free =
        |p: DVec3| world.colliders.iter().all(|c| c.signed_distance(c.rotation.inverse() * (p - c.position)) > 0.0);
    let suspects: Vec<_> = faces(world, collider)
        .into_iter()
        .filter(|(_, f)| f.normal.dot(eye - f.middle) > 0.0 && f.normal.dot(lo + size * 0.5 - f.middle) < 0.0)
        .collect();
    if suspects.is_empty() {
        return 0;
    }
    let steps = || (0..PER_AXIS).map(|i| (f64::from(i) + 0.5) / f64::from(PER_AXIS));
    let targets: Vec<DVec3> = steps()
        .flat_map(|x| steps().flat_map(move |y| steps().map(move |z| DVec3::new(x, y, z))))
        .map(|share| lo + size * share)
        .filter(|p| free(*p))
        .collect();
    let matter: Vec<DVec3> = world
        .spawns
        .iter()
        .flat_map(|s| corners(s.shape.half_extent().unwrap_or(DVec3::ZERO) * 0.8).map(|p| s.position + s.rotation * p))
        .collect();
    let hides = |f: &Face, points: &[DVec3]| points.iter().filter(|p| crosses(f, eye, **p)).count() * 10 > points.len();
    suspects.iter().filter(|(_, f)| hides(f, &targets) || hides(f, &matter)).fold(0, |mask, (id, _)| mask | 1 << id)
}

/// Corners of the cuboid around the origin with these half edges.
fn corners(half: DVec3) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |i| DVec3::select(glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), half, -half))
}

fn crosses(face: &Face, from: DVec3, to: DVec3) -> bool {
    let (a, b) = (face.normal.dot(from - face.middle), face.normal.dot(to - face.middle));
    let on_plane = from.lerp(to, a / (a - b)) - face.middle;
    a > 0.0 && b < 0.0 && face.edges.iter().all(|e| on_plane.dot(*e).abs() <= e.length_squared())
}

/// The largest speed that matter can gain by falling from its highest place to the domain's lowest, m/s.
pub fn fall_speed(world: &World) -> f64 {
    let g = world.gravity;
    let down = g.normalize_or_zero();
    let (lo, hi) = (world.domain.min, world.domain.max);
    let bottom = corners((hi - lo) * 0.5).map(|p| (p + (lo + hi) * 0.5).dot(down)).fold(f64::MIN, f64::max);
    let fastest = world.spawns.iter().map(|s| {
        let half = s.shape.half_extent().unwrap_or(DVec3::ZERO);
        let height = corners(half).map(|p| bottom - (s.position + s.rotation * p).dot(down)).fold(0.0, f64::max);
        (s.velocity.length_squared() + 2.0 * g.length() * height).sqrt()
    });
    let fastest = fastest.fold(0.0, f64::max);
    // Weightless and at rest, or no spawns: any scale will do.
    if fastest > 0.0 { fastest } else { (world.domain.max - world.domain.min).length() }
}
