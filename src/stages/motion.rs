//! The largest motion that particles bring to nodes, from which the scale of the momentum sums follows. Twins:
//! `shaders/lib/bound_gradient.wgsl`, `shaders/lib/largest_motion.wgsl`, `shaders/lib/momentum_scale.wgsl`.

use crate::cpu::constants::Constants;
use crate::cpu::gradient::Gradient;
use crate::cpu::state::Tally;
use crate::math::linear::dot;
use crate::math::real::Real;

/// Largest distance from a particle to a node of its stencil, in cells: √3 times the reach of its kernel.
pub(crate) const FARTHEST: f64 = 2.6;
/// Least motion that a scale is computed for, in cells per step.
pub(crate) const LEAST_MOTION: f64 = 1e-9;

/// The factor that brings a displacement gradient, whose squared norm is `square`, within the bound that the
/// fixed-point scale is made for; `None` if it is.
#[inline(always)]
pub(super) fn excess<R: Real>(square: R, constants: &Constants<R>, tally: &Tally) -> Option<R> {
    let bound = constants.max_gradient;
    (square > bound * bound).then(|| {
        Tally::add(&tally.gradient_clamped, 1);
        bound / square.sqrt()
    })
}

/// Bounds a particle's displacement gradient to what the fixed-point scale is made for; returns it and the square of
/// its norm.
#[inline(always)]
pub(super) fn bound_gradient<R: Real>(
    gradient: &mut Gradient<R>,
    constants: &Constants<R>,
    tally: &Tally,
) -> ([[R; 3]; 3], R) {
    let mut norm = square(gradient);
    // Most need no change.
    if let Some(factor) = excess(norm, constants, tally) {
        gradient.iter_mut().for_each(|column| column[..3].iter_mut().for_each(|e| *e *= factor));
        norm = constants.max_gradient * constants.max_gradient;
    }
    (gradient.map(|c| [c[0], c[1], c[2]]), norm)
}

/// The largest displacement that a particle can bring to a node. Its own displacement is bounded to what is allowed.
#[inline(always)]
pub(super) fn largest<R: Real>([x, y, z, _]: [R; 4], d: &Gradient<R>, constants: &Constants<R>) -> R {
    let speed = dot([x, y, z], [x, y, z]).sqrt().min(constants.max_displacement);
    speed + R::of(FARTHEST) * square(d).sqrt()
}

/// Merges the largest motion that a stage has found with that of other stages in the step.
pub(super) fn note<R: Real>(largest: &mut Option<R>, found: R) {
    *largest = Some(largest.map_or(found, |before| before.max(found)));
}

/// Units per unit of momentum if particles bring at most this motion: the mass of a node is at most half of what the
/// scale of masses has room for. The scale of the world where the motion is not known.
#[inline(always)]
pub(crate) fn momentum_scale<R: Real>(largest: Option<R>, constants: &Constants<R>) -> R {
    match largest {
        Some(largest) if R::scale(2.0) != 1.0 => {
            let (_, twice_inverse) = largest.max(R::of(LEAST_MOTION)).binade();
            constants.mass_scale * (R::of(0.125) * twice_inverse)
        }
        _ => constants.momentum_scale,
    }
}

/// Squared Frobenius norm of a matrix by columns, without its fourth lanes.
#[inline(always)]
pub(super) fn square<R: Real, const N: usize>([x, y, z]: &[[R; N]; 3]) -> R {
    let of = |c: &[R; N]| dot([c[0], c[1], c[2]], [c[0], c[1], c[2]]);
    of(x) + of(y) + of(z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::kernel::KERNEL_REACH;

    /// A particle that slides, turns and is stretched along a diagonal, where the farthest nodes are.
    #[test]
    fn no_particle_brings_more_to_a_node() {
        let constants = Constants::<f64> { max_displacement: 0.5, ..Constants::default() };
        let stretched = [[0.2, 0.2, 0.2, 7.0]; 3];
        let turning = [[0.0, 0.2, -0.1, 7.0], [0.3, 0.1, 0.0, 7.0], [0.0, 0.4, 0.2, 7.0]];
        let cases = [
            ([0.1, -0.2, 0.3, 9.0], [[0.0; 4]; 3]),
            ([0.0, 0.0, 0.0, 9.0], turning),
            ([0.1, 0.0, 0.2, 9.0], turning),
            ([0.0, 0.0, 0.0, 9.0], stretched),
        ];
        for (u, d) in cases {
            let most = largest(u, &d, &constants);
            for corner in 0..8 {
                let way = [0, 1, 2].map(|a| if corner >> a & 1 == 0 { KERNEL_REACH } else { -KERNEL_REACH });
                let moved: [f64; 3] = [0, 1, 2].map(|a| u[a] + (0..3).map(|b| d[b][a] * way[b]).sum::<f64>());
                assert!(dot(moved, moved).sqrt() <= most, "{moved:?} is more than {most}");
            }
        }
        assert_eq!(largest([3.0, 4.0, 0.0, 0.0], &[[0.0; 4]; 3], &constants), 0.5);
    }

    /// As fine as fits: when the mass of a node fills its word, its momentum by this motion fills between half and all
    /// of its own.
    #[test]
    fn the_scale_is_as_fine_as_the_motion() {
        let constants =
            Constants::<f32> { mass_scale: 134_217_728.0, momentum_scale: 8_388_608.0, ..Constants::default() };
        for motion in [1e-6, 3e-3, 0.4, 0.5, 7.0, 2000.0] {
            let scale = f64::from(momentum_scale(Some(motion), &constants));
            let fullest = f64::from(motion) * scale * 2f64.powi(32) / f64::from(constants.mass_scale);
            assert!(fullest < 2f64.powi(31) && fullest >= 2f64.powi(30), "{motion}: {fullest}");
        }
        assert!(momentum_scale(Some(0.0), &constants).is_finite());
        assert_eq!(momentum_scale(None, &constants), constants.momentum_scale);
    }
}
