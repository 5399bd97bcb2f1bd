//! Adds each particle's stress to its displacement gradient: a step scatters the motion together with the impulse of
//! the stress at the step's beginning.
//!
//! A Kirchhoff stress τ, in the unit of the moduli, adds −4 Δt² τ/ρ (inertia of the kernel ¼; see `docs/method.md`).

use super::Kernel;
use super::correction::{corrected, kept};
use super::motion::{self, bound_gradient};
use super::solid::{LIQUID, Matrix, SAND, along, magnitude};
use super::viscosity::{viscosity, viscous_share};
use super::walls::{Walls, factors_beside};
use crate::bins::origin;
use crate::cpu::constants::{Constants, MaterialConstants};
use crate::cpu::gradient::{Gradient, beside_of, evenness_of, material_of};
use crate::cpu::lanes::{entries, materials_of, matrices};
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::{Lanes, Real};
use crate::math::svd::svd_of_four;
use crate::math::wide::{Wide, Work, widely};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        write(Slot::Gradient),
        read(Slot::Deformation).with_solids(),
        write(Slot::Counters),
        read(Slot::Bin).with_sleep(),
        read(Slot::Displacement),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/stress.wgsl"),
};

/// Largest stiffness of a liquid where matter lies evenly, relative to that of an isolated particle. At 4 sound travels
/// a cell per step, which is just stable for layers of particles a cell apart amid cells, where each layer has the
/// nodes to its sides to itself, however even all is. The rest is a margin for disorder.
pub(crate) const FIRMEST: f64 = 3.4;

/// Reduction of that where a step removes all shear. A stretch along one axis alone then keeps only a third of its
/// rate, the share S = 1 − 2 s/3 with s = 1, and pressures that reverse the rest would grow from K̂ = (1 + S)/2 on.
pub(crate) const SOFTENED: f64 = FIRMEST / 3.0;

/// Evenness of matter up to which a liquid is as soft as an isolated particle, and from which it has the largest
/// stiffness.
const SOFT_TO_FIRM: [f64; 2] = [0.4, 0.64];

/// The line between both: its slope, and what is subtracted.
pub(crate) const FIRMING: f64 = (FIRMEST - 1.0) / (SOFT_TO_FIRM[1] - SOFT_TO_FIRM[0]);
pub(crate) const SOFT: f64 = FIRMING * SOFT_TO_FIRM[0] - 1.0;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (position, materials, constants, deformation) = (&s.position, &s.materials, &s.constants, &s.deformation);
    let (displacement, tally, corrects) = (&s.displacement, &s.tally, s.features.corrects);
    let solids = materials.iter().any(|m| m.model != LIQUID);
    let unit = |m: &MaterialConstants<R>| {
        R::of(4.0) * m.inverse_density * constants.seconds * constants.seconds * constants.impulse
    };
    let walls = Walls::of(s);
    let largest = par::Largest::new();
    par::block_particles(&s.blocks[..s.occupied], &mut s.gradient[..], &|_, block, gradients| {
        let walls = walls.beside(origin(block.key));
        let walls = walls.as_ref();
        let mut most = R::of(0.0);
        let mut stresses = [Matrix::default(); 4];
        for (start, four) in (block.start as usize..).step_by(4).zip(gradients.chunks_mut(4)) {
            if solids {
                let of = materials_of(four, materials);
                if of.iter().any(|m| m.model != LIQUID) {
                    let f = &deformation[start..][..four.len()];
                    widely(&Solid { of, f, unit: of.map(unit) }, &mut stresses);
                }
            }
            for ((p, gradient), stress) in (start..).zip(four).zip(&stresses) {
                let material = &materials[material_of(gradient)];
                viscosity(material, gradient, constants);
                if material.model == LIQUID {
                    let factors = factors_beside(walls, position[p], beside_of(gradient));
                    let pressure =
                        liquid(material, position[p][3], unit(material), constants, evenness_of(gradient), factors);
                    (0..3).for_each(|c| gradient[c][c] += pressure * factors[c]);
                } else {
                    let hidden = corrects && material.model != SAND;
                    let stress = if hidden { corrected(stress, kept(&deformation[p])) } else { *stress };
                    for (column, stress) in gradient.iter_mut().zip(stress) {
                        (0..3).for_each(|i| column[i] += stress[i]);
                    }
                }
                bound_gradient(gradient, constants, tally);
                most = most.max(motion::largest(displacement[p], gradient, constants));
            }
        }
        largest.note([most]);
    });
    let [motion] = largest.take();
    motion::note(&mut s.largest_motion, motion);
}

