//! The solid models, shared by the constraint and the integration: strain, yield, correction. Twin:
//! `shaders/lib/solid.wgsl`.
//!
//! The strain of a deformation gradient F = U Σ Vᵀ is logarithmic (Hencky): ln Σ along the columns of U. The yield
//! surface determines its elastic part; only that is steered back, so that stress never leaves the surface.

use crate::cpu::constants::MaterialConstants;
use crate::math::linear::{Scalar, add, dot, scale, transform};
use crate::math::real::{Lanes, Real};
use crate::math::svd::svd_of_four;

/// Model tags, the same numbers as in the shader.
pub const LIQUID: u32 = 0;
/// See [`LIQUID`].
pub const ELASTIC: u32 = 1;
/// See [`LIQUID`].
pub const SAND: u32 = 2;
/// See [`LIQUID`].
pub const VISCOPLASTIC: u32 = 3;

/// Smallest and largest magnitude of a principal stretch that a particle stores.
pub const STRETCH: [f64; 2] = [0.1, 10.0];
/// Largest correction of a principal stretch in one iteration.
pub const CORRECTION: f64 = 2.0;

/// A matrix by columns.
pub type Matrix<R> = [[R; 3]; 3];

/// Four particles' materials, lane by lane. Models are masks.
#[derive(Debug, Clone, Copy)]
pub struct Solids<V> {
    elastic: V,
    sand: V,
    viscoplastic: V,
    gain: V,
    shape_weight: V,
    yield_limit: V,
}

impl<V: Copy> Solids<V> {
    /// Of materials that may also be liquid.
    #[inline(always)]
    pub fn of<R: Real<V = V>>(materials: [&MaterialConstants<R>; 4]) -> Self
    where
        V: Lanes<R>,
    {
        let lanes = |of: fn(&MaterialConstants<R>) -> R| V::from4(materials.map(of));
        let is = |model: u32| V::from4(materials.map(|m| R::of(f64::from(u8::from(m.model == model)))));
        let [elastic, sand, viscoplastic] =
            [ELASTIC, SAND, VISCOPLASTIC].map(|model| V::all(R::of(0.0)).below(is(model)));
        Solids {
            elastic,
            sand,
            viscoplastic,
            gain: lanes(|m| m.gain),
            shape_weight: lanes(|m| m.shape_weight),
            yield_limit: lanes(|m| m.yield_limit),
        }
    }
}

/// (1 + D) F
#[inline(always)]
fn deformed<R: Real>(f: &Matrix<R::V>, d: &Matrix<R::V>) -> Matrix<R::V> {
    f.map(|column| add(column, transform(d, column)))
}

/// 1 or −1.
#[inline(always)]
fn sign<R: Real>(x: R::V) -> R::V {
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    x.below(zero).pick(-one, one)
}

/// Magnitude of a principal stretch, within the range that is stored.
#[inline(always)]
pub fn magnitude<R: Real>(x: R::V) -> R::V {
    x.abs().max(R::V::all(R::of(STRETCH[0]))).min(R::V::all(R::of(STRETCH[1])))
}

/// A strain whose deviator is shortened to at most `limit`.
#[inline(always)]
fn yielded<R: Real>(strain: [R::V; 3], trace: R::V, limit: R::V) -> [R::V; 3] {
    let mean = trace * R::V::all(R::of(1.0 / 3.0));
    let deviator = strain.map(|e| e - mean);
    let square = deviator[0] * deviator[0] + deviator[1] * deviator[1] + deviator[2] * deviator[2];
    let within = square.at_most(limit * limit);
    let factor = limit * (R::V::all(R::of(1.0)) / square.sqrt());
    [0, 1, 2].map(|i| within.pick(strain[i], mean + deviator[i] * factor))
}

/// The most slack that is stored, as a logarithm of volume: far within the range of the exponential.
pub const SLACKEST: f64 = 16.0;

