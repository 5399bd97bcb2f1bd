//! What the solid models do, shared by the constraint and the integration: strain, yield, correction. Twin:
//! `shaders/lib/solid.wgsl`.
//!
//! The strain of a deformation gradient F = U Σ Vᵀ is logarithmic (Hencky): ln Σ along the columns of U. What of it is
//! elastic follows from the yield surface; only that is steered back, so that stress never leaves the surface.

use crate::cpu::state::{Gradient, MaterialConstants};
use crate::math::linear::{add, dot, scale, transform};
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

/// A matrix of columns.
pub type Matrix<R> = [[R; 3]; 3];

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
    if x < R::of(0.0) { R::of(-1.0) } else { R::of(1.0) }
}

/// Magnitude of a principal stretch within what is remembered.
#[inline(always)]
pub fn magnitude<R: Real>(x: R) -> R {
    x.abs().max(R::of(STRETCH[0])).min(R::of(STRETCH[1]))
}

/// A strain's deviator shortened to the length that `limit` allows, about the mean.
#[inline(always)]
fn yielded<R: Real>(strain: [R; 3], trace: R, limit: R) -> [R; 3] {
    let mean = trace * R::of(1.0 / 3.0);
    let deviator = strain.map(|e| e - mean);
    let square = deviator[0] * deviator[0] + deviator[1] * deviator[1] + deviator[2] * deviator[2];
    if square <= limit * limit {
        return strain;
    }
    let factor = limit * (R::of(1.0) / square.sqrt());
    deviator.map(|e| mean + e * factor)
}

/// The most slack that is remembered, as a logarithm of volume: far within what the exponential bears.
pub const SLACKEST: f64 = 16.0;

/// Of logarithmic strains the elastic part, and the slack that is left: how far sand has come apart, as a logarithm of
/// volume, which it takes back before it bears load again.
#[inline(always)]
fn elastic_part<R: Real>(m: &MaterialConstants<R>, strain: [R; 3], slack: R) -> ([R; 3], R) {
    if m.model == VISCOPLASTIC {
        return (yielded(strain, strain[0] + strain[1] + strain[2], m.yield_limit), slack);
    }
    let strain = strain.map(|e| e + slack * R::of(1.0 / 3.0));
    let trace = strain[0] + strain[1] + strain[2];
    if trace >= R::of(0.0) {
        return ([R::of(0.0); 3], trace.min(R::of(SLACKEST)));
    }
    (yielded(strain, trace, -(m.yield_limit * trace)), R::of(0.0))
}

/// A strain whose compression is taken back by as much as matter is `loosened`, so that what holds together does not begin to pull.
#[inline(always)]
fn relieved<R: Real>(strain: [R; 3], loosened: R) -> [R; 3] {
    let compression = -(strain[0] + strain[1] + strain[2]);
    let back = loosened.min(compression.max(R::of(0.0))) * R::of(1.0 / 3.0);
    strain.map(|e| e + back)
}

/// By how much each principal stretch is to change for the target, as a share of it.
#[inline(always)]
fn corrections<R: Real>(m: &MaterialConstants<R>, sigma: [R; 3], slack: R) -> [R; 3] {
    let one: R = R::of(1.0);
    let size = sigma.map(magnitude);
    let ratio = if m.model == ELASTIC {
        let rigid = [0, 1, 2].map(|i| sign(sigma[i]) * (one / size[i]));
        if m.shape_weight < one {
            let volume = ((size[0] * size[1] * size[2]).ln() * R::of(-1.0 / 3.0)).exp();
            rigid.map(|r| volume + m.shape_weight * (r - volume))
        } else {
            rigid
        }
    } else {
        let (strain, _) = elastic_part(m, size.map(R::ln), slack);
        [0, 1, 2].map(|i| sign(sigma[i]) * (-strain[i]).exp())
    };
    ratio.map(|r| (r - one).max(R::of(-CORRECTION)).min(R::of(CORRECTION)))
}

/// The symmetric matrix with these principal values along the columns of `u`.
#[inline(always)]
pub fn along<R: Real>(u: &Matrix<R>, c: [R; 3]) -> Matrix<R> {
    let entry = |i: usize, j: usize| u[0][i] * u[0][j] * c[0] + u[1][i] * u[1][j] * c[1] + u[2][i] * u[2][j] * c[2];
    let (xy, xz, yz) = (entry(0, 1), entry(0, 2), entry(1, 2));
    [[entry(0, 0), xy, xz], [xy, entry(1, 1), yz], [xz, yz, entry(2, 2)]]
}

