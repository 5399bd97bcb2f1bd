//! How compliant matter is in a step of the implicit scheme. Twin: `shaders/lib/compliance.wgsl`.

use super::solid::ELASTIC;
use crate::cpu::state::{Constants, MaterialConstants};
use crate::math::real::Real;

/// Of the stiffest liquid that the iterations can follow, how stiff a solid may be, which has three times as many ways to move: the
/// bound for the square of its sound's speed.
pub(crate) const SOLID_SHARE: f64 = 0.25;
/// How stiff it may be with any number of iterations: a step takes strains for linear, and an impact of stiffer matter ends in more
/// energy than it had.
pub(crate) const SOLID_LIMIT: f64 = 8.0;

/// Largest stress per strain of a step that is solved for as viscosity: how many times as viscous liquids may be as where each particle takes
/// its own shear rate. Beyond, impacts would ask for more iterations than there are.
pub(crate) const THICKEST: f64 = 1024.0;

/// The stress of elastic matter whose sound a step resolves acts at the mean of its strains after, at and before the step's beginning, the
/// first of this weight β, the last of [`EARLIER`] times it: Newmark's method. Swings of angular frequency ω are damped by
/// ½ β (1 − [`EARLIER`]) ω Δt.
pub(crate) const LATER: f64 = 0.5;
/// See [`LATER`].
pub(crate) const EARLIER: f64 = 0.2;
/// Square of the cells that sound travels in a step up to which the step resolves it.
pub(crate) const RESOLVED: f64 = 8.0;

/// [`LATER`] and [`EARLIER`] of a material. The stress of what is stiffer, and of what flows and has no strain before to swing back to, is
/// that of the step's end.
#[inline(always)]
pub(super) fn weights<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> [R; 2] {
    let resolved = m.model == ELASTIC && sound(m, constants) <= R::of(RESOLVED);
    if resolved { [R::of(LATER), R::of(EARLIER)] } else { [R::of(1.0), R::of(0.0)] }
}

/// Square of the cells that sound travels through a material in a step.
#[inline(always)]
fn sound<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    unit(m, constants) * (m.bulk + R::of(4.0 / 3.0) * m.shear)
}

/// What makes a modulus the square of the cells that its sound travels in a step.
#[inline(always)]
fn unit<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    m.inverse_density * constants.seconds * constants.seconds * constants.impulse
}

/// Compliances to pressure, as divergence per pressure, and to shear, as strain per stress; the latter 0 of a liquid whose viscosity is not
/// solved for. Stiffer matter is taken for as soft as the iterations can follow.
#[inline(always)]
pub(super) fn compliances<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> [R; 2] {
    let one = R::of(1.0);
    let unit = unit(m, constants);
    let bulk = unit * m.bulk;
    let viscous = viscous_stiffness(m, constants);
    if m.shear <= R::of(0.0) {
        let shear = if viscous > R::of(0.0) { one / viscous } else { R::of(0.0) };
        return [one / (R::of(4.0) * bulk.min(constants.stiffness_limit)), shear];
    }
    [one / (R::of(4.0) * borne(m, constants) * bulk), one / (elastic_stiffness(m, constants) + viscous)]
}

/// How much stiffer a liquid is to the mean of its volume in a block than to that of a particle, as pressure per divergence. Nothing where
/// blocks have no limit.
#[inline(always)]
pub(super) fn stiffness_beside<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    let bulk = unit(m, constants) * m.bulk;
    R::of(4.0) * (bulk.min(constants.block_limit) - bulk.min(constants.stiffness_limit)).max(R::of(0.0))
}

/// What of a solid's moduli a step takes into account, by the weight of its end.
#[inline(always)]
fn borne<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    let one = R::of(1.0);
    let limit = (R::of(SOLID_SHARE) * constants.stiffness_limit).min(R::of(SOLID_LIMIT));
    let [later, _] = weights(m, constants);
    later * (limit * (one / sound(m, constants))).min(one)
}

/// Stress per strain of a solid's shear.
#[inline(always)]
fn elastic_stiffness<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    R::of(8.0) * borne(m, constants) * (unit(m, constants) * m.shear)
}

/// What of the stress that strains of the step's beginning stand for is left where viscosity is solved for as well.
#[inline(always)]
pub(super) fn elastic_share<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>, compliance: R) -> R {
    if m.solved_viscosity > R::of(0.0) { elastic_stiffness(m, constants) * compliance } else { R::of(1.0) }
}

/// Stress per strain of a step that is solved for as viscosity.
#[inline(always)]
pub(super) fn viscous_stiffness<R: Real>(m: &MaterialConstants<R>, constants: &Constants<R>) -> R {
    (R::of(8.0) * m.solved_viscosity * m.inverse_density * constants.seconds).min(R::of(THICKEST))
}
