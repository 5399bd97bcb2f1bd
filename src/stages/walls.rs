//! What liquids before the domain's closed sides, and before [`faces`](super::faces) of bodies, see of a strain across
//! them. Twin: `shaders/lib/walls.wgsl`.
//!
//! A side goes through nodes, which it holds, with all behind them: of a motion that is proportional to the distance
//! from it, a particle less than half a cell away sees a part only. So the entries of its displacement gradient on the
//! diagonal count as more when volume is concerned, and so do those of its pressure, since one operator is the transpose
//! of the other. Without that, the pressure of a liquid at rest would have to be higher in the last cell before a wall,
//! where its gradient would exceed the weight, and pools would circulate.

use super::faces;
use crate::bins::EDGE;
use crate::cpu::constants::Constants;
use crate::cpu::state::CpuState;
use crate::math::real::{Lanes, Real};

/// Farther from a side than any particle whose nodes it holds, in cells.
pub(crate) const FAR: f64 = 1e6;

/// How far off the nodes a side or a face may be to count as going through them, in cells. Particles are kept a
/// [`CLEARANCE`](super::matter::CLEARANCE) away from it.
pub(crate) const ON_NODES: f64 = 0.01;

/// The nodes along the axes that the domain's sides go through; [`FAR`] away where they are open, or upper ones between
/// nodes. The fourth entry is of no axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Walls<R> {
    lo: [R; 4],
    hi: [R; 4],
    /// Whether particles may lie before faces of bodies.
    pub faces: bool,
    /// Whether they may be so near to a side that they see less.
    sides: bool,
}

impl<R: Real> Walls<R> {
    /// Those of a world; far away where nothing is to be made up for.
    pub fn of(s: &CpuState<R>) -> Self {
        let walls = if s.features.walls { Self::of_domain(&s.constants) } else { Self::far() };
        Walls { faces: s.features.faces, ..walls }
    }

    fn far() -> Self {
        Walls { lo: [R::of(-FAR); 4], hi: [R::of(FAR); 4], faces: false, sides: true }
    }

    fn of_domain(constants: &Constants<R>) -> Self {
        let mut walls = Self::far();
        for a in 0..3 {
            let open = constants.open_sides >> (2 * a);
            let [lo, hi] = [constants.lo[a], constants.hi[a]].map(faces::node);
            if open & 1 == 0 {
                walls.lo[a] = lo;
            }
            if open & 2 == 0 && (hi - constants.hi[a]).abs() <= R::of(ON_NODES) {
                walls.hi[a] = hi;
            }
        }
        walls
    }

    /// These, where particles of the block of cells from `origin` on may be so near that they see less.
    #[inline(always)]
    pub fn beside(&self, origin: [u32; 3]) -> Option<Self> {
        let first = origin.map(|c| R::of(f64::from(c)));
        let beyond = R::of(EDGE as f64 + 1.0);
        let sides = (0..3).any(|a| first[a] < self.lo[a] || first[a] + beyond > self.hi[a]);
        (self.faces || sides).then_some(Walls { sides, ..*self })
    }

    /// The factors along the axes for a particle, whose fourth entry is of no axis, given what is noted `beside` its
    /// material.
    #[inline(always)]
    pub fn factors(&self, position: [R; 4], beside: R) -> [R; 3] {
        let noted = self.faces && R::of(0.0) < beside;
        if !noted && !self.sides {
            return [R::of(1.0); 3];
        }
        let away = Self::away(R::V::from4(position), R::V::from4(self.lo), R::V::from4(self.hi));
        let away = self.before_faces(noted, away, [0, 1, 2, 2].map(|a| (a, position[a], beside)));
        let [x, y, z, _] = factors::<R>(away).to4();
        [x, y, z]
    }

    /// The factors along one axis for particles at these places, given what is noted `beside` their materials.
    #[inline(always)]
    pub fn along(&self, axis: usize, x: R::V, beside: R::V) -> R::V {
        let noted = self.faces && R::V::all(R::of(0.0)).below(beside).any();
        if !noted && !self.sides {
            return R::V::all(R::of(1.0));
        }
        let away = Self::away(x, R::V::all(self.lo[axis]), R::V::all(self.hi[axis]));
        let (x, beside) = (x.to4(), beside.to4());
        factors::<R>(self.before_faces(noted, away, [0, 1, 2, 3].map(|n| (axis, x[n], beside[n]))))
    }

    /// Distances from the nearer of two sides.
    #[inline(always)]
    fn away(x: R::V, lo: R::V, hi: R::V) -> R::V {
        (x - lo).min(hi - x)
    }

    /// The lesser of these distances and those from faces of bodies, for places along axes, with what is
    /// noted of them.
    #[inline(always)]
    fn before_faces(&self, noted: bool, away: R::V, places: [(usize, R, R); 4]) -> R::V {
        if !noted {
            return away;
        }
        away.min(R::V::from4(places.map(|(axis, x, beside)| faces::distance(axis, x, beside))))
    }
}

/// The factors for a particle; 1 without walls.
#[inline(always)]
pub(super) fn factors_beside<R: Real>(walls: Option<&Walls<R>>, position: [R; 4], beside: R) -> [R; 3] {
    walls.map_or([R::of(1.0); 3], |walls| walls.factors(position, beside))
}

/// The inverse of the share that is seen at a distance from a plane: 2 (½ + d)² (1 − d) at a distance d < ½.
#[inline(always)]
fn factors<R: Real>(away: R::V) -> R::V {
    let [zero, half, one, two] = [0.0, 0.5, 1.0, 2.0].map(|x| R::V::all(R::of(x)));
    let distance = away.max(zero);
    let reach = half + distance;
    distance.below(half).pick(one / (two * reach * reach * (one - distance)), one)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::kernel::Stencil;
    use crate::stages::matter::CLEARANCE;

    /// With the factor, particles before a wall see the whole of a strain across it, as they do in the middle.
    #[test]
    fn a_strain_across_a_wall_is_seen_whole() {
        let closed = Constants { lo: [4.0 + CLEARANCE; 3], hi: [30.0 - CLEARANCE; 3], ..Constants::default() };
        let open = Constants { open_sides: 0b01_10_11, ..closed };
        // The gradient that a particle at `x` gathers of the distance from the wall, kept to nodes that are not held.
        let seen = |x: f64, distance: fn(f64) -> f64| {
            let stencil = Stencil::at([x, 9.0, 9.0, 0.0]);
            let nodes = (0..3).zip(stencil.along(0)).map(|(n, w)| (f64::from(stencil.first[0] + n), w));
            nodes.map(|(node, w)| 4.0 * w * distance(node).max(0.0) * (node - x)).sum::<f64>()
        };
        for step in 0..=40 {
            let away = f64::from(step) * 0.025;
            let factor = |constants, x| Walls::of_domain(&constants).factors([x, x, x, 1.0], 0.0);
            let low = factor(closed, 4.0 + away);
            let high = factor(closed, 30.0 - away);
            assert!((seen(4.0 + away, |node| node - 4.0) * low[0] - 1.0).abs() < 1e-12, "{away}: {low:?}");
            assert!((seen(30.0 - away, |node| 30.0 - node) * high[0] + 1.0).abs() < 1e-12, "{away}: {high:?}");
            // Both sides of x are open, the upper one of y and the lower one of z.
            assert_eq!(factor(open, 4.0 + away), [1.0, low[1], 1.0]);
            assert_eq!(factor(open, 30.0 - away), [1.0, 1.0, high[2]]);
            assert_eq!(factor(Constants { hi: [30.25; 3], ..closed }, 30.25 - away), [1.0; 3]);
        }
    }
}
