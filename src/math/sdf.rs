//! Signed distance and outward normal of the collider shapes. Twin: `shaders/lib/sdf.wgsl`.

use super::real::Real;

/// Shape tags, the same numbers as in the shader.
pub const BOX: u32 = 0;
/// See [`BOX`].
pub const SPHERE: u32 = 1;
/// See [`BOX`].
pub const HALF_SPACE: u32 = 2;

/// Distance to the surface (negative inside) and outward unit normal, in the shape's own frame.
///
/// `size` holds the half edges of a box or the radius in `size[0]`.
#[inline(always)]
pub fn distance_normal<R: Real>(kind: u32, size: [R; 3], p: [R; 3]) -> (R, [R; 3]) {
    match kind {
        BOX => box_distance_normal(size, p),
        SPHERE => sphere_distance_normal(size[0], p),
        _ => (p[1], [R::of(0.0), R::of(1.0), R::of(0.0)]),
    }
}

#[inline(always)]
fn box_distance_normal<R: Real>(half: [R; 3], p: [R; 3]) -> (R, [R; 3]) {
    let zero = R::of(0.0);
    let sign = |x: R| if x < zero { R::of(-1.0) } else { R::of(1.0) };
    let q = [p[0].abs() - half[0], p[1].abs() - half[1], p[2].abs() - half[2]];
    let out = [q[0].max(zero), q[1].max(zero), q[2].max(zero)];
    let distance = (out[0] * out[0] + out[1] * out[1] + out[2] * out[2]).sqrt();
    if distance > zero {
        let inv = R::of(1.0) / distance;
        return (distance, [sign(p[0]) * out[0] * inv, sign(p[1]) * out[1] * inv, sign(p[2]) * out[2] * inv]);
    }
    // Inside: the nearest face, the first axis of equals.
    if q[0] >= q[1] && q[0] >= q[2] {
        (q[0], [sign(p[0]), zero, zero])
    } else if q[1] >= q[2] {
        (q[1], [zero, sign(p[1]), zero])
    } else {
        (q[2], [zero, zero, sign(p[2])])
    }
}

#[inline(always)]
fn sphere_distance_normal<R: Real>(radius: R, p: [R; 3]) -> (R, [R; 3]) {
    let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
    if length > R::of(1e-12) {
        let inv = R::of(1.0) / length;
        (length - radius, [p[0] * inv, p[1] * inv, p[2] * inv])
    } else {
        (-radius, [R::of(0.0), R::of(1.0), R::of(0.0)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;
    use glam::DVec3;

    #[test]
    fn distance_and_normal_agree_with_the_world_shapes() {
        let shapes = [
            (Shape::Box { half_size: DVec3::new(1.0, 2.0, 0.5) }, BOX, [1.0, 2.0, 0.5]),
            (Shape::Sphere { radius: 1.5 }, SPHERE, [1.5, 0.0, 0.0]),
            (Shape::HalfSpace, HALF_SPACE, [0.0; 3]),
        ];
        for (shape, kind, size) in shapes {
            for i in 0..1000u32 {
                let h = |k: u32| f64::from((i * 7919 + k * 104_729) % 1009) / 1009.0 * 6.0 - 3.0;
                let p = DVec3::new(h(1), h(2), h(3));
                let (d, n) = distance_normal(kind, size, p.to_array());
                assert!((d - shape.signed_distance(p)).abs() < 1e-12);
                let n = DVec3::from_array(n);
                assert!((n.length() - 1.0).abs() < 1e-12);
                // Walking along the normal leaves the shape.
                assert!(shape.signed_distance(p + n * 1e-6) > d);
            }
        }
    }
}