/// The elastic part of logarithmic strains, and the slack that is left: how far sand has come apart, as a logarithm of
/// volume, which must be taken back before it carries load again.
#[inline(always)]
fn elastic_part<R: Real>(m: &Solids<R::V>, strain: [R::V; 3], slack: R::V) -> ([R::V; 3], R::V) {
    let [zero, third] = [0.0, 1.0 / 3.0].map(|x| R::V::all(R::of(x)));
    let strain = strain.map(|e| m.viscoplastic.pick(e, e + slack * third));
    let trace = strain[0] + strain[1] + strain[2];
    let apart = m.viscoplastic.pick(zero.below(zero), zero.at_most(trace));
    let limit = m.viscoplastic.pick(m.yield_limit, -(m.yield_limit * trace));
    let part = yielded::<R>(strain, trace, limit).map(|e| apart.pick(zero, e));
    let left = apart.pick(trace.min(R::V::all(R::of(SLACKEST))), zero);
    (part, m.viscoplastic.pick(slack, left))
}

/// A strain whose compression is reduced by as much as matter is `loosened`, at most to none, so that cohesive matter
/// does not begin to pull.
#[inline(always)]
fn relieved<R: Real>(strain: [R::V; 3], loosened: R::V) -> [R::V; 3] {
    let compression = -(strain[0] + strain[1] + strain[2]);
    let back = loosened.min(compression.max(R::V::all(R::of(0.0)))) * R::V::all(R::of(1.0 / 3.0));
    strain.map(|e| e + back)
}

/// The change of each principal stretch that reaches the target, as a share of the stretch.
#[inline(always)]
fn corrections<R: Real>(m: &Solids<R::V>, sigma: [R::V; 3], slack: R::V) -> [R::V; 3] {
    let one = R::V::all(R::of(1.0));
    let size = sigma.map(magnitude::<R>);
    let signs = sigma.map(sign::<R>);
    let mut ratio = [0, 1, 2].map(|i| signs[i] * (one / size[i]));
    let keeps_volume = m.shape_weight.below(one).and(m.elastic);
    if keeps_volume.any() {
        let volume = ((size[0] * size[1] * size[2]).ln() * R::V::all(R::of(-1.0 / 3.0))).exp();
        ratio = ratio.map(|r| keeps_volume.pick(volume + m.shape_weight * (r - volume), r));
    }
    if m.sand.any() || m.viscoplastic.any() {
        let (strain, _) = elastic_part::<R>(m, size.map(Lanes::ln), slack);
        ratio = [0, 1, 2].map(|i| m.elastic.pick(ratio[i], signs[i] * (-strain[i]).exp()));
    }
    let most = R::V::all(R::of(CORRECTION));
    ratio.map(|r| (r - one).max(-most).min(most))
}

/// The symmetric matrix with these principal values along the columns of `u`.
#[inline(always)]
pub fn along<T: Scalar>(u: &Matrix<T>, c: [T; 3]) -> Matrix<T> {
    let entry = |i: usize, j: usize| u[0][i] * u[0][j] * c[0] + u[1][i] * u[1][j] * c[1] + u[2][i] * u[2][j] * c[2];
    let (xy, xz, yz) = (entry(0, 1), entry(0, 2), entry(1, 2));
    [[entry(0, 0), xy, xz], [xy, entry(1, 1), yz], [xz, yz, entry(2, 2)]]
}

/// The displacement gradient steered to the target of the material. With F* = (1 + D) F = U Σ Vᵀ and the target
/// U T Vᵀ, the change of D that reaches it is B (1 + D), B = U (T Σ⁻¹ − 1) Uᵀ; its symmetric part leaves spin alone.
#[inline(always)]
pub fn constrain<R: Real>(m: &Solids<R::V>, f: &Matrix<R::V>, slack: R::V, d: &Matrix<R::V>) -> Matrix<R::V> {
    let [half, one] = [0.5, 1.0].map(|x| R::V::all(R::of(x)));
    let svd = svd_of_four::<R>(&deformed::<R>(f, d));
    let c = corrections::<R>(m, svd.sigma, slack);
    let b = along(&svd.u, c);
    let bd = d.map(|column| transform(&b, column));
    let gain = m.gain * (one / anisotropy::<R>(d));
    let entry = |i: usize, j: usize| d[j][i] + gain * (b[j][i] + half * (bd[j][i] + bd[i][j]));
    [0, 1, 2].map(|j| [entry(0, j), entry(1, j), entry(2, j)])
}

