//! Quadratic B-spline on grid nodes. Twin: `shaders/lib/kernel.wgsl`.

use super::real::{Lanes, Real};

/// Reach of a kernel along each axis, in cells: from a particle to the nodes that it contributes to, from a node to the
/// matter that it holds. Farther off the quadratic B-spline is zero.
pub const KERNEL_REACH: f64 = 1.5;

/// The share of a node's kernel N that lies before a plane at a distance d of 0 to [`KERNEL_REACH`] from it: 1 − ∫ N(z)
/// dz from d on. From half a cell on, where N = (1.5 − z)²/2, that is 1 − (1.5 − d)³/6.
#[inline(always)]
pub fn share_before<R: Real>(d: R::V) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    let rest = all(KERNEL_REACH) - d;
    let far = all(1.0) - rest * (rest * (rest * all(1.0 / 6.0)));
    all(0.5).below(d).pick(far, share_near::<R>(d))
}

/// The same up to half a cell, where N = ¾ − z²: ½ + ¾ d − ⅓ d³.
#[inline(always)]
pub fn share_near<R: Real>(d: R::V) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    all(0.5) + d * (all(0.75) - d * (d * all(1.0 / 3.0)))
}

/// Index of the first of the three nodes on an axis.
#[inline(always)]
pub fn base<R: Real>(x: R) -> u32 {
    (x - R::of(0.5)).floor_index()
}

/// The three nodes on each axis, with the axes as lanes; the fourth lane is meaningless.
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
        let a = R::V::all(R::of(KERNEL_REACH)) - f;
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

    /// Compared with sums of the weights that a node has at particles in small steps.
    #[test]
    fn shares_before_planes_are_integrals_of_weights() {
        let weight = |z: f64| {
            let stencil = Stencil::at([8.0 + z, 0.5, 0.5, 0.0]);
            8u32.checked_sub(stencil.first[0]).and_then(|n| stencil.along(0).get(n as usize).copied()).unwrap_or(0.0)
        };
        let (step, mut sum) = (1e-3, 0.0);
        for i in 0..3000 {
            let end = f64::from(i - 1500) * step;
            let [share, near] = [share_before::<f64>, share_near::<f64>].map(|of| of(Lanes::all(end)).to4()[0]);
            assert!(end < 0.0 || (share - sum).abs() < 1e-6, "{share} before {end}, not {sum}");
            assert!(end.abs() > 0.5 || (near - sum).abs() < 1e-6, "{near} before {end}, not {sum}");
            sum += weight(end + 0.5 * step) * step;
        }
        assert!((sum - 1.0).abs() < 1e-6);
    }

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
