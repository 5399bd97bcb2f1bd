//! How nodes are held beyond the bodies' own normals: where bodies touch, where faces of a box meet, and where bodies
//! are so thin that nodes behind them hold matter that lies before them. Twin: `shaders/lib/seam.wgsl`.

use super::gap::{FACE_ON, FAR};
use super::matter::{EARLY, Matter};
use crate::cpu::constants::ColliderConstants;
use crate::math::kernel::{KERNEL_REACH, share_before};
use crate::math::linear::{dot, scale, sub, transform, transform_transposed};
use crate::math::real::{Lanes, Real};
use crate::math::sdf;

/// Largest gap between two bodies that face each other at which they count as touching, in cells: rounding.
pub(crate) const SEAM: f64 = 1e-3;

/// Distance before a body up to which nodes that are in another take part in the seam between both, in cells: the nodes
/// beside the seam are that near.
pub(crate) const BESIDE_SEAM: f64 = 1.001;

/// Cosine of the angle between their normals up to which two bodies face each other.
pub(crate) const FACING: f64 = -0.5;

/// Distance from a box's edges, in cells, within which nodes are stopped along a normal between those of its faces. If
/// rounding chose between the faces' normals, water would move at 0.4 m/s around edges that are nodes.
pub(crate) const BEVEL: f64 = 0.05;

/// Cosine from which two normals count as those of the same side.
pub(crate) const ALIKE: f64 = 0.99;

/// Least square of what other bodies leave of the normal between a box's faces.
pub(crate) const LEAST_LEFT: f64 = 0.01;

/// A node behind a thin box holds nothing else if it holds at most this many times the matter that can lie before the
/// box within its kernel.
pub(crate) const NOTHING_ELSE: f64 = 1.5;

/// The axis along which a box is thinner than the reach of kernels; `None` for other bodies.
#[inline(always)]
pub(super) fn thin_axis<R: Real>(c: &ColliderConstants<R::V>) -> Option<usize> {
    let half = c.size.map(|lanes| lanes.to4()[0]);
    let others = if half[1] <= half[2] { 1 } else { 2 };
    let axis = if half[0] <= half[others] { 0 } else { others };
    (c.kind == sdf::BOX && half[axis] < R::of(KERNEL_REACH)).then_some(axis)
}

/// Nodes behind a body thinner than the reach of kernels that hold matter that lies before it.
pub(super) struct Behind<T> {
    /// Which nodes these are.
    at: T,
    /// The direction away from the body.
    normal: [T; 3],
}

/// Motions relative to a body, without any motion away from it for nodes `behind` it; and which of them have changed.
#[inline(always)]
pub(super) fn stay<R: Real>(behind: &Behind<R::V>, relative: [R::V; 3]) -> ([R::V; 3], R::V) {
    let leaving = dot(relative, behind.normal);
    let held = behind.at.and(R::V::all(R::of(0.0)).below(leaving));
    let kept = sub(relative, scale(behind.normal, leaving));
    ([0, 1, 2].map(|a| held.pick(kept[a], relative[a])), held)
}

/// Which nodes behind a box thinner than the reach of kernels hold matter that lies before it: those inside the box but
/// nearer to the face behind, and those outside that hold no more than can come from before the box. Otherwise nothing
/// would stop them from moving away from the box, and the pressure of the matter before it would throw them about.
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
    // Up to rounding, which may differ from that of the distance.
    let nearest = distance.at_most(outside + all(SEAM));
    let alone = holds_nothing_else::<R>(far, matter).and(distance.at_most(all(BESIDE_SEAM)));
    let at = over.and(outside.below(all(0.0)).pick(nearest, alone));
    let mut normal = [all(0.0); 3];
    normal[axis] = p[axis].below(all(0.0)).pick(all(-1.0), all(1.0));
    at.any().then(|| Behind { at, normal: transform(&c.axes, normal) })
}

/// Which nodes hold no more than can come from matter before a face at the distance `far`.
#[inline(always)]
fn holds_nothing_else<R: Real>(far: R::V, matter: &Matter<R::V>) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    let share = all(1.0) - share_before::<R>(far);
    matter.fill.at_most(share * all(NOTHING_ELSE))
}