/// Anisotropy of 1 + D, 1 or more. A symmetric correction of the shear between axes whose stretches differ by the
/// factor r overshoots by ½ + (r + 1/r)/4, which is at most about this.
#[inline(always)]
fn anisotropy<R: Real>(d: &Matrix<R::V>) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    let (zero, one) = (all(0.0), all(1.0));
    let unit = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let m = [0, 1, 2].map(|j| add(unit[j], d[j]));
    let volume = determinant(&m).abs().max(all(0.05));
    (norm(&m) * all(1.0 / 3.0) * (volume.ln() * all(-2.0 / 3.0)).exp()).max(one)
}

/// Squared Frobenius norm.
#[inline(always)]
fn norm<T: Scalar>(m: &Matrix<T>) -> T {
    dot(m[0], m[0]) + dot(m[1], m[1]) + dot(m[2], m[2])
}

/// The logarithmic strain of deformation gradients.
#[inline(always)]
pub fn strain<R: Real>(f: &Matrix<R::V>) -> Matrix<R::V> {
    let svd = svd_of_four::<R>(f);
    along(&svd.u, svd.sigma.map(|s| magnitude::<R>(s).ln()))
}

/// The state of solid particles after a step.
pub struct Advanced<V> {
    /// Their deformation gradients.
    pub f: Matrix<V>,
    /// The slack, as a logarithm of volume.
    pub slack: V,
    pub volume_ratio: V,
    /// Whether a stretch has left the range that is stored.
    pub clamped: V,
}

/// The surroundings of solid particles.
pub struct Around<V> {
    /// Whether the grid measures an excess of matter.
    pub dense: V,
    /// Where it measures a deficit: how far matter has come apart without a trace in its gradient, as a logarithm of
    /// volume.
    pub loosened: V,
}

/// Advances deformation gradients, and the slack of sand, by the step's displacement gradients, and applies the yield
/// surface.
#[inline(always)]
pub fn advance<R: Real>(
    m: &Solids<R::V>,
    (f, slack): (&Matrix<R::V>, R::V),
    d: &Matrix<R::V>,
    around: &Around<R::V>,
) -> Advanced<R::V> {
    let zero = R::V::all(R::of(0.0));
    let moved = deformed::<R>(f, d);
    let volume = determinant(&moved);
    let as_it_is = m.elastic.and(within_range::<R>(&moved, volume));
    let clamped = zero.below(zero);
    let yields = m.sand.pick(m.sand, m.viscoplastic);
    if !yields.any() && !as_it_is.pick(zero, m.elastic).any() {
        return Advanced { f: moved, slack, volume_ratio: volume, clamped };
    }
    let svd = svd_of_four::<R>(&moved);
    let mut size = svd.sigma.map(magnitude::<R>);
    let same = |k: usize| {
        let sigma = svd.sigma[k].abs();
        size[k].at_most(sigma).and(sigma.at_most(size[k]))
    };
    let remembered = same(0).and(same(1)).and(same(2));
    let mut left = zero;
    if yields.any() {
        let strain = size.map(Lanes::ln);
        let relieved = relieved::<R>(strain, around.loosened);
        let strain = [0, 1, 2].map(|k| m.sand.pick(strain[k], relieved[k]));
        let loose = around.dense.pick(zero, slack + around.loosened);
        let (strain, after) = elastic_part::<R>(m, strain, m.sand.pick(loose, zero));
        size = [0, 1, 2].map(|k| yields.pick(strain[k].exp(), size[k]));
        left = yields.pick(after, zero);
    }
    let [a, b, c] = [0, 1, 2].map(|k| scale(svd.u[k], sign::<R>(svd.sigma[k]) * size[k]));
    let v = svd.v;
    let column = |j: usize| add(add(scale(a, v[0][j]), scale(b, v[1][j])), scale(c, v[2][j]));
    let after = [column(0), column(1), column(2)];
    Advanced {
        f: [0, 1, 2].map(|j| [0, 1, 2].map(|i| as_it_is.pick(moved[j][i], after[j][i]))),
        slack: as_it_is.pick(slack, left),
        volume_ratio: as_it_is.pick(volume, size[0] * size[1] * size[2] * left.exp()),
        clamped: as_it_is.pick(clamped, remembered.pick(zero, zero.at_most(zero))),
    }
}

