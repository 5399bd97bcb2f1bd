//! Quadratic B-spline on grid nodes. Twin: `shaders/lib/kernel.wgsl`.

use super::real::{Lanes, Real};

/// Index of the first of the three nodes on an axis.
#[inline(always)]
pub fn base<R: Real>(x: R) -> u32 {
    (x - R::of(0.5)).floor_index()
}

/// Of the three nodes on each axis, with the axes as lanes; the fourth lane means nothing.
#[derive(Debug, Clone, Copy)]
pub struct Stencil<R: Real> {
    /// Indices of the first.
    pub first: [u32; 3],
    /// Weights of the three.
    pub weights: [R::V; 3],
    /// Distances from the particle to the middle one.
    pub middle: R::V,
}

impl<R: Real> Stencil<R> {
    /// For a particle at `position`, in cells.
    #[inline(always)]
    pub fn at(position: [R; 4]) -> Self {
        let half = R::V::all(R::of(0.5));
        let x = R::V::from4(position);
        let ([i, j, k, _], first) = R::truncated(x - half);
        // In [0.5, 1.5).
        let f = x - first;
        let a = R::V::all(R::of(1.5)) - f;
        let b = f - R::V::all(R::of(1.0));
        let c = f - half;
        let weights = [half * a * a, R::V::all(R::of(0.75)) - b * b, half * c * c];
        Stencil { first: [i, j, k], weights, middle: R::V::all(R::of(1.0)) - f }
    }

    /// The weights of the three nodes on an axis.
    #[inline(always)]
    pub fn along(&self, axis: usize) -> [R; 3] {
        let [a, b, c] = self.weights;
        [a.to4()[axis], b.to4()[axis], c.to4()[axis]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_reproduce_constants_and_linears_and_have_inertia_a_quarter() {
        for i in 0..100 {
            let x = 7.5 + f64::from(i) * 0.01;
            let stencil = Stencil::at([x, 3.0, x, 0.0]);
            for axis in [0, 2] {
                let (first, w) = (stencil.first[axis], stencil.along(axis));
                let moment = |n: i32| (0..3).map(|k| w[k] * (f64::from(first) + k as f64 - x).powi(n)).sum::<f64>();
                assert!((moment(0) - 1.0).abs() < 1e-14);
                assert!(moment(1).abs() < 1e-14);
                assert!((moment(2) - 0.25).abs() < 1e-14);
                assert!((f64::from(first) + 1.0 - x - stencil.middle.to4()[axis]).abs() < 1e-14);
                assert_eq!(first, base(x));
            }
        }
    }
}
