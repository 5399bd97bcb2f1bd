//! State of the implicit scheme's solve (conjugate gradients), and the scales of its fixed-point sums. Twins:
//! `shaders/lib/scales.wgsl`, `force_scale.wgsl`.

use super::constants::Constants;
use crate::math::linear::dot;
use crate::math::real::Real;
use crate::math::symmetric::Symmetric;
use crate::stages::correction::LEAST_SEEN;
use crate::stages::motion::LEAST_MOTION;

/// What the solve of the implicit scheme keeps per particle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Search<R> {
    /// Change of pressure so far.
    pub pressure: R,
    /// Residual divergence; always 0 where the particle takes no part.
    pub residual: R,
    /// Direction of search.
    pub direction: R,
    /// Divergence per pressure.
    pub compliance: R,
}

impl<R: Real> Search<R> {
    /// The preconditioned residual: about the pressure that would cancel it. The response to a pressure is its
    /// compliance plus an effect of about 1 in the bulk and up to 3 for an isolated particle, so that 1/(c + 1) fits
    /// the bulk.
    #[inline(always)]
    pub fn answer(&self) -> R {
        self.residual * response(self.compliance)
    }
}

/// The preconditioned residual per residual.
#[inline(always)]
pub fn response<R: Real>(compliance: R) -> R {
    R::of(1.0) / (compliance + R::of(1.0))
}

/// What the solve keeps of a particle's stress besides the pressure, where it solves for that: deviators. For a liquid
/// whose viscosity is not solved for, all but the correction is 0.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shear<R> {
    /// Change so far.
    pub found: Symmetric<R>,
    /// Residual strain.
    pub residual: Symmetric<R>,
    /// Direction of search.
    pub direction: Symmetric<R>,
    /// Strain per stress.
    pub compliance: R,
    /// The correction of the strains that it underestimates.
    pub correction: [R; 3],
}

impl<R: Real> Shear<R> {
    /// As [`Search::answer`].
    #[inline(always)]
    pub fn answer(&self) -> Symmetric<R> {
        self.residual.times(response(self.compliance))
    }
}

/// The directions in which bodies hold a node.
#[derive(Debug, Clone, Copy, Default)]
pub struct Held<R> {
    /// A unit vector.
    pub axis: [R; 3],
    /// 0 none, 1 along the axis, 2 across it, 3 any.
    pub count: u32,
    /// Index of the body that holds it, of several the last to do so; of no meaning where `count` is 0.
    pub body: u32,
    /// The motion with which it is held. For a braked node the free part is that along the body's normal.
    pub motion: [R; 3],
    /// The share of its motion along a body that the body takes.
    pub braked: R,
}

/// Global state of the implicit scheme's solve.
#[derive(Debug, Clone, Copy, Default)]
pub struct Solve<R: Real> {
    /// Whether it solves for stresses, not for pressures alone.
    pub tensors: bool,
    /// Stresses beside clamps, and those of liquids where they stick, are corrected, which enlarges them.
    pub corrects: bool,
    /// Largest pressure that particles carry over, deviator included.
    pub pressure: R,
    /// The first direction of search is the stress that they carry over, except for what the motion is predicted with.
    pub resumes: bool,
    /// Largest norm of their displacement gradients.
    pub rate: R,
    /// Their largest compliance.
    pub compliance: R,
    /// Their largest preconditioned residual per residual.
    pub response: R,
    /// Largest preconditioned residuals ("answers"), directions of search, and pressures found. Before the first
    /// answers: the largest of the strains to be taken back and of the nodes' predicted motion.
    pub largest_answer: R,
    pub largest_direction: R,
    pub largest_found: R,
    /// Bounds of the first answers, of the answers now and before the last step, and of the directions of search and the
    /// pressures then.
    pub first_bound: R,
    pub bound: R,
    pub last_bound: R,
    pub direction_bound: R,
    pub pressure_bound: R,
    /// Square of the residual, now and before the last step.
    pub square: R,
    pub last_square: R,
    /// The square of the first.
    pub first_square: R,
    /// Squares weighted by compliance: of the answers, of the last directions, and of the sum of both.
    pub compliant: [R; 3],
    /// Square of the nodes' velocities along the direction of search, weighted by mass.
    pub energy: R,
    /// Share of the last direction in the next.
    pub mix: R,
    /// Length of the step along the direction of search.
    pub step: R,
    /// Change of the nodes' velocities in the last step, and what of these themselves counts
    /// ([`counted_motion`]): squares, weighted by mass.
    pub change: R,
    pub motion: R,
    /// Iterations taken.
    pub count: u32,
    /// Whether there is something left to do.
    pub active: bool,
}

impl<R: Real> Solve<R> {
    /// Scale of what stresses add to the nodes. Nodes are at most 1.5 away along each axis, and the mass of a node is
    /// at most half of what the scale of masses has room for. A deviator adds at most √3 times what a pressure of its
    /// norm adds; where strains are corrected, either counts up to twice.
    pub fn force_scale(&self, constants: &Constants<R>, last: bool) -> R {
        self.force_scale_of(constants, if last { self.pressure_bound } else { self.bound })
    }

    /// The same for pressures up to `bound`.
    pub fn force_scale_of(&self, constants: &Constants<R>, bound: R) -> R {
        if R::scale(2.0) == 1.0 {
            return R::of(1.0);
        }
        let share = if self.tensors { 0.125 } else { 0.25 };
        let share = R::of(if self.corrects { LEAST_SEEN * share } else { share });
        constants.mass_scale * share * inverse(bound, LEAST_BOUND)
    }