/// The displacement gradient steered to the target of the material. With F* = (1 + D) F = U Σ Vᵀ and the target
/// U T Vᵀ, the change of D that reaches it is B (1 + D), B = U (T Σ⁻¹ − 1) Uᵀ; its symmetric part leaves spin alone.
#[inline(always)]
pub fn constrain<R: Real>(m: &MaterialConstants<R>, f: &Gradient<R>, d: &mut Gradient<R>) {
    let svd = svd(&deformed(f, d));
    let c = corrections(m, svd.sigma, f[0][3]);
    let b = along(&svd.u, c);
    let bd = d.map(|column| transform(&b, [column[0], column[1], column[2]]));
    let gain = m.gain * (R::of(1.0) / anisotropy(d));
    for j in 0..3 {
        for i in 0..3 {
            d[j][i] += gain * (b[j][i] + R::of(0.5) * (bd[j][i] + bd[i][j]));
        }
    }
}

/// How unlike the axes of 1 + D are, 1 or more. A symmetric correction of the shear between axes whose stretches differ by
/// the factor r overshoots by ½ + (r + 1/r)/4, which is at most about this.
#[inline(always)]
fn anisotropy<R: Real>(d: &Gradient<R>) -> R {
    let one: R = R::of(1.0);
    let zero: R = R::of(0.0);
    let unit = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let m = [0, 1, 2].map(|j| add(unit[j], [d[j][0], d[j][1], d[j][2]]));
    let volume = determinant(&m).abs().max(R::of(0.05));
    (norm(&m) * R::of(1.0 / 3.0) * (volume.ln() * R::of(-2.0 / 3.0)).exp()).max(one)
}

/// Squared Frobenius norm.
#[inline(always)]
fn norm<R: Real>(m: &Matrix<R>) -> R {
    dot(m[0], m[0]) + dot(m[1], m[1]) + dot(m[2], m[2])
}

/// The logarithmic strain of a deformation gradient.
#[inline(always)]
pub fn strain<R: Real>(f: &Gradient<R>) -> Matrix<R> {
    let svd = svd(&f.map(|c| [c[0], c[1], c[2]]));
    along(&svd.u, svd.sigma.map(|s| magnitude(s).ln()))
}

/// What becomes of a solid particle in a step beside its deformation gradient.
pub struct Advanced<R> {
    pub volume_ratio: R,
    /// Whether it was stretched or squeezed further than it can remember.
    pub clamped: bool,
}

/// Advances the deformation gradient by the step's displacement gradient, lets it yield, and gives the volume ratio.
/// `dense` says that the grid measures more matter than fits. Where it measures less, matter has come apart by `loosened`, a logarithm of
/// volume, of which its gradient does not know.
#[inline(always)]
pub fn advance<R: Real>(
    m: &MaterialConstants<R>,
    f: &mut Gradient<R>,
    d: &Gradient<R>,
    dense: bool,
    loosened: R,
) -> Advanced<R> {
    let moved = deformed(f, d);
    if m.model == ELASTIC && within_range(&moved) {
        store(f, moved);
        return Advanced { volume_ratio: determinant(&moved), clamped: false };
    }
    let svd = svd(&moved);
    let size = svd.sigma.map(magnitude);
    let clamped = (0..3).any(|k| size[k] != svd.sigma[k].abs());
    let (size, slack) = if m.model == ELASTIC {
        (size, R::of(0.0))
    } else {
        let strain = size.map(R::ln);
        let (strain, slack) = if m.model == SAND {
            elastic_part(m, strain, if dense { R::of(0.0) } else { f[0][3] + loosened })
        } else {
            elastic_part(m, relieved(strain, loosened), R::of(0.0))
        };
        (strain.map(R::exp), slack)
    };
    let [a, b, c] = [0, 1, 2].map(|k| scale(svd.u[k], sign(svd.sigma[k]) * size[k]));
    let v = svd.v;
    store(f, [0, 1, 2].map(|j| add(add(scale(a, v[0][j]), scale(b, v[1][j])), scale(c, v[2][j]))));
    f[0][3] = slack;
    Advanced { volume_ratio: size[0] * size[1] * size[2] * slack.exp(), clamped }
}

