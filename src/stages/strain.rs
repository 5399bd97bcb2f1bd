//! Strains and stresses of the implicit scheme: of one number, a divergence or a pressure, in worlds of liquids; otherwise of six,
//! those of a symmetric tensor: xx, yy, zz, xy, xz, yz. Twin: `shaders/lib/strain.wgsl`.
//!
//! A stress S is what it adds to a displacement gradient: S = −4 τ/ρ for the Kirchhoff stress τ.

use crate::cpu::state::{Constants, Gradient, MaterialConstants};
use crate::math::real::Real;
use crate::stages::solid;

/// By how much a particle gives way to a stress: strain per stress, and what that makes of a residual.
#[derive(Debug, Clone, Copy)]
pub struct Compliance<R> {
    /// To shear.
    pub shear: R,
    /// To the mean of the diagonal; of a single number, to that.
    pub mean: R,
}

/// Symmetric part of a displacement gradient, or its trace.
#[inline(always)]
pub fn of_gradient<R: Real, const N: usize>(d: &Gradient<R>) -> [R; N] {
    let mut strain = [R::of(0.0); N];
    if N == 1 {
        strain[0] = d[0][0] + d[1][1] + d[2][2];
    } else {
        let half = R::of(0.5);
        let six = [
            d[0][0],
            d[1][1],
            d[2][2],
            half * (d[0][1] + d[1][0]),
            half * (d[0][2] + d[2][0]),
            half * (d[1][2] + d[2][1]),
        ];
        strain.copy_from_slice(&six);
    }
    strain
}

/// Sum of the products of all entries.
#[inline(always)]
pub fn inner<R: Real, const N: usize>(a: &[R; N], b: &[R; N]) -> R {
    if N == 1 {
        return a[0] * b[0];
    }
    let twice = a[3] * b[3] + a[4] * b[4] + a[5] * b[5];
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + (twice + twice)
}

/// The columns of a tensor.
#[inline(always)]
pub fn columns<R: Real, const N: usize>(s: &[R; N]) -> [[R; 3]; 3] {
    let zero = R::of(0.0);
    if N == 1 {
        return [[s[0], zero, zero], [zero, s[0], zero], [zero, zero, s[0]]];
    }
    [[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]]
}

/// `a + b` times `factor`.
#[inline(always)]
pub fn add<R: Real, const N: usize>(a: &[R; N], b: &[R; N], factor: R) -> [R; N] {
    std::array::from_fn(|i| a[i] + b[i] * factor)
}

/// The parts of a tensor times two factors: its deviator's and its mean's.
#[inline(always)]
pub fn scaled<R: Real, const N: usize>(s: &[R; N], shear: R, mean: R) -> [R; N] {
    if N == 1 {
        return [s[0] * mean; N];
    }
    let third = (s[0] + s[1] + s[2]) * R::of(1.0 / 3.0);
    std::array::from_fn(|i| if i < 3 { (s[i] - third) * shear + third * mean } else { s[i] * shear })
}

impl<R: Real> Compliance<R> {
    /// That of a material in this step, and the share of an error in a liquid's volume that the step takes back.
    ///
    /// Matter at rest is as stiff as the step's noise allows, moving matter as stiff as iterations can resolve.
    #[inline(always)]
    pub fn of<const N: usize>(m: &MaterialConstants<R>, constants: &Constants<R>) -> (Self, R) {
        let one: R = R::of(1.0);
        let square = R::of(4.0) * m.inverse_density * constants.seconds * constants.seconds;
        if m.model == solid::LIQUID {
            let stiffness = square * m.bulk;
            let at_rest = stiffness.min(R::of(4.0) * constants.rest_limit);
            let moving = stiffness.min(R::of(4.0) * constants.stiffness_limit);
            let compliance = one / moving;
            let mean = if N == 1 { compliance } else { compliance * R::of(1.0 / 3.0) };
            return (Compliance { shear: R::of(0.0), mean }, at_rest * compliance);
        }
        let shear = R::of(2.0) * square * m.shear;
        let mean = R::of(3.0) * square * m.bulk;
        // Of a wave along its direction, which is the stiffest.
        let stiffness = (mean + shear + shear) * R::of(1.0 / 3.0);
        let limited = (constants.solid_limit * (one / stiffness)).min(one);
        (Compliance { shear: one / (shear * limited), mean: one / (mean * limited) }, one)
    }

    /// That of matter which is by this factor softer.
    #[inline(always)]
    pub fn times(self, softness: R) -> Self {
        Compliance { shear: self.shear * softness, mean: self.mean * softness }
    }

    /// The strain under a stress.
    #[inline(always)]
    pub fn strain<const N: usize>(&self, stress: &[R; N]) -> [R; N] {
        scaled(stress, self.shear, self.mean)
    }

    /// About the stress that takes a strain back: the inverse of the compliance and of what a stress does at a particle.
    #[inline(always)]
    pub fn answer<const N: usize>(&self, strain: &[R; N], shares: [R; 2], bound: R) -> [R; N] {
        let one: R = R::of(1.0);
        let alone = if N == 1 { one } else { R::of(1.0 / 3.0) };
        let answer =
            scaled(strain, shares[0] * (one / (self.shear + R::of(0.5))), shares[1] * (one / (self.mean + alone)));
        let square = inner(&answer, &answer);
        if square <= bound * bound {
            return answer;
        }
        let factor = bound * (one / square.sqrt());
        answer.map(|e| e * factor)
    }
}
