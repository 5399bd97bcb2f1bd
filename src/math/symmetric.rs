//! Symmetric 3×3 matrices: stresses and strains. Twin: `shaders/lib/symmetric.wgsl`.

use super::linear::{add, dot, scale, sub, transform};
use super::real::Real;

/// A symmetric matrix.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Symmetric<R> {
    /// xx, yy, zz
    pub diagonal: [R; 3],
    /// yz, xz, xy
    pub off: [R; 3],
}

impl<R: Real> Symmetric<R> {
    /// The symmetric part of a matrix, without its mean.
    #[inline(always)]
    pub fn deviator(m: &[[R; 3]; 3]) -> Self {
        Symmetric::of(m).traceless()
    }

    /// The symmetric part of a matrix by columns.
    #[inline(always)]
    pub fn of(m: &[[R; 3]; 3]) -> Self {
        let half = R::of(0.5);
        Symmetric {
            diagonal: [m[0][0], m[1][1], m[2][2]],
            off: [half * (m[1][2] + m[2][1]), half * (m[0][2] + m[2][0]), half * (m[0][1] + m[1][0])],
        }
    }

    /// Sum of the diagonal.
    #[inline(always)]
    pub fn trace(&self) -> R {
        self.diagonal[0] + self.diagonal[1] + self.diagonal[2]
    }

    /// Without its mean.
    #[inline(always)]
    pub fn traceless(&self) -> Self {
        let mean = self.trace() * R::of(1.0 / 3.0);
        Symmetric { diagonal: self.diagonal.map(|c| c - mean), off: self.off }
    }

    /// By columns.
    #[inline(always)]
    pub fn columns(&self) -> [[R; 3]; 3] {
        let ([x, y, z], [yz, xz, xy]) = (self.diagonal, self.off);
        [[x, xy, xz], [xy, y, yz], [xz, yz, z]]
    }

    /// From the lanes that are stored for a particle.
    #[inline(always)]
    pub fn of_lanes([d, o]: &[[R; 4]; 2]) -> Self {
        Symmetric { diagonal: [d[0], d[1], d[2]], off: [o[0], o[1], o[2]] }
    }

    /// To these lanes.
    #[inline(always)]
    pub fn store(&self, lanes: &mut [[R; 4]; 2]) {
        lanes[0][..3].copy_from_slice(&self.diagonal);
        lanes[1][..3].copy_from_slice(&self.off);
    }

    /// All entries times `s`.
    #[inline(always)]
    pub fn times(&self, s: R) -> Self {
        Symmetric { diagonal: scale(self.diagonal, s), off: scale(self.off, s) }
    }

    /// The sum.
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        Symmetric { diagonal: add(self.diagonal, other.diagonal), off: add(self.off, other.off) }
    }

    /// The difference.
    #[inline(always)]
    pub fn minus(&self, other: &Self) -> Self {
        Symmetric { diagonal: sub(self.diagonal, other.diagonal), off: sub(self.off, other.off) }
    }

    /// Sum of the squares of all nine entries.
    #[inline(always)]
    pub fn square(&self) -> R {
        self.product(self)
    }

    /// Sum of the products of all nine entries.
    #[inline(always)]
    pub fn product(&self, other: &Self) -> R {
        dot(self.diagonal, other.diagonal) + R::of(2.0) * dot(self.off, other.off)
    }

    /// The matrix, shortened to the norm `bound` if it is longer.
    #[inline(always)]
    pub fn within(&self, bound: R) -> Self {
        let square = self.square();
        if square > bound * bound { self.times(bound * (R::of(1.0) / square.sqrt())) } else { *self }
    }

    /// The matrix rotated with the skew part of the displacement gradient `d`, by Cayley's rotation.
    #[inline(always)]
    pub fn turned(&self, d: &[[R; 3]; 3]) -> Self {
        let quarter = R::of(0.25);
        let t = [(d[1][2] - d[2][1]) * quarter, (d[2][0] - d[0][2]) * quarter, (d[0][1] - d[1][0]) * quarter];
        // Written so because lavapipe computes 2/(1 + t²) differently.
        let half = R::of(0.5);
        let k = R::of(1.0) / (half + half * dot(t, t));
        let [xx, yy, zz] = [t[0] * t[0], t[1] * t[1], t[2] * t[2]];
        let (yz, xz, xy) = (t[1] * t[2], t[0] * t[2], t[0] * t[1]);
        let one = R::of(1.0);
        let turn = [
            [one - k * (yy + zz), k * (xy + t[2]), k * (xz - t[1])],
            [k * (xy - t[2]), one - k * (xx + zz), k * (yz + t[0])],
            [k * (xz + t[1]), k * (yz - t[0]), one - k * (xx + yy)],
        ];
        let [a, b, c] = self.columns().map(|column| transform(&turn, column));
        let [a, b, c] = [0, 1, 2].map(|i| transform(&turn, [a[i], b[i], c[i]]));
        Symmetric { diagonal: [a[0], b[1], c[2]], off: [b[2], a[2], a[1]] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrices::matrix;
    use crate::math::svd::svd;

    #[test]
    fn turning_keeps_length_and_trace_and_follows_a_rotation() {
        // Rotations: matrices whose entries are neither large nor all zero.
        let any = |seed| svd(&matrix(seed)).u;
        for seed in 0..49 {
            let s = Symmetric::deviator(&any(seed));
            let turned = s.turned(&any(seed + 1));
            let trace = |s: &Symmetric<f64>| s.diagonal.iter().sum::<f64>().abs();
            assert!(trace(&s) < 1e-12 && trace(&turned) < 1e-12);
            assert!((turned.square() - s.square()).abs() < 1e-12);
        }
        // A small rotation about z takes x towards y: d u_y/dx = w.
        let w = 1e-3;
        let pull = Symmetric { diagonal: [1.0, 0.0, 0.0], off: [0.0; 3] };
        let turned = pull.turned(&[[0.0, w, 0.0], [-w, 0.0, 0.0], [0.0; 3]]);
        assert!((turned.off[2] - w).abs() < 1e-8, "{turned:?}");
    }
}
