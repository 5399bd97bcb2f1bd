//! Compliance of matter in a step of the implicit scheme. Twin: `shaders/lib/compliance.wgsl`.

use super::solid::ELASTIC;
use crate::cpu::constants::{Constants, MaterialConstants};
use crate::math::real::Real;

/// Largest stiffness of a solid, as the square of its speed of sound in cells per step, relative to that of the
/// stiffest liquid that the iterations can follow: a solid has three times as many modes of motion.
pub(crate) const SOLID_SHARE: f64 = 0.25;
/// Its largest stiffness for any number of iterations: a step takes strains as linear, and an impact of stiffer matter
/// ends with more energy than it had.
pub(crate) const SOLID_LIMIT: f64 = 8.0;

/// Largest stress per strain of a step where viscosity is solved for: viscous liquids may be this many times as viscous
/// as where each particle damps its own shear rate. Beyond it, impacts would need more iterations than there are.
pub(crate) const THICKEST: f64 = 1024.0;

/// Elastic matter whose sound a step resolves is integrated by Newmark's method: its stress acts at the mean of the
/// strains after, at and before the step's beginning. The first has this weight β, the last [`EARLIER`] times it.
/// Oscillations of angular frequency ω are damped by ½ β (1 − [`EARLIER`]) ω Δt.
pub(crate) const LATER: f64 = 0.5;
/// See [`LATER`].
pub(crate) const EARLIER: f64 = 0.2;
/// Square of the cells that sound travels in a step, up to which the step resolves it.
pub(crate) const RESOLVED: f64 = 8.0;

/// [`LATER`] and [`EARLIER`] of a material. Stiffer matter, and matter that flows and so has no earlier strain to swing
/// back to, has the stress of the step's end.
#[inline(always)]
pub(super) fn weights<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> [R; 2] {
    let resolved = m.model == ELASTIC && sound_square(m, constants) <= R::of(RESOLVED);
    if resolved { [R::of(LATER), R::of(EARLIER)] } else { [R::of(1.0), R::of(0.0)] }
}

/// Square of the cells that sound travels through a material in a step.
#[inline(always)]
fn sound_square<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    unit(m, constants) * (m.bulk + R::of(4.0 / 3.0) * m.shear)
}

/// Factor from a modulus to the square of the cells that its sound travels in a step.
#[inline(always)]
fn unit<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    m.inverse_density * constants.seconds * constants.seconds * constants.impulse
}

/// Compliances to pressure, as divergence per pressure, and to shear, as strain per stress; the latter is 0 for a
/// liquid whose viscosity is not solved for. Stiffer matter counts as only as stiff as the iterations can follow.
#[inline(always)]
pub(super) fn compliances<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> [R; 2] {
    let one = R::of(1.0);
    let viscous = viscous_stiffness(m, constants);
    if m.shear <= R::of(0.0) {
        let shear = if viscous > R::of(0.0) { one / viscous } else { R::of(0.0) };
        return [one / (R::of(4.0) * particle_stiffness(m, constants)), shear];
    }
    [
        one / (R::of(4.0) * borne(m, constants) * (unit(m, constants) * m.bulk)),
        one / (elastic_stiffness(m, constants) + viscous),
    ]
}

/// How stiff a liquid's particle is, as the square of the cells that its sound travels in a step.
#[inline(always)]
fn particle_stiffness<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    (unit(m, constants) * m.bulk).min(constants.stiffness_limit)
}

/// The compliance of a liquid's particle to a change of the volume of its whole block.
#[inline(always)]
pub(super) fn compliance_with_block<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    R::of(1.0) / (R::of(4.0) * particle_stiffness(m, constants).max(constants.block_stiffness))
}

/// How much stiffer a liquid is to the mean compression of a block than to that of a particle, as pressure per
/// divergence. 0 where blocks have no pressure of their own.
#[inline(always)]
pub(super) fn stiffness_beside<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    R::of(4.0) * (constants.block_stiffness - particle_stiffness(m, constants)).max(R::of(0.0))
}

/// The share of a solid's moduli that a step accounts for, times the weight of the step's end.
#[inline(always)]
fn borne<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    let one = R::of(1.0);
    let limit = (R::of(SOLID_SHARE) * constants.stiffness_limit).min(R::of(SOLID_LIMIT));
    let [later, _] = weights(m, constants);
    later * (limit * (one / sound_square(m, constants))).min(one)
}

/// Stress per strain for a solid's shear.
#[inline(always)]
fn elastic_stiffness<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    R::of(8.0) * borne(m, constants) * (unit(m, constants) * m.shear)
}

/// The share of the stress from the strains of the step's beginning that remains where viscosity is solved for as well.
#[inline(always)]
pub(super) fn elastic_share<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>, compliance: R) -> R {
    if m.solved_viscosity > R::of(0.0) { elastic_stiffness(m, constants) * compliance } else { R::of(1.0) }
}

/// Stress per strain of a step for viscosity that is solved for.
#[inline(always)]
pub(super) fn viscous_stiffness<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    (R::of(8.0) * m.solved_viscosity * m.inverse_density * constants.seconds).min(R::of(THICKEST))
}
