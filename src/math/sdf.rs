//! Signed distance and outward normal of the collider shapes. Twin: `shaders/lib/sdf.wgsl`.

use super::distance_grid::DistanceGrid;
use super::real::{Lanes, Real};

/// Shape tags, the same numbers as in the shader.
pub const BOX: u32 = 0;
/// See [`BOX`].
pub const SPHERE: u32 = 1;
/// See [`BOX`].
pub const HALF_SPACE: u32 = 2;
/// See [`BOX`].
pub const CAPSULE: u32 = 3;
/// See [`BOX`].
pub const CYLINDER: u32 = 4;

/// A shape given by a [`DistanceGrid`]; the last tag, and the only shape that need not be convex.
pub const GRID: u32 = 5;

/// Added to a shape's tag: the body fills everything outside of the shape.
pub const INVERTED: u32 = 1 << 8;

/// Distance from a centre or an axis, in cells, below which there is no direction away from it.
const APART: f64 = 1e-12;

/// Distance to the surface (negative inside) and outward unit normal of four points, in the shape's own frame.
///
/// `kind` is a shape's tag, with or without [`INVERTED`]. `size` holds the half edges of a box; otherwise the radius in
/// `size[0]` and half the height in `size[1]`. `grid` holds the distances of a [`GRID`].
#[inline(always)]
pub fn distance_normal<R: Real>(
    kind: u32,
    size: [R::V; 3],
    grid: Option<&DistanceGrid>,
    p: [R::V; 3],
) -> (R::V, [R::V; 3]) {
    let (distance, normal) = match kind & !INVERTED {
        BOX => box_distance_normal::<R>(size, p),
        SPHERE => sphere_distance_normal::<R>(size[0], p),
        CAPSULE => capsule_distance_normal::<R>(size[0], size[1], p),
        CYLINDER => cylinder_distance_normal::<R>(size[0], size[1], p),
        GRID => grid_distance_normal::<R>(grid, p),
        _ => (p[1], up::<R>()),
    };
    if is_inverted(kind) { (-distance, normal.map(|c| -c)) } else { (distance, normal) }
}

/// Whether a body fills the outside of its shape.
#[inline(always)]
pub fn is_inverted(kind: u32) -> bool {
    kind & INVERTED != 0
}

/// Whether a body is given by a grid of distances.
#[inline(always)]
pub fn is_grid(kind: u32) -> bool {
    kind & !INVERTED == GRID
}

/// Number of walls of a container: parts of its surface that meet in edges, at right angles.
#[inline(always)]
pub fn walls(kind: u32) -> usize {
    match kind & !INVERTED {
        BOX => 3,
        CYLINDER => 2,
        _ => 1,
    }
}

/// Distance into a container's inside from one of its walls, as if it were the only one, and the normal away from the
/// wall. A pair of opposite faces counts as one wall.
#[inline(always)]
pub fn wall_distance_normal<R: Real>(kind: u32, wall: usize, size: [R::V; 3], p: [R::V; 3]) -> (R::V, [R::V; 3]) {
    match (kind & !INVERTED, wall) {
        (BOX, axis) => faces_distance_normal::<R>(axis, size[axis], p),
        (CYLINDER, 0) => {
            let (around, away) = around_axis::<R>(p);
            (size[0] - around, [-away[0], R::V::all(R::of(0.0)), -away[1]])
        }
        (CYLINDER, _) => faces_distance_normal::<R>(1, size[1], p),
        _ => distance_normal::<R>(kind, size, None, p),
    }
}

#[inline(always)]
fn faces_distance_normal<R: Real>(axis: usize, half: R::V, p: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let mut normal = [zero; 3];
    normal[axis] = p[axis].below(zero).pick(one, -one);
    (half - p[axis].abs(), normal)
}

fn up<R: Real>() -> [R::V; 3] {
    [0.0, 1.0, 0.0].map(|c| R::V::all(R::of(c)))
}

/// Four points one by one, since each uses other grid points.
#[inline(never)]
fn grid_distance_normal<R: Real>(grid: Option<&DistanceGrid>, p: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let Some(grid) = grid else { return (p[1], up::<R>()) };
    let p = p.map(Lanes::to4);
    let found = [0, 1, 2, 3].map(|n| grid.distance_normal([p[0][n], p[1][n], p[2][n]]));
    (R::V::from4(found.map(|f| f.0)), [0, 1, 2].map(|a| R::V::from4(found.map(|f| f.1[a]))))
}

