//! What the solid models do, shared by the constraint and the integration: strain, yield, correction. Twin:
//! `shaders/lib/solid.wgsl`.
//!
//! The strain of a deformation gradient F = U Σ Vᵀ is logarithmic (Hencky): ln Σ along the columns of U. What of it is
//! elastic follows from the yield surface; only that is steered back, so that stress never leaves the surface.

use crate::cpu::state::{Gradient, MaterialConstants};
use crate::math::linear::{add, scale, transform};
use crate::math::real::Real;
use crate::math::svd::svd;

/// Model tags, the same numbers as in the shader.
pub const LIQUID: u32 = 0;
/// See [`LIQUID`].
pub const ELASTIC: u32 = 1;
/// See [`LIQUID`].
pub const SAND: u32 = 2;
/// See [`LIQUID`].
pub const VISCOPLASTIC: u32 = 3;

/// Smallest and largest magnitude of a principal stretch that a particle remembers.
pub const STRETCH: [f64; 2] = [0.1, 10.0];
/// Largest correction of a principal stretch in one iteration.
pub const CORRECTION: f64 = 2.0;

type Matrix<R> = [[R; 3]; 3];

#[inline(always)]
fn of<R: Real>(x: f64) -> R {
    R::of(x)
}

/// (1 + D) F
#[inline(always)]
fn deformed<R: Real>(f: &Gradient<R>, d: &Gradient<R>) -> Matrix<R> {
    let d = d.map(|c| [c[0], c[1], c[2]]);
    f.map(|c| {
        let column = [c[0], c[1], c[2]];
        add(column, transform(&d, column))
    })
}

/// 1 or −1.
#[inline(always)]
fn sign<R: Real>(x: R) -> R {
    if x < of(0.0) { of(-1.0) } else { of(1.0) }
}

/// Magnitude of a principal stretch within what is remembered.
#[inline(always)]
fn magnitude<R: Real>(x: R) -> R {
    x.abs().max(of(STRETCH[0])).min(of(STRETCH[1]))
}

/// A strain's deviator shortened to the length that `limit` allows, about the mean.
#[inline(always)]
fn yielded<R: Real>(strain: [R; 3], trace: R, limit: R) -> [R; 3] {
    let mean = trace * of(1.0 / 3.0);
    let deviator = strain.map(|e| e - mean);
    let square = deviator[0] * deviator[0] + deviator[1] * deviator[1] + deviator[2] * deviator[2];
    if square <= limit * limit {
        return strain;
    }
    let factor = limit * (of::<R>(1.0) / square.sqrt());
    deviator.map(|e| mean + e * factor)
}

/// Of logarithmic strains the elastic part, and the slack that is left: how far sand has come apart, as a logarithm of
/// volume, which it takes back before it bears load again.
#[inline(always)]
fn elastic_part<R: Real>(m: &MaterialConstants<R>, strain: [R; 3], slack: R) -> ([R; 3], R) {
    if m.model == VISCOPLASTIC {
        return (yielded(strain, strain[0] + strain[1] + strain[2], m.yield_limit), slack);
    }
    let strain = strain.map(|e| e + slack * of(1.0 / 3.0));
    let trace = strain[0] + strain[1] + strain[2];
    if trace >= of(0.0) {
        return ([of(0.0); 3], trace);
    }
    (yielded(strain, trace, -(m.yield_limit * trace)), of(0.0))
}