    /// A bound for the first answers, from what they are known to be made of before they are found.
    pub fn bound_of_first(&self) -> R {
        let known = self.largest_answer.max(R::of(LEAST_FIRST)).min(R::of(MOST_FIRST));
        R::of(2.0) * (known + self.rate) * self.response
    }

    /// Whether the next direction of search is the stress that particles carry over.
    #[inline(always)]
    pub fn resuming(&self) -> bool {
        self.resumes && self.count == 0
    }

    /// Whether the last direction of search was that.
    #[inline(always)]
    pub fn resumed(&self) -> bool {
        self.resumes && self.count == 1
    }

    /// Share of the last direction of search in the next. None in the first; none where an answer was cut, since the
    /// last direction does not match it; and none in the first after the stress carried over, which is no answer.
    pub fn mixing(&self) -> R {
        let begun = self.count > u32::from(self.resumes) && self.largest_answer <= self.bound;
        if begun { self.square * (R::of(1.0) / self.last_square) } else { R::of(0.0) }
    }

    /// A bound for the next directions of search.
    pub fn ahead(&self) -> R {
        self.largest_answer.min(self.bound) + self.mixing() * self.largest_direction
    }

    /// Scale of squares of residuals: those of 2²⁶ particles at the bound still fit.
    pub fn square_scale(&self) -> R {
        let one = inverse(self.bound, LEAST_COUNTED);
        R::of(PRECISION) * one * one * inverse(R::of(1.0) + self.compliance, LEAST_COUNTED)
    }

    /// Scale of squares weighted by compliance, of sums of an answer and a direction.
    pub fn compliant_scale(&self) -> R {
        let one = inverse(self.bound + self.direction_bound, LEAST_COUNTED);
        R::of(PRECISION) * one * one * inverse(self.compliance, LEAST_COUNTED)
    }

    /// Scale of squares of velocities, which are at most 2.6 times the pressures that cause them, twice that with the
    /// correction.
    pub fn energy_scale(&self) -> R {
        let one = inverse(self.ahead(), LEAST_COUNTED);
        R::of(0.125 * PRECISION) * one * one
    }
}

/// Bounds of what the bound of the first answers counts of the strains to be taken back and the predicted motion, besides
/// the gradients of motion: from cuts of answers that are larger after all the iterations recover; but squares of
/// residuals far below their bound would vanish.
pub const LEAST_FIRST: f64 = 1e-6;
pub const MOST_FIRST: f64 = 0.03125;

/// Steps of a sum of squares in the largest square.
pub const PRECISION: f64 = (1u64 << 31) as f64;

/// The least that scales of squares count a number as.
pub const LEAST_COUNTED: f64 = 1e-8;

/// The least bound of pressures that the scale of what they add to the nodes is made for.
pub const LEAST_BOUND: f64 = 1e-12;

/// Largest power of two not above the inverse of `x`.
pub fn inverse<R: Real>(x: R, least: f64) -> R {
    (R::of(1.0) / x.max(R::of(least))).max(R::MIN_POSITIVE).binade().0
}

/// Scale of the sums of the nodes' mass and motion.
pub const MOTION_SCALE: f64 = (1u64 << 20) as f64;

/// The share of the nodes' motion that counts even if all have it in common; sums are much more precise.
pub const IN_COMMON: f64 = 1e-4;

/// Scale of the motion in these sums: of what particles bring to nodes, at most `largest`, or gravity's `kick`, about 1
/// remains.
pub fn motion_scale<R: Real>(largest: Option<R>, kick: [R; 3]) -> R {
    let [x, y, z] = kick.map(R::abs);
    inverse(largest.unwrap_or_default().max(x.max(y).max(z)), LEAST_MOTION)
}

/// The nodes' motion that a change is compared with, given the sums of its squares, of their mass, and of their momentum
/// plus that mass along each axis, at a [`motion_scale`]: without what all have in common, however fast the frame of
/// reference moves. Gravity's `kick` counts as motion, also where nothing moves but what it has just pulled.
pub fn counted_motion<R: Real>([squares, mass, along @ ..]: [R; 5], scale: R, kick: [R; 3]) -> R {
    let unit = R::of(1.0) / scale;
    let momentum = along.map(|sum| sum - mass);
    let in_common = dot(momentum, momentum) * (R::of(1.0) / mass.max(R::of(LEAST_COUNTED)));
    let counted = (squares - in_common).max(squares * R::of(IN_COMMON));
    counted * unit * unit + R::of(2.0) * mass * dot(kick, kick)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same as the shaders compute from the bits.
    #[test]
    fn an_inverse_is_that_of_the_bits() {
        let of_bits = |x: f32| {
            let bounded = x.max(LEAST_COUNTED as f32).min(2f32.powi(126));
            f32::from_bits((0x7f00_0000 - bounded.to_bits()) & 0x7f80_0000)
        };
        let powers = (-40..128).map(|exponent| 2f32.powi(exponent));
        let beside = |x: f32| {
            [-2, -1, 0, 1, 2, 0x3f_ffff, 0x40_0000].map(|n| f32::from_bits(x.to_bits().wrapping_add_signed(n)))
        };
        let spread = (0..1 << 16).map(|n| f32::from_bits(0x3000_0000 + n * 0x4f00));
        for x in powers.flat_map(beside).chain(spread).chain([0.0, f32::MIN_POSITIVE, f32::MAX, f32::INFINITY]) {
            assert_eq!(inverse(x, LEAST_COUNTED).to_bits(), of_bits(x).to_bits(), "{x:e}");
        }
    }
}