/// Whether all principal stretches are certainly within the range that is stored: the largest is at most the norm, the
/// product of the two larger ones at most half its square.
#[inline(always)]
fn within_range<R: Real>(f: &Matrix<R::V>, determinant: R::V) -> R::V {
    let norm = norm(f);
    let [most, product] = [STRETCH[1] * STRETCH[1], 2.0 / STRETCH[0]].map(|x| R::V::all(R::of(x)));
    norm.at_most(most).and(norm.at_most(determinant * product))
}

#[inline(always)]
fn determinant<T: Scalar>(f: &Matrix<T>) -> T {
    let [a, b, c] = *f;
    a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// For tests: one particle, in `f64`.
#[cfg(test)]
pub mod one {
    use super::*;
    use crate::cpu::gradient::Gradient;
    use crate::cpu::lanes::{entries, matrices, store};

    type Lane = <f64 as Real>::V;

    /// See [`super::constrain`].
    pub fn constrain(m: &MaterialConstants<f64>, f: &Gradient<f64>, d: &mut Gradient<f64>) {
        let [(f, slack), (old, _)] = [*f, *d].map(|g| matrices::<f64>(&[g]));
        let new = entries::<f64>(super::constrain::<f64>(&Solids::of([m; 4]), &f, slack, &old))[0];
        store(d, new);
    }

    /// See [`super::advance`]; returns the volume ratio.
    pub fn advance(
        m: &MaterialConstants<f64>,
        f: &mut Gradient<f64>,
        d: &Gradient<f64>,
        dense: bool,
        loosened: f64,
    ) -> f64 {
        let [(old, slack), (d, _)] = [*f, *d].map(|g| matrices::<f64>(&[g]));
        let all = <Lane as Lanes<f64>>::all;
        let dense = all(0.0).below(all(f64::from(u8::from(dense))));
        let around = Around { dense, loosened: all(loosened) };
        let advanced = super::advance::<f64>(&Solids::of([m; 4]), (&old, slack), &d, &around);
        store(f, entries::<f64>(advanced.f)[0]);
        f[0][3] = advanced.slack.to4()[0];
        advanced.volume_ratio.to4()[0]
    }
}

#[cfg(test)]
mod tests {
    use super::one::{advance, constrain};
    use super::{ELASTIC, MaterialConstants, Matrix, SAND, SLACKEST, VISCOPLASTIC};
    use crate::cpu::gradient::Gradient;
    use crate::math::linear::{add, scale, transform};
    use crate::math::matrices::matrix;
    use crate::math::svd::svd;

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
            lightness: 1.0,
        }
    }

    fn gradient(m: Matrix<f64>, slack: f64) -> Gradient<f64> {
        [[m[0][0], m[0][1], m[0][2], slack], [m[1][0], m[1][1], m[1][2], 0.0], [m[2][0], m[2][1], m[2][2], 0.0]]
    }

    fn strains(f: &Gradient<f64>) -> [f64; 3] {
        svd(&f.map(|c| [c[0], c[1], c[2]])).sigma.map(f64::ln)
    }

    /// Mean, and norm of the deviator.
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
    /// Small, large, flattened and inverted ones.
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
            // What is left is a rotation, which a symmetric gradient does not remove; the shape is restored.
            let [f, d] = [f, d].map(|m| m.map(|c| [c[0], c[1], c[2]]));
            let sigma = svd(&f.map(|c| add(c, transform(&d, c)))).sigma;
            // An inverted one returns through the flat state, near which the iterations make small steps.
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
            let ratio = advance(&clay, &mut f, &STILL, false, 0.0);
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
            // By less than the compression, and by more.
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

    /// The volume stays finite however far sand has come apart.
    #[test]
    fn slack_ends_before_numbers_do() {
        let sand = material(SAND, 0.3);
        let mut f = stretched(1, [1.0; 3], 0.0);
        let apart = gradient([[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]], 0.0);
        for _ in 0..200 {
            let ratio = advance(&sand, &mut f, &apart, false, 0.0);
            assert!(f[0][3] <= SLACKEST && ratio < 1e7, "{}", f[0][3]);
        }
        assert_eq!(f[0][3], SLACKEST);
    }
}
