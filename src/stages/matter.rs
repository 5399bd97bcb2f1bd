//! The matter at a node, and how near to a surface points may come. Twin: `shaders/lib/matter.wgsl`.

use crate::math::kernel::share_near;
use crate::math::real::{Lanes, Real};

/// The matter at nodes.
#[derive(Debug, Clone, Copy)]
pub struct Matter<T> {
    /// Amount of matter, in cells at rest.
    pub fill: T,
    /// How much nearer to a body the node may come before its matter touches, in cells: 0 except for elastic and
    /// viscoplastic matter.
    pub gap: T,
    /// Distance within which it sticks to a body that matter sticks to, in cells.
    pub sticky: T,
    /// Whether it comes apart when pulled (liquid, or sand in worlds without other solids), so that thin boxes may hold
    /// nodes behind them in both directions.
    pub parts: T,
    /// Whether it is viscoplastic.
    pub yields: T,
    /// Whether it sticks, where it is pressed onto a body that matter sticks to, however far out: sand and viscoplastic
    /// matter, which a node carries that is full.
    pub grips: T,
    /// The axis of the world along which it lies squarely before a face of a box that it touches; 3 if it is not solid,
    /// or lies before no face or before several.
    pub axis: T,
    /// The motion that counts as rest beside edges ([`Constants::at_rest`](crate::cpu::constants::Constants::at_rest)).
    pub at_rest: T,
}

impl<T> Matter<T> {
    /// The same with mapped numbers.
    pub(super) fn map<U>(self, f: impl Fn(T) -> U) -> Matter<U> {
        Matter {
            fill: f(self.fill),
            gap: f(self.gap),
            sticky: f(self.sticky),
            parts: f(self.parts),
            yields: f(self.yields),
            grips: f(self.grips),
            axis: f(self.axis),
            at_rest: f(self.at_rest),
        }
    }
}

/// Distance from bodies and from the domain's sides that particles keep, in cells. On the surfaces themselves rounding
/// would let them into the joint of two bodies that abut.
pub const CLEARANCE: f64 = 1e-3;

/// Distance before a surface up to which a node counts as on it, and behind it, in cells: rounding. Bodies hold the nodes
/// on their faces, which often go through nodes.
pub const ON_SURFACE: f64 = 1e-3;

/// Distance from a body below which full nodes come no nearer, in cells: less than that of the first nodes before a
/// wall that goes through nodes.
pub const EARLY: f64 = 0.9;

/// A node is full from this share on of the matter that fits before a surface (`share_near`, which at [`EARLY`] is 3 %
/// below the true share).
pub const FULL: f64 = 0.9;

/// Share of the matter that fits up to which viscoplastic matter may fill a node that comes nearer. It spreads over a
/// smooth floor only if the nodes before it follow: its bulk modulus resists as it would thin out below nodes that are
/// held.
pub const FULLEST: f64 = 1.1;

/// Amount of matter, in cells, above which a node may come nearer all the same, because it needs the room.
pub const CROWDED: f64 = 1.5;

/// Matter slower than after a fall by this many cells counts as at rest beside the edges of boxes.
pub const AT_REST: f64 = 0.01;

/// How near to a surface a point at `distance` may come. A particle may come as near as its [`CLEARANCE`], a node up to
/// the surface, but no nearer than it is if it is full, that is, if the part of its kernel before the surface is filled
/// already, and in viscoplastic matter only by what it lacks to [`FULLEST`] of that. What is nearer than that may come
/// no nearer, and what is inside go no deeper.
///
/// If full nodes could come nearer, liquid would crowd between the last of them and those inside.
#[inline(always)]
pub(super) fn level<R: Real>(distance: R::V, node: Option<Matter<R::V>>) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    let Some(Matter { fill, gap, yields, .. }) = node else { return distance.min(all(CLEARANCE)) };
    let inside = distance.min(all(0.0));
    let open = share_near::<R>(distance);
    let early = fill.at_most(all(CROWDED)).and(distance.below(all(EARLY)));
    let full = (open * all(FULL)).at_most(fill).and(early);
    let mut level = full.pick(distance, inside);
    let yields = yields.and(early);
    if yields.any() {
        let lacks = (open * all(FULLEST) - fill).max(all(0.0));
        level = yields.pick((distance - lacks).max(inside), level);
    }
    level.min(distance - gap)
}
