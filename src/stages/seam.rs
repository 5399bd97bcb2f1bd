//! Where bodies touch each other, where their faces meet, or where they are so thin that nodes behind them hold what lies before: what holds
//! nodes there besides the normals of bodies, one by one. Twin: `shaders/lib/seam.wgsl`.

use super::contact::{EARLY, Matter};
use crate::cpu::state::ColliderConstants;
use crate::math::kernel::{KERNEL_REACH, share_before};
use crate::math::linear::{dot, scale, sub, transform};
use crate::math::real::{Lanes, Real};
use crate::math::sdf;

/// Up to how much room between two bodies that face each other there is none, in cells: they touch, but for rounding.
pub(crate) const SEAM: f64 = 1e-3;

/// As far before a body nodes that are in another take part in what is between the two, in cells: as far as what lies beside their seam reaches.
pub(crate) const BESIDE_SEAM: f64 = 1.001;

/// Cosine of their normals up to which two bodies face each other there.
pub(crate) const FACING: f64 = -0.5;

/// How far from a box's edges, in cells, nodes are stopped along a normal between those of its faces. By the one or the other, as rounding has it,
/// water moves at 0.4 m/s around edges that are nodes.
pub(crate) const BEVEL: f64 = 0.05;

/// Cosine from which on two normals are those of the same side.
pub(crate) const ALIKE: f64 = 0.99;

/// Up to how many times what there can be of matter before it a node behind a thin box holds nothing else.
pub(crate) const NOTHING_ELSE: f64 = 1.5;

/// The axis along which a box is thinner than kernels reach; none of what is not.
#[inline(always)]
pub(super) fn thin_axis<R: Real>(c: &ColliderConstants<R::V>) -> Option<usize> {
    let half = c.size.map(|lanes| lanes.to4()[0]);
    let others = if half[1] <= half[2] { 1 } else { 2 };
    let axis = if half[0] <= half[others] { 0 } else { others };
    (c.kind == sdf::BOX && half[axis] < R::of(KERNEL_REACH)).then_some(axis)
}

/// Nodes that hold, behind a body thinner than kernels reach, matter that lies before it.
pub(super) struct Behind<T> {
    /// Which these are.
    at: T,
    /// Away from the body.
    normal: [T; 3],
}

/// Motions relative to a body, none of them away from it of nodes `behind` it, and which have changed.
#[inline(always)]
pub(super) fn stay<R: Real>(behind: &Behind<R::V>, relative: [R::V; 3]) -> ([R::V; 3], R::V) {
    let leaving = dot(relative, behind.normal);
    let held = behind.at.and(R::V::all(R::of(0.0)).below(leaving));
    let kept = sub(relative, scale(behind.normal, leaving));
    ([0, 1, 2].map(|a| held.pick(kept[a], relative[a])), held)
}

/// Which nodes hold, behind a box that is thinner than kernels reach, matter that lies before it: inside the box but nearer to the face behind, or
/// outside with no more than can be of what is before. Nothing would stop them from moving away from the box, and the pressure of what lies before
/// it would throw them about.
#[inline(always)]
pub(super) fn behind_thin<R: Real>(
    c: &ColliderConstants<R::V>,
    p: [R::V; 3],
    distance: R::V,
    matter: &Matter<R::V>,
) -> Option<Behind<R::V>> {
    let all = |x: f64| R::V::all(R::of(x));
    let axis = thin_axis::<R>(c)?;
    let outside = p[axis].abs() - c.size[axis];
    let far = p[axis].abs() + c.size[axis];
    let beside = [0, 1, 2].map(|a| if a == axis { all(0.0) } else { p[a].abs() - c.size[a] });
    let over =
        beside[0].max(beside[1]).max(beside[2]).at_most(all(0.0)).and(far.below(all(KERNEL_REACH))).and(matter.parts);
    // But for rounding, which need not be that of the distance.
    let nearest = distance.at_most(outside + all(SEAM));
    let alone = holds_nothing_else::<R>(far, matter).and(distance.at_most(all(BESIDE_SEAM)));
    let at = over.and(outside.below(all(0.0)).pick(nearest, alone));
    let mut normal = [all(0.0); 3];
    normal[axis] = p[axis].below(all(0.0)).pick(all(-1.0), all(1.0));
    at.any().then(|| Behind { at, normal: transform(&c.axes, normal) })
}

/// Which nodes hold no more than can be of what lies before a face that is so `far`.
#[inline(always)]
fn holds_nothing_else<R: Real>(far: R::V, matter: &Matter<R::V>) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    let share = all(1.0) - share_before::<R>(far);
    matter.fill.at_most(share * all(NOTHING_ELSE))
}

/// The same of a mesh, in whose frame nodes are at `p` before this surface: the face before lies as far through it as a point there, where kernels
/// end, is outside.
#[inline(always)]
pub(super) fn behind_thin_mesh<R: Real>(
    c: &ColliderConstants<R::V>,
    p: [R::V; 3],
    distance: R::V,
    normal: [R::V; 3],
    matter: &Matter<R::V>,
) -> Option<Behind<R::V>> {
    let all = |x: f64| R::V::all(R::of(x));
    let near = distance.at_most(all(BESIDE_SEAM)).and(matter.parts);
    if !near.any() {
        return None;
    }
    let through = sub(p, scale(normal, all(KERNEL_REACH)));
    let (beyond, _) = sdf::distance_normal::<R>(c.kind, c.size, c.grid.as_deref(), through);
    let far = all(KERNEL_REACH) - beyond;
    let alone = holds_nothing_else::<R>(far, matter);
    let at = near.and(far.below(all(KERNEL_REACH))).and(distance.below(all(0.0)).pick(near, alone));
    at.any().then(|| Behind { at, normal: transform(&c.axes, normal) })
}