/// By how much each principal stretch is to change for the target, as a share of it.
#[inline(always)]
fn corrections<R: Real>(m: &MaterialConstants<R>, sigma: [R; 3], slack: R) -> [R; 3] {
    let one: R = of(1.0);
    let size = sigma.map(magnitude);
    let ratio = if m.model == ELASTIC {
        let rigid = [0, 1, 2].map(|i| sign(sigma[i]) * (one / size[i]));
        if m.shape_weight < one {
            let mean = (size[0].ln() + size[1].ln() + size[2].ln()) * of(1.0 / 3.0);
            let volume = (one - m.shape_weight) * (-mean).exp();
            rigid.map(|r| m.shape_weight * r + volume)
        } else {
            rigid
        }
    } else {
        let (strain, _) = elastic_part(m, size.map(R::ln), slack);
        [0, 1, 2].map(|i| sign(sigma[i]) * (-strain[i]).exp())
    };
    ratio.map(|r| (r - one).max(of(-CORRECTION)).min(of(CORRECTION)))
}

/// The displacement gradient steered to the target of the material. With F* = (1 + D) F = U Σ Vᵀ and the target
/// U T Vᵀ, the change of D that reaches it is B (1 + D), B = U (T Σ⁻¹ − 1) Uᵀ; its symmetric part leaves spin alone.
#[inline(always)]
pub fn constrain<R: Real>(m: &MaterialConstants<R>, f: &Gradient<R>, d: &mut Gradient<R>) {
    let svd = svd(&deformed(f, d));
    let c = corrections(m, svd.sigma, f[0][3]);
    let u = svd.u;
    let entry = |i: usize, j: usize| u[0][i] * u[0][j] * c[0] + u[1][i] * u[1][j] * c[1] + u[2][i] * u[2][j] * c[2];
    let (xy, xz, yz) = (entry(0, 1), entry(0, 2), entry(1, 2));
    let b = [[entry(0, 0), xy, xz], [xy, entry(1, 1), yz], [xz, yz, entry(2, 2)]];
    let bd = d.map(|column| transform(&b, [column[0], column[1], column[2]]));
    for j in 0..3 {
        for i in 0..3 {
            d[j][i] += m.gain * (b[j][i] + of::<R>(0.5) * (bd[j][i] + bd[i][j]));
        }
    }
}

/// Advances the deformation gradient by the step's displacement gradient, lets it yield, and gives the volume ratio.
/// `dense` says that the grid measures more matter than fits.
#[inline(always)]
pub fn advance<R: Real>(m: &MaterialConstants<R>, f: &mut Gradient<R>, d: &Gradient<R>, dense: bool) -> R {
    let moved = deformed(f, d);
    if m.model == ELASTIC && within_range(&moved) {
        store(f, moved);
        return determinant(&moved);
    }
    let svd = svd(&moved);
    let size = svd.sigma.map(magnitude);
    let (size, slack) = if m.model == ELASTIC {
        (size, f[0][3])
    } else {
        let slack = if dense { of(0.0) } else { f[0][3] };
        let (strain, slack) = elastic_part(m, size.map(R::ln), slack);
        (strain.map(R::exp), slack)
    };
    let [a, b, c] = [0, 1, 2].map(|k| scale(svd.u[k], sign(svd.sigma[k]) * size[k]));
    let v = svd.v;
    store(f, [0, 1, 2].map(|j| add(add(scale(a, v[0][j]), scale(b, v[1][j])), scale(c, v[2][j]))));
    f[0][3] = slack;
    size[0] * size[1] * size[2] * slack.exp()
}

/// Whether all principal stretches are surely remembered as they are: the largest is at most the norm, the product of the
/// two larger at most half its square.
#[inline(always)]
fn within_range<R: Real>(f: &Matrix<R>) -> bool {
    let square = |c: [R; 3]| c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
    let norm = square(f[0]) + square(f[1]) + square(f[2]);
    norm <= of(STRETCH[1] * STRETCH[1]) && determinant(f) * of(2.0 / STRETCH[0]) >= norm
}

#[inline(always)]
fn determinant<R: Real>(f: &Matrix<R>) -> R {
    let [a, b, c] = *f;
    a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[inline(always)]
fn store<R: Real>(f: &mut Gradient<R>, from: Matrix<R>) {
    for (to, from) in f.iter_mut().zip(from) {
        to[..3].copy_from_slice(&from);
    }
}
