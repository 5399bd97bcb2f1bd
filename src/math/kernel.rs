//! Quadratic B-spline on grid nodes. Twin: `shaders/lib/kernel.wgsl`.

use super::real::Real;

/// Index of the first of the three nodes per axis, and the distance to it, in [0.5, 1.5).
#[inline(always)]
pub fn base<R: Real>(x: R) -> (u32, R) {
    let first = (x - R::of(0.5)).floor_index();
    (first, x - R::of(f64::from(first)))
}

/// Weights of the three nodes for a particle at distance `f` from the first.
#[inline(always)]
pub fn weights<R: Real>(f: R) -> [R; 3] {
    let half = R::of(0.5);
    let a = R::of(1.5) - f;
    let b = f - R::of(1.0);
    let c = f - half;
    [half * a * a, R::of(0.75) - b * b, half * c * c]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_reproduce_constants_and_linears_and_have_inertia_a_quarter() {
        for i in 0..100 {
            let x = 7.5 + f64::from(i) * 0.01;
            let (first, f) = base(x);
            let w = weights(f);
            let moment = |n: i32| (0..3).map(|k| w[k] * (f64::from(first) + k as f64 - x).powi(n)).sum::<f64>();
            assert!((moment(0) - 1.0).abs() < 1e-14);
            assert!(moment(1).abs() < 1e-14);
            assert!((moment(2) - 0.25).abs() < 1e-14);
        }
    }
}