#[inline(always)]
fn box_distance_normal<R: Real>(half: [R::V; 3], p: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let side = p.map(|x| x.below(zero).pick(-one, one));
    let q = [0, 1, 2].map(|a| p[a].abs() - half[a]);
    let out = q.map(|q| q.max(zero));
    let length = (out[0] * out[0] + out[1] * out[1] + out[2] * out[2]).sqrt();
    let outside = zero.below(length);
    let inv = one / length;
    // Inside: the nearest face; of equally near ones that of the first axis.
    let x_is_nearest = q[1].at_most(q[0]).and(q[2].at_most(q[0]));
    let y_is_nearer = q[2].at_most(q[1]);
    let face = [
        x_is_nearest.pick(side[0], zero),
        x_is_nearest.pick(zero, y_is_nearer.pick(side[1], zero)),
        x_is_nearest.pick(zero, y_is_nearer.pick(zero, side[2])),
    ];
    let depth = x_is_nearest.pick(q[0], y_is_nearer.pick(q[1], q[2]));
    (outside.pick(length, depth), [0, 1, 2].map(|a| outside.pick(side[a] * out[a] * inv, face[a])))
}

#[inline(always)]
fn sphere_distance_normal<R: Real>(radius: R::V, p: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
    let apart = R::V::all(R::of(APART)).below(length);
    let inv = R::V::all(R::of(1.0)) / length;
    let up = up::<R>();
    (apart.pick(length - radius, -radius), [0, 1, 2].map(|a| apart.pick(p[a] * inv, up[a])))
}

#[inline(always)]
fn capsule_distance_normal<R: Real>(radius: R::V, half: R::V, p: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let r = [p[0], p[1] - p[1].min(half).max(-half), p[2]];
    let length = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
    let apart = R::V::all(R::of(APART)).below(length);
    let inv = one / length;
    // On the axis the surface is nearest sideways, in no particular direction.
    let aside = [one, zero, zero];
    (apart.pick(length - radius, -radius), [0, 1, 2].map(|a| apart.pick(r[a] * inv, aside[a])))
}

/// Distance from the y axis, and the direction away from it in x and z; on the axis, along x.
#[inline(always)]
fn around_axis<R: Real>(p: [R::V; 3]) -> (R::V, [R::V; 2]) {
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let around = (p[0] * p[0] + p[2] * p[2]).sqrt();
    let apart = R::V::all(R::of(APART)).below(around);
    let inv = one / around;
    (around, [apart.pick(p[0] * inv, one), apart.pick(p[2] * inv, zero)])
}