/// What the stress −K (1 − J) of a liquid adds to the diagonal of its displacement gradient, before the `factors` of
/// walls beside it; nothing where it has come apart.
#[inline(always)]
fn liquid<R: Real>(
    m: &MaterialConstants<R>,
    ratio: R,
    unit: R,
    constants: &Constants<R>,
    evenness: R,
    factors: [R; 3],
) -> R {
    if ratio > constants.tension_limit {
        return R::of(0.0);
    }
    let firmness = firmness(evenness, viscous_share(m, constants), factors);
    let stiffness = (unit * m.bulk).min(R::of(4.0) * constants.stiffness_limit * firmness);
    stiffness * (R::of(1.0) - ratio)
}

/// Largest stiffness of a liquid relative to that of an isolated particle far from walls, where matter lies this evenly
/// and a step removes this share of the shear.
///
/// Before walls a particle in sparse matter moves fewer nodes, but sees and exerts what is missing as well (`factors`):
/// its response to a pressure grows by up to that factor along each axis.
#[inline(always)]
fn firmness<R: Real>(evenness: R, share: R, [x, y, z]: [R; 3]) -> R {
    let firmest = R::of(FIRMEST) - share * R::of(SOFTENED);
    let beside = || R::of(3.0) / (x + y + z);
    let softest = if evenness < R::of(0.0) { beside() * beside() } else { R::of(1.0) };
    (evenness * R::of(FIRMING) - R::of(SOFT)).max(softest).min(firmest)
}

/// Up to four particles in a world with solids.
struct Solid<'a, R> {
    of: [&'a MaterialConstants<R>; 4],
    /// Deformation gradients, entirely elastic.
    f: &'a [Gradient<R>],
    unit: [R; 4],
}

impl<R: Real> Work<&mut [Matrix<R>; 4]> for Solid<'_, R> {
    /// The effect of their stress on the displacement gradients.
    #[inline(always)]
    fn on(&self, _: Option<Wide>, stresses: &mut [Matrix<R>; 4]) {
        let svd = svd_of_four::<R>(&matrices::<R>(self.f).0);
        let unit = R::V::from4(self.unit);
        *stresses = entries::<R>(along(&svd.u, principal::<R>(self.of, svd.sigma).map(|t| -(unit * t))));
    }
}