/// Whether all principal stretches are surely remembered as they are: the largest is at most the norm, the product of the
/// two larger at most half its square.
#[inline(always)]
fn within_range<R: Real>(f: &Matrix<R>) -> bool {
    let norm = norm(f);
    norm <= R::of(STRETCH[1] * STRETCH[1]) && determinant(f) * R::of(2.0 / STRETCH[0]) >= norm
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrices::matrix;

    fn material(model: u32, yield_limit: f64) -> MaterialConstants<f64> {
        MaterialConstants {
            model,
            gain: 1.0,
            viscous_relaxation: 0.0,
            inverse_density: 1.0,
            shape_weight: 1.0,
            yield_limit,
            bulk: 1.0,
            shear: 1.0,
            viscosity: 0.0,
            solved_viscosity: 0.0,
            even: 1.0,
        }
    }

    fn gradient(m: Matrix<f64>, slack: f64) -> Gradient<f64> {
        [[m[0][0], m[0][1], m[0][2], slack], [m[1][0], m[1][1], m[1][2], 0.0], [m[2][0], m[2][1], m[2][2], 0.0]]
    }

    fn strains(f: &Gradient<f64>) -> [f64; 3] {
        svd(&f.map(|c| [c[0], c[1], c[2]])).sigma.map(f64::ln)
    }

    /// Mean and norm of the deviator.
    fn parts(e: [f64; 3]) -> (f64, f64) {
        let mean = (e[0] + e[1] + e[2]) / 3.0;
        (mean, e.iter().map(|e| (e - mean).powi(2)).sum::<f64>().sqrt())
    }

    /// A gradient with these principal stretches along axes drawn by `seed`.
    fn stretched(seed: u64, stretches: [f64; 3], slack: f64) -> Gradient<f64> {
        let axes = svd(&matrix(seed));
        let columns = [0, 1, 2].map(|k| scale(axes.u[k], stretches[k]));
        gradient([0, 1, 2].map(|j| transform(&columns, [axes.v[0][j], axes.v[1][j], axes.v[2][j]])), slack)
    }

    const STILL: Gradient<f64> = [[0.0; 4]; 3];
    /// Small, large, flattened and inverted.
    const SHAPES: [[f64; 3]; 5] =
        [[1.02, 1.0, 0.99], [1.6, 1.2, 0.7], [0.9, 0.6, 0.4], [1.1, 0.9, -0.3], [2.5, 2.0, 0.25]];

    #[test]
    fn an_isolated_elastic_particle_becomes_a_rotation() {
        for (seed, stretches) in SHAPES.into_iter().enumerate() {
            let f = stretched(seed as u64, stretches, 0.0);
            let mut d = STILL;
            for _ in 0..200 {
                constrain(&material(ELASTIC, 0.0), &f, &mut d);
            }
            // What is left is the turn that a symmetric gradient does not take out; the shape is back.
            let reached = gradient(deformed(&f, &d), 0.0);
            let sigma = svd(&reached.map(|c| [c[0], c[1], c[2]])).sigma;
            // An inverted one comes back through flatness, where the steps are short.
            let tolerance = if stretches[2] < 0.0 { 0.05 } else { 1e-6 };
            assert!(sigma.iter().all(|s| (s - 1.0).abs() < tolerance), "{stretches:?} became {sigma:?}");
        }
    }

    #[test]
    fn the_correction_is_symmetric_and_turns_with_the_body() {
        for seed in 0..50 {
            let mut d = STILL;
            constrain(&material(ELASTIC, 0.0), &stretched(seed, [1.3, 1.0, 0.8], 0.0), &mut d);
            for (i, j) in [(0, 1), (0, 2), (1, 2)] {
                assert!((d[i][j] - d[j][i]).abs() < 1e-14);
            }
            // Its principal values are those of the stretches, whatever the axes.
            let trace = d[0][0] + d[1][1] + d[2][2];
            assert!((trace - (1.0 / 1.3 + 1.0 + 1.0 / 0.8 - 3.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn yielding_keeps_the_volume_and_ends_on_the_surface() {
        let clay = material(VISCOPLASTIC, 0.1);
        for (seed, stretches) in SHAPES.into_iter().enumerate().filter(|(_, s)| s[2] > 0.0) {
            let mut f = stretched(seed as u64, stretches, 0.0);
            let volume = stretches[0] * stretches[1] * stretches[2];
            let before = parts(stretches.map(f64::ln));
            let ratio = advance(&clay, &mut f, &STILL, false, 0.0).volume_ratio;
            assert!((ratio / volume - 1.0).abs() < 1e-12);
            let (mean, norm) = parts(strains(&f));
            assert!((mean - before.0).abs() < 1e-12 && (norm - before.1.min(0.1)).abs() < 1e-12);
        }
    }

    #[test]
    fn sand_bears_shear_in_proportion_to_pressure_and_none_when_apart() {
        let sand = material(SAND, 0.3);
        for (seed, stretches) in SHAPES.into_iter().enumerate().filter(|(_, s)| s[2] > 0.0) {
            let mut f = stretched(seed as u64, stretches, 0.0);
            let trace: f64 = stretches.iter().map(|s| s.ln()).sum();
            advance(&sand, &mut f, &STILL, false, 0.0);
            let (mean, norm) = parts(strains(&f));
            if trace >= 0.0 {
                assert!(mean.abs() < 1e-12 && norm < 1e-12 && (f[0][3] - trace).abs() < 1e-12);
                let mut d = STILL;
                constrain(&sand, &f, &mut d);
                assert!(d.iter().flatten().all(|e| e.abs() < 1e-12), "no tension");
            } else {
                assert!((3.0 * mean - trace).abs() < 1e-12 && norm <= -0.3 * trace + 1e-12 && f[0][3] == 0.0);
            }
        }
    }

    #[test]
    fn what_is_loosened_bears_less_and_does_not_pull() {
        for (model, slack) in [(SAND, 0.03), (VISCOPLASTIC, 0.0)] {
            let m = material(model, 0.3);
            // By less than it is compressed, and by more.
            let squeezed = stretched(1, [0.99; 3], 0.0);
            let mut f = squeezed;
            advance(&m, &mut f, &STILL, false, 0.02);
            assert!((parts(strains(&f)).0 - (0.99f64.ln() + 0.02 / 3.0)).abs() < 1e-12 && f[0][3] == 0.0);
            let mut f = squeezed;
            advance(&m, &mut f, &STILL, false, slack - 3.0 * 0.99f64.ln() + 0.01);
            assert!(parts(strains(&f)).0.abs() < 1e-12);
            assert!((f[0][3] - if model == SAND { slack + 0.01 } else { 0.0 }).abs() < 1e-12);
        }
        let mut f = stretched(1, [0.99; 3], 0.0);
        advance(&material(ELASTIC, 0.0), &mut f, &STILL, false, 0.02);
        assert!((parts(strains(&f)).0 - 0.99f64.ln()).abs() < 1e-12, "rubber knows its shape");
    }

    #[test]
    fn sand_takes_its_slack_back_before_it_bears_load() {
        let sand = material(SAND, 0.3);
        let squeeze = |by: f64| gradient([[by, 0.0, 0.0], [0.0, by, 0.0], [0.0, 0.0, by]], 0.0);
        let mut f = stretched(1, [1.0; 3], 0.09);
        advance(&sand, &mut f, &squeeze(-0.02), false, 0.0);
        let (mean, _) = parts(strains(&f));
        assert!(mean.abs() < 1e-12 && (f[0][3] - (0.09 + 3.0 * 0.98f64.ln())).abs() < 1e-12, "still loose");
        advance(&sand, &mut f, &squeeze(-0.02), false, 0.0);
        assert!(f[0][3] == 0.0 && parts(strains(&f)).0 < -1e-3, "tight");
        let mut dense = stretched(1, [1.0; 3], 0.09);
        advance(&sand, &mut dense, &STILL, true, 0.0);
        assert_eq!(dense[0][3], 0.0, "where the grid measures too much matter there is no slack");
    }

    /// Its volume is a number however far it has come apart.
    #[test]
    fn slack_ends_before_numbers_do() {
        let sand = material(SAND, 0.3);
        let mut f = stretched(1, [1.0; 3], 0.0);
        let apart = gradient([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]], 0.0);
        for _ in 0..200 {
            let advanced = advance(&sand, &mut f, &apart, false, 0.0);
            assert!(f[0][3] <= SLACKEST && advanced.volume_ratio < 1e7, "{}", f[0][3]);
        }
        assert_eq!(f[0][3], SLACKEST);
    }
}
