//! Signed distance and outward normal of the collider shapes. Twin: `shaders/lib/sdf.wgsl`.

use super::real::{Lanes, Real};

/// Shape tags, the same numbers as in the shader.
pub const BOX: u32 = 0;
/// See [`BOX`].
pub const SPHERE: u32 = 1;
/// See [`BOX`].
pub const HALF_SPACE: u32 = 2;

/// Distance to the surface (negative inside) and outward unit normal of four points, in the shape's own frame.
///
/// `size` holds the half edges of a box or the radius in `size[0]`.
#[inline(always)]
pub fn distance_normal<R: Real>(kind: u32, size: [R::V; 3], p: [R::V; 3]) -> (R::V, [R::V; 3]) {
    match kind {
        BOX => box_distance_normal::<R>(size, p),
        SPHERE => sphere_distance_normal::<R>(size[0], p),
        _ => (p[1], up::<R>()),
    }
}

fn up<R: Real>() -> [R::V; 3] {
    [0.0, 1.0, 0.0].map(|c| R::V::all(R::of(c)))
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
    // Inside: the nearest face, the first axis of equals.
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
    let apart = R::V::all(R::of(1e-12)).below(length);
    let inv = R::V::all(R::of(1.0)) / length;
    let up = up::<R>();
    (apart.pick(length - radius, -radius), [0, 1, 2].map(|a| apart.pick(p[a] * inv, up[a])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;
    use glam::DVec3;
    use wide::f64x4;

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
                let all = |v: [f64; 3]| v.map(f64x4::splat);
                let (d, n) = distance_normal::<f64>(kind, all(size), all(p.to_array()));
                let d = d.to_array()[0];
                assert!((d - shape.signed_distance(p)).abs() < 1e-12);
                let n = DVec3::from_array(n.map(|c| c.to_array()[0]));
                assert!((n.length() - 1.0).abs() < 1e-12);
                // Walking along the normal leaves the shape.
                assert!(shape.signed_distance(p + n * 1e-6) > d);
            }
        }
    }
}