#[inline(always)]
fn cylinder_distance_normal<R: Real>(radius: R::V, half: R::V, p: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let side = p[1].below(zero).pick(-one, one);
    let (around, away) = around_axis::<R>(p);
    let q = [around - radius, p[1].abs() - half];
    let out = q.map(|q| q.max(zero));
    let length = (out[0] * out[0] + out[1] * out[1]).sqrt();
    let outside = zero.below(length);
    let inv = one / length;
    let shares = out.map(|out| out * inv);
    // Inside: the nearer of wall and end; the wall if they are equally near.
    let wall_is_nearer = q[1].at_most(q[0]);
    let depth = wall_is_nearer.pick(q[0], q[1]);
    let wall = away.map(|away| outside.pick(away * shares[0], wall_is_nearer.pick(away, zero)));
    let end = outside.pick(side * shares[1], wall_is_nearer.pick(zero, side));
    (outside.pick(length, depth), [wall[0], end, wall[1]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;
    use glam::DVec3;

    const SHAPES: [(Shape, u32, [f64; 3]); 7] = [
        (Shape::Box { half_size: DVec3::new(1.0, 2.0, 0.5) }, BOX, [1.0, 2.0, 0.5]),
        (Shape::Sphere { radius: 1.5 }, SPHERE, [1.5, 0.0, 0.0]),
        (Shape::Capsule { radius: 0.75, half_height: 1.25 }, CAPSULE, [0.75, 1.25, 0.0]),
        (Shape::Capsule { radius: 1.25, half_height: 0.25 }, CAPSULE, [1.25, 0.25, 0.0]),
        (Shape::Cylinder { radius: 0.75, half_height: 1.25 }, CYLINDER, [0.75, 1.25, 0.0]),
        (Shape::Cylinder { radius: 1.75, half_height: 0.25 }, CYLINDER, [1.75, 0.25, 0.0]),
        (Shape::HalfSpace, HALF_SPACE, [0.0; 3]),
    ];

    fn at<R: Real>(kind: u32, size: [f64; 3], p: DVec3) -> (f64, DVec3) {
        let all = |v: [f64; 3]| v.map(|x| R::V::all(R::of(x)));
        let (distance, normal) = distance_normal::<R>(kind, all(size), None, all(p.to_array()));
        let lane = |v: R::V| v.to4()[0].f64();
        (lane(distance), DVec3::from_array(normal.map(lane)))
    }

    /// Points in a box of 6 around the origin, also on the axes and in the planes of symmetry.
    fn points() -> impl Iterator<Item = DVec3> {
        (0..4000u32).map(|i| {
            let h = |k: u32| f64::from((i * 7919 + k * 104_729) % 1009) / 1009.0 * 6.0 - 3.0;
            let keep = |axis: u32| if i % 4 == 0 && i >> 2 >> axis & 1 == 0 { 0.0 } else { 1.0 };
            DVec3::new(h(1) * keep(0), h(2) * keep(1), h(3) * keep(2))
        })
    }

    #[test]
    fn distance_and_normal_agree_with_the_world_shapes() {
        for (shape, kind, size) in SHAPES {
            for p in points() {
                let expected = shape.signed_distance(p);
                let (d, n) = at::<f64>(kind, size, p);
                assert!((d - expected).abs() < 1e-12, "{shape:?} {p}: {d} {expected}");
                assert!((n.length() - 1.0).abs() < 1e-12, "{shape:?} {p}: {n}");
                // A step along the normal leads away from the shape by its length, also on ridges and axes.
                let walked = shape.signed_distance(p + n * 1e-6) - d;
                assert!((walked - 1e-6).abs() < 1e-9, "{shape:?} {p} {n}: {walked}");
                // Across the normal the distance does not change to first order, where there is only one normal.
                let gradient = DVec3::AXES
                    .map(|a| (shape.signed_distance(p + a * 1e-6) - shape.signed_distance(p - a * 1e-6)) / 2e-6);
                let gradient = DVec3::from_array(gradient);
                if (gradient.length() - 1.0).abs() < 1e-4 {
                    assert!(gradient.distance(n) < 1e-4, "{shape:?} {p}: {n} {gradient}");
                }
                let (single, normal) = at::<f32>(kind, size, p);
                assert!((single - d).abs() < 1e-6, "{shape:?} {p}: {single} {d}");
                assert!((normal.length() - 1.0).abs() < 1e-6, "{shape:?} {p}: {normal}");
            }
        }
    }

    /// The culling of bodies relies on this.
    #[test]
    fn distances_change_by_no_more_than_the_way_walked() {
        for (shape, kind, size) in SHAPES {
            for (p, q) in points().zip(points().skip(17)) {
                let (there, back) = (at::<f64>(kind, size, p).0, at::<f64>(kind, size, q).0);
                assert!((there - back).abs() <= p.distance(q) + 1e-12, "{shape:?} {p} {q}");
                // Convex: nowhere below a tangent.
                let (d, n) = at::<f64>(kind, size, p);
                assert!(back >= d + n.dot(q - p) - 1e-12, "{shape:?} {p} {q}");
            }
        }
    }

    #[test]
    fn edges_and_axes_have_the_normals_that_they_should() {
        let (r, h) = (0.75, 1.25);
        let diagonal = DVec3::new(1.0, 1.0, 0.0) / 2f64.sqrt();
        for (kind, p, distance, normal) in [
            (CAPSULE, DVec3::ZERO, -r, DVec3::X),
            (CAPSULE, DVec3::new(0.0, h, 0.0), -r, DVec3::X),
            (CAPSULE, DVec3::new(0.0, h + 0.25, 0.0), -0.5, DVec3::Y),
            (CAPSULE, DVec3::new(0.0, -h - r - 1.0, 0.0), 1.0, -DVec3::Y),
            (CAPSULE, DVec3::new(0.0, 0.5, -1.75), 1.0, -DVec3::Z),
            (CYLINDER, DVec3::ZERO, -r, DVec3::X),
            (CYLINDER, DVec3::new(0.0, 1.0, 0.0), -0.25, DVec3::Y),
            (CYLINDER, DVec3::new(0.0, -2.25, 0.0), 1.0, -DVec3::Y),
            (CYLINDER, DVec3::new(r, h, 0.0), 0.0, DVec3::X),
            (CYLINDER, DVec3::new(r, h, 0.0) + diagonal, 1.0, diagonal),
            (CYLINDER, DVec3::new(0.0, 0.5, -1.75), 1.0, -DVec3::Z),
        ] {
            let (d, n) = at::<f64>(kind, [r, h, 0.0], p);
            assert!((d - distance).abs() < 1e-12 && n.distance(normal) < 1e-12, "{kind} {p}: {d} {n}");
        }
    }
}