/// The same for a mesh, with nodes at `p` in its frame before this surface. A point as far through the part as kernels
/// reach is outside again by some distance; the face before is nearer by that distance.
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

/// A surface at nodes; the normal is 0 if there is none.
#[derive(Clone, Copy)]
pub(super) struct Surface<T> {
    pub distance: T,
    pub normal: [T; 3],
    /// Largest gap to another surface at which the two count as touching, in cells.
    pub slack: T,
}

/// The bodies that nodes lie in or on.
pub(super) struct Within<T> {
    /// The last one and the one before.
    surfaces: [Surface<T>; 2],
    /// The share of the nodes' surroundings that bodies are known to fill: half for a body on whose face they lie, a
    /// quarter for one at whose edge.
    filled: T,
    /// Which nodes are at a seam.
    pub between: T,
    /// Whether this is the first visit to the bodies.
    pub first: bool,
    /// Whether any of the nodes is in a body.
    any: bool,
}

impl<T: Copy> Within<T> {
    /// Before any body is visited.
    pub fn none(zero: T) -> Self {
        let none = Surface { distance: zero, normal: [zero; 3], slack: zero };
        Within { surfaces: [none; 2], filled: zero, between: zero, first: true, any: false }
    }
}

/// Which nodes have been found in or beside more than one body: the effect of one body on them depends on what is known
/// of the others.
#[inline(always)]
pub(super) fn in_several<R: Real>(within: &Within<R::V>) -> R::V {
    let normal = within.surfaces[1].normal;
    within.between.pick(within.between, R::V::all(R::of(0.0)).below(dot(normal, normal)))
}

/// Nodes at the seam of two bodies.
#[derive(Clone, Copy)]
pub(super) struct Seam<T> {
    /// Which nodes these are.
    pub between: T,
    /// Which of them are enclosed by bodies on all sides.
    pub enclosed: T,
}

/// How a body stops nearby nodes.
pub(super) struct Side<T> {
    /// Along which normal.
    pub normal: [T; 3],
    /// By which normal other bodies face it there: on an edge that between its faces, as none is the nearest.
    pub seen: [T; 3],
    /// By how much they may come nearer than they otherwise might: those beyond two faces of a box, on their way around
    /// its edge.
    pub around: T,
}

/// At the edges of a box the normal lies between those of the faces that meet there, or is that of the face before
/// which solids lie: along one in between, a block on a ledge would slide off. Nodes that also lie in or on another body
/// would creep into the corner between both bodies along an intermediate one: on the edge it loses its part against the
/// other body, and beside it the exact normal stays. `relative` is the nodes' motion relative to the body.
#[inline(always)]
pub(super) fn node_side<R: Real>(
    c: &ColliderConstants<R::V>,
    p: [R::V; 3],
    distance: R::V,
    normal: [R::V; 3],
    matter: &Matter<R::V>,
    within: &Within<R::V>,
    relative: [R::V; 3],
) -> Side<R::V> {
    let all = |x: f64| R::V::all(R::of(x));
    let near = distance.below(all(EARLY));
    let plain = Side { normal, seen: normal, around: all(0.0) };
    if c.kind != sdf::BOX || !near.any() {
        return plain;
    }
    let [x, y, z] = c.size;
    let bevel = all(BEVEL).min(x.min(y).min(z));
    let inner = c.size.map(|half| half - bevel);
    let beyond = [0, 1, 2].map(|a| p[a].abs() - inner[a]);
    // Beyond two of the faces of a box whose faces lie farther in by the bevel.
    let [x, y, z] = beyond;
    let past = x.min(y).max(x.max(y).min(z));
    let edge = near.and(all(0.0).below(past));
    if !edge.any() {
        return plain;
    }
    let on_edge = edge.and(distance.at_most(all(BEVEL)));
    let held = on_edge.and(matter.axis.below(all(3.0)));
    let (faced, face) = if held.any() { before_face::<R>(c, p, beyond, held, matter.axis) } else { (held, normal) };
    let (_, between) = sdf::distance_normal::<R>(c.kind, inner, None, p);
    let open = edge.and(bevel.below(past)).and(matter.parts);
    let mut around = all(0.0);
    if open.any() {
        let way = transform_transposed(&c.axes, relative);
        around = open.pick((way_around::<R>(p, beyond, between, way) - matter.at_rest).max(around), around);
    }
    let between = transform(&c.axes, between);
    let [last, before] = within.surfaces.map(|other| {
        let there = all(0.0).below(dot(other.normal, other.normal));
        there.and(dot(normal, other.normal).below(all(ALIKE)))
    });
    let beside = [0, 1, 2].map(|a| last.pick(normal[a], before.pick(normal[a], between[a])));
    let cleared = if on_edge.any() { cleared::<R>(between, within, normal) } else { normal };
    let seen = [0, 1, 2].map(|a| on_edge.pick(cleared[a], normal[a]));
    Side {
        normal: [0, 1, 2].map(|a| edge.pick(faced.pick(face[a], on_edge.pick(cleared[a], beside[a])), normal[a])),
        seen,
        around: last.pick(all(0.0), before.pick(all(0.0), around)),
    }
}