/// Principal Kirchhoff stresses of these stretches, linear in their logarithms (Hencky): matter does not stiffen as it
/// is stretched, so that a step short enough for small strains is short enough for all.
#[inline(always)]
fn principal<R: Real>(of: [&MaterialConstants<R>; 4], sigma: [R::V; 3]) -> [R::V; 3] {
    let strain = sigma.map(|s| magnitude::<R>(s).ln());
    let trace = strain[0] + strain[1] + strain[2];
    let mean = trace * R::V::all(R::of(1.0 / 3.0));
    let [twice, bulk] = [R::V::from4(of.map(|m| m.shear + m.shear)), R::V::from4(of.map(|m| m.bulk))];
    strain.map(|e| twice * (e - mean) + bulk * trace)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::material_constants;
    use crate::material::Material;
    use crate::math::linear::{add, scale, transform};
    use crate::math::matrices::matrix;
    use crate::math::svd::svd;
    use crate::settings::Scheme;
    use crate::stages::solid::one::advance;
    use crate::units::Units;
    use glam::DVec3;

    const DENSITY: f64 = 1200.0;
    const CELL: f64 = 0.02;

    fn constants(material: &Material) -> MaterialConstants<f64> {
        let units = Units { origin: DVec3::ZERO, cell_size: CELL, density: DENSITY };
        let material = Material { rest_density: DENSITY, ..material.clone() };
        material_constants(&material, Scheme::Explicit, false, &units)
    }

    /// Principal Kirchhoff stresses, Pa.
    fn pascals(material: &Material, stretches: [f64; 3]) -> [f64; 3] {
        let lanes = stretches.map(<<f64 as Real>::V as Lanes<f64>>::all);
        principal::<f64>([&constants(material); 4], lanes).map(|t| t.to4()[0] * DENSITY * CELL * CELL)
    }

    /// A gradient with these principal stretches along axes drawn by `seed`.
    fn stretched(seed: u64, stretches: [f64; 3]) -> Gradient<f64> {
        let axes = svd(&matrix(seed));
        let columns = [0, 1, 2].map(|k| scale(axes.u[k], stretches[k]));
        [0, 1, 2].map(|j| {
            let [x, y, z] = transform(&columns, [axes.v[0][j], axes.v[1][j], axes.v[2][j]]);
            [x, y, z, 0.0]
        })
    }

    fn solids() -> [Material; 3] {
        let of = |m: Material| Material { youngs_modulus: 3e5, poisson_ratio: 0.35, ..m };
        [of(Material::elastic("")), of(Material::sand("", 30.0)), of(Material::viscoplastic("", 0.05))]
    }

    #[test]
    fn a_small_strain_bears_what_its_moduli_say() {
        for material in solids() {
            let [along, across, other] = pascals(&material, [1.0 + 1e-6, 1.0 - 0.35e-6, 1.0 - 0.35e-6]);
            assert!((along / (3e5 * 1e-6) - 1.0).abs() < 1e-4, "{:?}: {along} Pa", material.model);
            assert!(across.abs() < 1e-4 * along && other.abs() < 1e-4 * along);
        }
        let water = Material { bulk_modulus: 2e5, ..Material::liquid("") };
        let (m, seconds) = (constants(&water), 1e-4);
        let constants = Constants { seconds, tension_limit: 1.1, stiffness_limit: 0.25, ..Constants::default() };
        let unit = 4.0 * m.inverse_density * seconds * seconds;
        for (ratio, pressure) in [(0.99, 2e3), (1.01, -2e3), (1.2, 0.0)] {
            // p = q ρ Δx²/(4 Δt²)
            let found =
                liquid(&m, ratio, unit, &constants, 0.0, [1.0; 3]) * DENSITY * CELL * CELL / (4.0 * seconds * seconds);
            assert!((found - pressure).abs() < 1e-6, "{found} Pa at {ratio}");
        }
    }

    /// The stiffness follows how evenly mass lies; softer liquids are not made stiffer.
    #[test]
    fn liquids_are_as_stiff_as_the_matter_around_bears() {
        let water = Material::liquid("");
        let step = Constants { seconds: 1e-3, tension_limit: 1.1, stiffness_limit: 0.25, ..Constants::default() };
        let beside = |m: &MaterialConstants<f64>, evenness: f64, factors: [f64; 3]| {
            let unit = 4.0 * m.inverse_density * step.seconds * step.seconds;
            liquid(m, 0.9, unit, &step, evenness, factors) / (4.0 * 0.1)
        };
        let stiffness = |m: &MaterialConstants<f64>, evenness: f64| beside(m, evenness, [1.0; 3]);
        let firm = [0.0, 0.3, 0.5, 0.6, 0.9, 1.0].map(|evenness| stiffness(&constants(&water), evenness));
        for (found, expected) in firm.into_iter().zip([0.25, 0.25, 0.5, 0.75, 0.85, 0.85]) {
            assert!((found - expected).abs() < 1e-9, "{firm:?}");
        }
        // On a floor and in a corner, by itself and amid others.
        for (factors, alone) in [([1.0, 2.0, 1.0], 0.25 * 0.75 * 0.75), ([2.0; 3], 0.25 * 0.25)] {
            let found = [-1.0, 0.0, 0.5, 1.0].map(|evenness| beside(&constants(&water), evenness, factors));
            for (found, expected) in found.into_iter().zip([alone, 0.25, 0.5, 0.85]) {
                assert!((found - expected).abs() < 1e-9, "{factors:?}: {found}");
            }
        }
        // Viscosity that removes three fifths of the shear, and more than all of it.
        let thick = [0.6, 2.0].map(|share| {
            let viscosity = share * DENSITY * CELL * CELL / (8.0 * step.seconds);
            constants(&Material { viscosity, ..water.clone() })
        });
        for (m, expected) in thick.iter().zip([0.85 * 0.8, 0.85 * 2.0 / 3.0]) {
            let found = [stiffness(m, 0.3), stiffness(m, 1.0)];
            assert!((found[0] - 0.25).abs() < 1e-9 && (found[1] - expected).abs() < 1e-9, "{found:?}");
        }
        let soft = constants(&Material { bulk_modulus: 1e3, ..water });
        assert_eq!(stiffness(&soft, 0.0), stiffness(&soft, 1.0));
    }

    #[test]
    fn what_has_yielded_bears_what_its_surface_says() {
        let [_, sand, clay] = solids();
        let clay = Material { yield_stress: Some(700.0), ..clay };
        for seed in 0..20 {
            let stretches = [1.08, 0.97, 0.93];
            let after = |material: &Material| {
                let mut f = stretched(seed, stretches);
                advance(&constants(material), &mut f, &Gradient::default(), false, 0.0);
                let tau = pascals(material, svd(&f.map(|c| [c[0], c[1], c[2]])).sigma);
                let mean = (tau[0] + tau[1] + tau[2]) / 3.0;
                (mean, tau.iter().map(|t| (t - mean).powi(2)).sum::<f64>().sqrt())
            };
            // In pure shear of stress τ the deviator's norm is √2 τ.
            let (_, deviator) = after(&clay);
            assert!((deviator / (2f64.sqrt() * 700.0) - 1.0).abs() < 1e-9, "{deviator} Pa");
            let (mean, deviator) = after(&sand);
            let friction = deviator / (2f64.sqrt() * -mean);
            assert!((friction - 30f64.to_radians().tan()).abs() < 1e-9, "{friction}");
        }
    }

    /// An isolated particle oscillates about its shape, at the longest allowed step, with no more energy than it was
    /// given, except for what symplectic Euler adds within an oscillation.
    #[test]
    fn an_isolated_particle_swings_within_bounds() {
        for (material, stretches) in solids().into_iter().zip([[1.25, 1.0, 0.85], [0.9, 0.95, 0.97], [1.05, 1.0, 0.95]])
        {
            for poisson_ratio in [0.0, 0.3, 0.45] {
                let material = Material { poisson_ratio, rest_density: DENSITY, ..material.clone() };
                let m = MaterialConstants { yield_limit: 10.0, ..constants(&material) };
                let seconds = material.stable_dt(CELL);
                let unit = 4.0 * m.inverse_density * seconds * seconds;
                let mut f = stretched(1, stretches);
                let mut d = [[0.0; 3]; 3];
                let mut most = [0.0f64; 2];
                for step in 0..4000 {
                    let mut stresses = [Matrix::default(); 4];
                    Solid { of: [&m; 4], f: &[f], unit: [unit; 4] }.on(None, &mut stresses);
                    d = [0, 1, 2].map(|c| add(d[c], stresses[0][c]));
                    let gradient = d;
                    f = f.map(|c| {
                        let [x, y, z] = add([c[0], c[1], c[2]], transform(&gradient, [c[0], c[1], c[2]]));
                        [x, y, z, 0.0]
                    });
                    let sigma = svd(&f.map(|c| [c[0], c[1], c[2]])).sigma;
                    let strain = sigma.iter().map(|s| s.abs().ln().abs()).fold(0.0, f64::max);
                    most[usize::from(step >= 400)] = strain.max(most[usize::from(step >= 400)]);
                }
                assert!(most[1] < 1.2 * most[0] && most[0] < 0.8, "{:?} {poisson_ratio}: {most:?}", material.model);
            }
        }
    }
}
