//! What the solve of the implicit scheme keeps, and the scales of its fixed-point sums. Twin: `shaders/lib/scales.wgsl`.

use super::state::Constants;
use crate::math::real::Real;

/// What the solve of the implicit scheme keeps for a particle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Search<R> {
    /// Change of pressure so far.
    pub pressure: R,
    /// Divergence that is still wrong.
    pub residual: R,
    /// Direction of search.
    pub direction: R,
    /// What the direction does to the divergence.
    pub image: R,
    /// Divergence per pressure.
    pub compliance: R,
    /// By how much the pressure that was brought along is to change, since the nodes do not know of it.
    pub leak: R,
    /// Whether it takes part, 0 or 1.
    pub share: R,
}

impl<R: Real> Search<R> {
    /// About the pressure that takes the residual back: the inverse of the compliance and of what a pressure does at an isolated
    /// particle.
    #[inline(always)]
    pub fn answer(&self) -> R {
        self.share * self.residual * (R::of(1.0) / (self.compliance + R::of(1.0)))
    }
}

/// In which directions bodies hold a node.
#[derive(Debug, Clone, Copy, Default)]
pub struct Held<R> {
    /// A unit vector.
    pub axis: [R; 3],
    /// 0 none, 1 along the axis, 2 across it, 3 any.
    pub count: u32,
    /// The motion with which it is held.
    pub motion: [R; 3],
}

/// What the solve of the implicit scheme knows as a whole. Twin: `Solve` in `shaders/lib/layout.wgsl`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Solve<R: Real> {
    /// Largest pressure that particles bring along.
    pub pressure: R,
    /// Largest norm of their displacement gradients.
    pub rate: R,
    /// Largest answers to the residuals, directions of search, and pressures found.
    pub answer: R,
    pub direction: R,
    pub found: R,
    /// To what the next answers are bounded, and a bound for the next change of pressure.
    pub bound: R,
    pub last_bound: R,
    pub pressure_bound: R,
    /// Square of the residual, now and before the last step.
    pub square: R,
    pub last_square: R,
    /// The square of the first.
    pub first_square: R,
    /// Curvature along the residual's answer: what compliance and what the nodes' motion contribute.
    pub compliant: R,
    pub energy: R,
    /// Length of the step along the direction of search.
    pub step: R,
    /// Share of the last direction in the next.
    pub mix: R,
    /// By how much the last step changed the nodes' velocities, and these themselves: squares, by mass.
    pub change: R,
    pub motion: R,
    /// Steps taken.
    pub count: u32,
    /// Whether there is something left to do.
    pub active: bool,
}

/// Largest power of two not above `x`.
fn power<R: Real>(x: R) -> R {
    x.max(R::MIN_POSITIVE).binade().0
}

impl<R: Real> Solve<R> {
    /// Scale of the momentum: that of the world, or what the pressures that are brought along leave.
    pub fn momentum_scale(&self, constants: &Constants<R>) -> R {
        if self.pressure <= R::of(0.0) || R::scale(2.0) == 1.0 {
            return constants.momentum_scale;
        }
        let speed = constants.max_displacement + R::of(2.6) * (constants.max_gradient + R::of(1.74) * self.pressure);
        power(constants.mass_scale * (R::of(0.5) * (R::of(1.0) / speed)))
    }

    /// Scale of what pressures add to the nodes: these are 1.5 away along each axis, and the mass of a node is at most half of what
    /// the scale of masses has room for.
    pub fn force_scale(&self, constants: &Constants<R>, last: bool) -> R {
        if R::scale(2.0) == 1.0 {
            return R::of(1.0);
        }
        let bound = if last { self.pressure_bound } else { self.bound };
        power(constants.mass_scale * (R::of(0.25) * (R::of(1.0) / bound.max(R::of(1e-12)))))
    }

    /// Scale of the pressures that are brought along, summed by mass.
    pub fn pressure_scale(&self, constants: &Constants<R>) -> R {
        if R::scale(2.0) == 1.0 {
            return R::of(1.0);
        }
        power(constants.mass_scale * (R::of(0.5) * (R::of(1.0) / self.pressure.max(R::of(1e-12)))))
    }

    /// Scale of squares of residuals: of 2²⁶ particles at the bound they still fit.
    pub fn square_scale(&self) -> R {
        let one = power(R::of(1.0) / self.bound.max(R::of(1e-12)));
        R::of((1u64 << 31) as f64) * one * one
    }

    /// Scale of squares of velocities, which are at most 2.6 times the bound.
    pub fn energy_scale(&self) -> R {
        let one = power(R::of(1.0) / self.bound.max(R::of(1e-12)));
        R::of((1u64 << 24) as f64) * one * one
    }
}

/// Scale of the sum of the nodes' motion.
pub const MOTION_SCALE: f64 = (1u64 << 20) as f64;