/// A surface at nodes; a normal of 0 where there is none.
#[derive(Clone, Copy)]
pub(super) struct Surface<T> {
    pub distance: T,
    pub normal: [T; 3],
    /// Up to how much room between it and another there is none, in cells.
    pub slack: T,
}

/// The bodies that nodes lie in, or on.
pub(super) struct Within<T> {
    /// The last and the one before.
    surfaces: [Surface<T>; 2],
    /// How much of what is around them bodies fill, as far as is known: half by one on whose face they lie, a quarter by one at whose edge.
    filled: T,
    /// Which nodes are at a seam.
    pub between: T,
    /// Whether bodies are looked at for the first time.
    pub first: bool,
    /// Whether any of the nodes is in a body.
    any: bool,
}

impl<T: Copy> Within<T> {
    /// Before any is looked at.
    pub fn none(zero: T) -> Self {
        let none = Surface { distance: zero, normal: [zero; 3], slack: zero };
        Within { surfaces: [none; 2], filled: zero, between: zero, first: true, any: false }
    }
}

/// Which nodes have been found in, or beside, more than one body: what one does to them depends on what is known of others.
#[inline(always)]
pub(super) fn in_several<R: Real>(within: &Within<R::V>) -> R::V {
    let normal = within.surfaces[1].normal;
    within.between.pick(within.between, R::V::all(R::of(0.0)).below(dot(normal, normal)))
}

/// Nodes at the seam of two bodies.
#[derive(Clone, Copy)]
pub(super) struct Seam<T> {
    /// Which these are.
    pub between: T,
    /// Which of them have bodies all around.
    pub enclosed: T,
}

/// The normal along which a body stops nodes that are near: of a box, at its edges, between those of the faces that meet there; but its own where
/// nodes lie in, or on, another body too, as along a normal that is neither's they would creep into the corner between the two.
#[inline(always)]
pub(super) fn node_normal<R: Real>(
    c: &ColliderConstants<R::V>,
    p: [R::V; 3],
    distance: R::V,
    normal: [R::V; 3],
    within: &Within<R::V>,
) -> [R::V; 3] {
    let all = |x: f64| R::V::all(R::of(x));
    let near = distance.below(all(EARLY));
    if c.kind != sdf::BOX || !near.any() {
        return normal;
    }
    let [x, y, z] = c.size;
    let bevel = all(BEVEL).min(x.min(y).min(z));
    let inner = c.size.map(|half| half - bevel);
    let [x, y, z] = [0, 1, 2].map(|a| p[a].abs() - inner[a]);
    // Beyond two of the faces that lie that much farther in.
    let edge = near.and(all(0.0).below(x.min(y).max(x.max(y).min(z))));
    if !edge.any() {
        return normal;
    }
    let (_, between) = sdf::distance_normal::<R>(c.kind, inner, None, p);
    let between = transform(&c.axes, between);
    let [last, before] = within.surfaces.map(|other| {
        let there = all(0.0).below(dot(other.normal, other.normal));
        there.and(dot(normal, other.normal).below(all(ALIKE)))
    });
    [0, 1, 2].map(|a| edge.pick(last.pick(normal[a], before.pick(normal[a], between[a])), normal[a]))
}

/// Which nodes lie at the seam of a body, whose surface this is, and one that they are `within`, which touch: there is no room, and what pressed
/// into it would run along it, as each holds nodes along its normal alone. `None` where they are in none. `fills` says how much of what is around
/// nodes in it, or on its face, the body fills.
#[inline(always)]
pub(super) fn seam<R: Real>(
    surface: Surface<R::V>,
    within: &mut Within<R::V>,
    fills: impl FnOnce() -> R::V,
) -> Option<Seam<R::V>> {
    let all = |x: f64| R::V::all(R::of(x));
    let Surface { distance, normal, slack } = surface;
    let inside = distance.at_most(slack);
    within.any |= inside.any();
    if !within.any {
        return None;
    }
    let touches = |other: &Surface<R::V>| {
        let facing = dot(normal, other.normal).below(all(FACING));
        facing.and((distance + other.distance).abs().at_most(slack.max(other.slack)))
    };
    let [last, before] = within.surfaces;
    let [touches_last, touches_before] = [touches(&last), touches(&before)];
    let between = touches_last.pick(touches_last, touches_before).and(distance.at_most(all(BESIDE_SEAM)));
    within.between = between.pick(between, within.between);
    if within.first && inside.any() {
        within.filled += inside.pick(fills(), all(0.0));
    }
    let enclosed = between.and(all(1.0).at_most(within.filled));
    let pick = |new: Surface<R::V>, old: Surface<R::V>| Surface {
        distance: inside.pick(new.distance, old.distance),
        normal: [0, 1, 2].map(|a| inside.pick(new.normal[a], old.normal[a])),
        slack: inside.pick(new.slack, old.slack),
    };
    within.surfaces = [pick(surface, last), pick(last, before)];
    Some(Seam { between, enclosed })
}

/// How much of what is around nodes in a convex body, or on its face, it fills: of one without edges, and at an edge.
#[inline(always)]
pub(super) fn fills<R: Real>(c: &ColliderConstants<R::V>, p: [R::V; 3], distance: R::V) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    if sdf::walls(c.kind) < 2 {
        return distance.below(all(-SEAM)).pick(all(1.0), all(0.5));
    }
    let mut fills = all(1.0);
    for side in 0..sdf::walls(c.kind) {
        let (depth, _) = sdf::wall_distance_normal::<R>(c.kind, side, c.size, p);
        fills = fills * depth.at_most(all(SEAM)).pick(all(0.5), all(1.0));
    }
    fills
}