/// The normal `between` a box's faces without its part against other bodies that nodes on the edge lie in or on; the
/// `exact` one where that leaves nothing.
#[inline(always)]
fn cleared<R: Real>(between: [R::V; 3], within: &Within<R::V>, exact: [R::V; 3]) -> [R::V; 3] {
    let all = |x: f64| R::V::all(R::of(x));
    let rest = within.surfaces.iter().fold(between, |rest, other| {
        let against = dot(rest, other.normal).min(all(0.0));
        sub(rest, scale(other.normal, against))
    });
    let square = dot(rest, rest);
    let inv = all(1.0) / square.max(all(LEAST_LEFT)).sqrt();
    [0, 1, 2].map(|a| square.below(all(LEAST_LEFT)).pick(exact[a], rest[a] * inv))
}

/// By how much the motion `way` of nodes, which are `beyond` some of a box's faces, nears them to its edge, against the
/// normal `between` those faces, if it is without what moves them towards all of these faces.
#[inline(always)]
fn way_around<R: Real>(p: [R::V; 3], beyond: [R::V; 3], between: [R::V; 3], way: [R::V; 3]) -> R::V {
    let zero = R::V::all(R::of(0.0));
    let faces = beyond.map(|beyond| zero.below(beyond));
    let outward = [0, 1, 2].map(|a| p[a].below(zero).pick(zero - way[a], way[a]));
    let [x, y, z] = [0, 1, 2].map(|a| faces[a].pick(outward[a], R::V::all(R::of(-FAR))));
    let to_all = x.max(y).max(z).min(zero);
    let [x, y, z] = [0, 1, 2].map(|a| faces[a].pick((to_all - outward[a]) * between[a].abs(), zero));
    x + y + z
}

/// Which of the nodes `on_edge` of a box hold solids that lie squarely before one of the faces that meet there, which
/// they are `beyond`, along an `axis` of the world; and that face's normal.
#[inline(always)]
fn before_face<R: Real>(
    c: &ColliderConstants<R::V>,
    p: [R::V; 3],
    beyond: [R::V; 3],
    on_edge: R::V,
    axis: R::V,
) -> (R::V, [R::V; 3]) {
    let all = |x: f64| R::V::all(R::of(x));
    let zero = all(0.0);
    let [first, second, third] = [0.0, 1.0, 2.0].map(|a| axis.at_most(all(a)));
    let mut faced = zero.below(zero);
    let normal = [0, 1, 2].map(|k| {
        let [x, y, z] = c.axes[k];
        let along = first.pick(x, second.pick(y, third.pick(z, zero))).abs();
        let this = on_edge.and(zero.below(beyond[k])).and(all(FACE_ON).at_most(along));
        faced = this.pick(this, faced);
        this.pick(p[k].below(zero).pick(all(-1.0), all(1.0)), zero)
    });
    (faced, transform(&c.axes, normal))
}

/// Which nodes lie at the seam of a body, with this surface, and a touching one that they are `within`. There is no
/// room in a seam, and as each body holds nodes along its own normal alone, liquid pressed into it would run along it.
/// `None` where nodes are in neither body. `fills` returns the share of the surroundings of nodes in the body, or on
/// its face, that the body fills.
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

/// The share of the surroundings of nodes in a convex body that it fills: 1, and half of that for each side that they
/// lie on.
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
