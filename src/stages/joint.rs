//! Boxes that lie flush beside other bodies. Twin: `shaders/lib/joint.wgsl`.
//!
//! A node or a particle in the joint of two boxes would be stopped by the covered faces of both, or by the edge of the
//! one on its way along the other: the joint would be an obstacle to what moves along their common surface. So beside
//! a covered face and nearer to a flush surface than to others, a box acts only on what lies on its own side of the
//! face, and there as if it went on beyond it.
//!
//! The host finds the joints ([`timeline::joints`](crate::timeline)): a bit for each face that others cover, and one for
//! each edge that bodies beyond it leave free.

use crate::cpu::constants::ColliderConstants;
use crate::math::kernel::KERNEL_REACH;
use crate::math::real::{Lanes, Real};

/// Number of the bit of the first edge; those before are of the faces.
pub(crate) const FIRST_EDGE: u32 = 6;
/// Depth at which a point counts as lying behind a covered face, in cells, or as deep as the box's middle if that is
/// less: deeper than any that another side may hold.
pub(crate) const JOINT_DEPTH: f64 = 4.0;

/// Farther from a face, before or behind it, than any point in question, in cells.
pub(crate) const FAR_BEHIND: f64 = 1e6;

/// Number of the bit of a box's face.
pub(crate) fn face(axis: usize, upper: bool) -> u32 {
    2 * axis as u32 + u32::from(upper)
}

/// Number of the bit of the edge between two faces.
pub(crate) fn edge(a: (usize, bool), b: (usize, bool)) -> u32 {
    let pair = (a.0.min(b.0) + a.0.max(b.0) - 1) as u32;
    let (first, second) = if a.0 < b.0 { (a.1, b.1) } else { (b.1, a.1) };
    FIRST_EDGE + 4 * pair + 2 * u32::from(first) + u32::from(second)
}

/// Points beside the joints of a box.
pub(super) struct Joint<V> {
    /// Where they are in its frame, as far as it is concerned.
    pub at: [V; 3],
    /// Which of them it does not act on.
    pub beyond: V,
}

/// Whether any of the points `at` this place in the frame of a box is as near to a covered face as kernels reach.
#[inline(always)]
pub(super) fn is_beside<R: Real>(c: &ColliderConstants<R::V>, at: [R::V; 3]) -> bool {
    let reach = R::V::all(R::of(KERNEL_REACH));
    let near = |a: usize, outward: R::V| (outward - c.size[a]).abs().at_most(reach).any();
    (0..3).any(|a| {
        let covered = |upper| c.joints >> face(a, upper) & 1 == 1;
        (covered(true) && near(a, at[a])) || (covered(false) && near(a, -at[a]))
    })
}

/// Points that are `at` this place in the frame of a box with joints.
#[inline(never)]
pub(super) fn joint<R: Real>(c: &ColliderConstants<R::V>, at: [R::V; 3]) -> Joint<R::V> {
    let all = |x: f64| R::V::all(R::of(x));
    let zero = all(0.0);
    let none = zero.below(zero);
    let upper = at.map(|x| zero.at_most(x));
    let before = [0, 1, 2].map(|a| at[a].abs() - c.size[a]);
    let bit = |n: u32| if c.joints >> n & 1 == 1 { zero.at_most(zero) } else { none };
    let covered = [0, 1, 2].map(|a| upper[a].pick(bit(face(a, true)), bit(face(a, false))));
    let flush = |a: usize, b: usize| {
        let second = |first| upper[b].pick(bit(edge((a, first), (b, true))), bit(edge((a, first), (b, false))));
        upper[a].pick(second(true), second(false))
    };
    // How far points are before the faces that nothing covers.
    let open = [0, 1, 2].map(|a| covered[a].pick(all(-FAR_BEHIND), before[a]));
    let mut joint = Joint { at, beyond: none };
    for a in 0..3 {
        let [one, other] = [(a + 1) % 3, (a + 2) % 3];
        let nearest = open[one].below(open[other]).pick(flush(a, other), flush(a, one));
        let any_open = all(-FAR_BEHIND).below(open[one].max(open[other]));
        let here = covered[a].and(nearest).and(any_open).and(before[a].abs().at_most(all(KERNEL_REACH)));
        let past = here.and(zero.below(before[a]));
        joint.beyond = past.pick(past, joint.beyond);
        let deep = (c.size[a] - all(JOINT_DEPTH)).max(zero);
        joint.at[a] = here.pick(upper[a].pick(deep, zero - deep), joint.at[a]);
    }
    joint
}
