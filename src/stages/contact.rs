//! Contact with colliders, shared by the grid and the particles; four points at a time. Twin:
//! `shaders/lib/contact.wgsl`.

use super::corner::Stop;
use super::footing::off_others;
use super::joint::{FAR_BEHIND, is_beside, joint};
use super::matter::{CLEARANCE, FULL, Matter, ON_SURFACE, level};
use super::seam::{BESIDE_SEAM, SEAM, Surface, Within, behind_thin, fills, in_several, node_side, seam, stay};
use super::sides::{beside, resolve_sides};
use super::swept::resolve_swept;
use crate::cpu::constants::ColliderConstants;
use crate::math::linear::{Scalar, add, dot, scale, sub, transform, transform_transposed};
use crate::math::real::{Lanes, Real};
use crate::math::sdf;

/// Which friction a contact exerts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Friction {
    /// That of bodies that matter slips along (Coulomb's).
    Rubbing,
    /// Only that of bodies to which matter sticks.
    Sticking,
    /// That of every body.
    Full,
}

/// Coefficient of friction from which matter sticks.
pub const STICKING: f64 = 1e29;

/// Distance from a body within which nodes stick to it, in cells, where viscosity does not determine that.
pub const STUCK: f64 = 0.25;

/// Coefficient from which matter inside moves with the body.
pub const FIXED: f64 = 5e30;

impl Friction {
    /// Coefficient of friction of a body in this contact.
    #[inline(always)]
    pub(super) fn of<R: Real>(self, c: &ColliderConstants<R::V>) -> R {
        let coefficient = c.friction.to4()[0];
        match self {
            Friction::Full => coefficient,
            Friction::Sticking if coefficient >= R::of(STICKING) => coefficient,
            Friction::Rubbing if coefficient < R::of(STICKING) => coefficient,
            _ => R::of(0.0),
        }
    }

    /// Which nodes at this distance from the body do not slip, even where they leave it: for a body that matter sticks
    /// to, those within their [`sticky`](Matter::sticky) distance.
    #[inline(always)]
    fn sticks<R: Real>(self, c: &ColliderConstants<R::V>, distance: R::V, node: Option<Matter<R::V>>) -> Option<R::V> {
        let sticky = node.is_some() && self.of::<R>(c) >= R::of(STICKING);
        node.filter(|_| sticky).map(|node| distance.at_most(node.sticky))
    }

    /// What is left outside a body of a tangential motion, as by [`rubbed`]. Nodes stick by their distance alone
    /// ([`sticks`](Self::sticks)): if those farther out stuck when they press on the body, how far out they are would
    /// determine the thickness of the layer that does not move. But sand and clay would slide on full nodes.
    #[inline(always)]
    fn outside<R: Real>(
        self,
        c: &ColliderConstants<R::V>,
        tangent: [R::V; 3],
        stopped: R::V,
        node: Option<Matter<R::V>>,
    ) -> [R::V; 3] {
        let sticky = node.filter(|_| self.of::<R>(c) >= R::of(STICKING));
        if sticky.is_some_and(|node| !node.grips.any()) {
            return tangent;
        }
        let rubbed = rubbed::<R>(c, tangent, stopped, self);
        sticky.map_or(rubbed, |node| [0, 1, 2].map(|a| node.grips.pick(rubbed[a], tangent[a])))
    }
}

/// Least share of a point's motion that counts as stopped by a second side or body: less is rounding of a motion along
/// it that the first has left.
pub const LEAST_SHARE: f64 = 1e-5;

/// Visits to the colliders, so that motion stopped by one is not directed into another. The second goes only as far as
/// the last body that has changed the motion.
pub const SWEEPS: usize = 2;

/// Distance to the body and its outward normal in the world, for points that are `at` this place in the body's frame.
#[inline(always)]
fn surface<R: Real>(c: &ColliderConstants<R::V>, at: [R::V; 3]) -> (R::V, [R::V; 3]) {
    if c.kind == sdf::HALF_SPACE {
        return (at[1], c.axes[1]);
    }
    let (distance, normal) = sdf::distance_normal::<R>(c.kind, c.size, c.grid.as_deref(), at);
    (distance, transform(&c.axes, normal))
}

/// Where points at `x` are in the body's frame at the start of the step.
#[inline(always)]
pub(super) fn frame<V: Scalar>(c: &ColliderConstants<V>, x: [V; 3]) -> [V; 3] {
    transform_transposed(&c.axes, sub(x, c.position))
}

/// Distance and outward normal at the start of the step.
#[inline(always)]
pub fn distance_normal_before<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3]) -> (R::V, [R::V; 3]) {
    surface::<R>(c, frame(c, x))
}

/// Distance and outward normal at the end of the step.
#[inline(always)]
pub fn distance_normal_after<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3]) -> (R::V, [R::V; 3]) {
    let r = sub(sub(x, c.position), c.shift);
    // (turn + 1) is the step's rotation; its transpose turns back.
    let back = add(transform_transposed(&c.turn, r), r);
    let (distance, normal) = surface::<R>(c, transform_transposed(&c.axes, back));
    (distance, add(transform(&c.turn, normal), normal))
}

/// Displacement of the body's material at `x` in the step.
#[inline(always)]
pub fn motion<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3]) -> [R::V; 3] {
    add(c.shift, transform(&c.turn, sub(x, c.position)))
}

/// Start and displacement, in the frame of the moving body, of points at `x` with the displacement `u`.
#[inline(always)]
pub(super) fn way_in<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3], u: [R::V; 3]) -> ([R::V; 3], [R::V; 3]) {
    let r = sub(x, c.position);
    let start = transform_transposed(&c.axes, r);
    let end = add(r, sub(u, c.shift));
    let end = transform_transposed(&c.axes, add(transform_transposed(&c.turn, end), end));
    (start, sub(end, start))
}

/// The displacement of points at `x` whose displacement in the frame of the body is `way`.
#[inline(always)]
pub(super) fn way_out<R: Real>(c: &ColliderConstants<R::V>, x: [R::V; 3], way: [R::V; 3]) -> [R::V; 3] {
    let way = transform(&c.axes, way);
    add(motion::<R>(c, x), add(transform(&c.turn, way), way))
}

/// The effect of a body on points.
pub struct Resolved<T> {
    /// Their displacements.
    pub u: [T; 3],
    /// Which of them it has changed.
    pub touched: T,
    /// Which of them stick to it.
    pub stuck: T,
    /// Whether the body has stopped them before, and this is what it stops in addition.
    pub more: bool,
}

/// The displacements `u` of points at `x`, kept from entering `near[n]`. `within` describes the bodies that nodes lie
/// in so far.
#[allow(clippy::too_many_arguments)] // the arguments of `resolve_all`, and its state
#[inline(always)]
fn resolve<R: Real>(
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    n: usize,
    x: [R::V; 3],
    u: [R::V; 3],
    friction: Friction,
    node: Option<Matter<R::V>>,
    within: &mut Within<R::V>,
) -> Resolved<R::V> {
    let c = &colliders[near[n].collider];
    match &c.grid {
        _ if c.kind < sdf::GRID => resolve_outside::<R>(c, x, u, friction, node, within),
        Some(grid) => {
            let off = off_others::<R>(colliders, near, n, grid.spacing, x);
            resolve_swept::<R>(c, grid, x, off, u, friction, node, within)
        }
        None => resolve_inside::<R>(c, x, u, friction, node),
    }
}

/// What friction leaves of a tangential motion, where `stopped` was removed from the motion along the normal.
#[inline(always)]
pub(super) fn rubbed<R: Real>(
    c: &ColliderConstants<R::V>,
    tangent: [R::V; 3],
    stopped: R::V,
    friction: Friction,
) -> [R::V; 3] {
    if friction.of::<R>(c) <= R::of(0.0) {
        return tangent;
    }
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let slip = dot(tangent, tangent).sqrt();
    let taken = c.friction * stopped;
    scale(tangent, taken.below(slip).pick(one - taken / slip, zero))
}

/// In a container, a particle may end no nearer to any of the walls than its [`level`], and a node may move no farther
/// along the normal.
///
/// The inside of a wall is convex, so that going back along the normal at the point reached leads to the nearest
/// allowed point: curved walls hold however long the step is, which a bound by the normal at the start would not
/// ensure. Nodes, on which pressure acts, are stopped along the normal at their own place, relative to the container's
/// motion there: a normal turned by the step's motion, the node's or the container's, would brake matter that
/// circulates in a smooth drum. Walls that meet in edges are at right angles there and are handled one by one; by the
/// distance to the edge alone, nodes beyond two walls would be free to move along both.
#[inline(always)]
fn resolve_inside<R: Real>(
    c: &ColliderConstants<R::V>,
    x: [R::V; 3],
    u: [R::V; 3],
    friction: Friction,
    node: Option<Matter<R::V>>,
) -> Resolved<R::V> {
    let zero = R::V::all(R::of(0.0));
    let (start, mut relative) = if node.is_some() {
        let way = transform_transposed(&c.axes, sub(u, motion::<R>(c, x)));
        (frame(c, x), way)
    } else {
        way_in::<R>(c, x, u)
    };
    let (mut touched, mut sticking) = (zero.below(zero), zero.below(zero));
    for wall in 0..sdf::walls(c.kind) {
        let (before, normal) = sdf::wall_distance_normal::<R>(c.kind, wall, c.size, start);
        let (normal, along, after) = if node.is_some() {
            let along = dot(relative, normal);
            (normal, along, before + along)
        } else {
            let (after, normal) = sdf::wall_distance_normal::<R>(c.kind, wall, c.size, add(start, relative));
            (normal, dot(relative, normal), after)
        };
        let level = level::<R>(before, node);
        let stopped = level - after;
        let hit = zero.below(stopped);
        let stuck = friction.sticks::<R>(c, before, node);
        if !hit.any() && stuck.is_none() {
            continue;
        }
        touched = hit.pick(hit, touched);
        let tangent = friction.outside::<R>(c, sub(relative, scale(normal, along)), stopped, node);
        let kept = add(tangent, scale(normal, along + stopped));
        relative = [0, 1, 2].map(|a| hit.pick(kept[a], relative[a]));
        if let Some(stuck) = stuck {
            let leaving = scale(normal, along.max(level - before));
            relative = [0, 1, 2].map(|a| stuck.pick(leaving[a], relative[a]));
            touched = stuck.pick(stuck, touched);
            sticking = stuck.pick(stuck, sticking);
        }
    }
    if !touched.any() {
        return Resolved { u, touched, stuck: sticking, more: false };
    }
    let kept = if node.is_some() {
        add(motion::<R>(c, x), transform(&c.axes, relative))
    } else {
        way_out::<R>(c, x, relative)
    };
    Resolved { u: [0, 1, 2].map(|a| touched.pick(kept[a], u[a])), touched, stuck: sticking, more: false }
}

/// Relative to the body, a point at distance `d` may move against the normal up to its [`level`], nodes on their way
/// around an edge beyond that. The end of the step then lies outside a convex body, however long the step is. The part
/// stopped along the normal bounds the friction.
#[inline(always)]
fn resolve_outside<R: Real>(
    c: &ColliderConstants<R::V>,
    x: [R::V; 3],
    u: [R::V; 3],
    friction: Friction,
    node: Option<Matter<R::V>>,
    within: &mut Within<R::V>,
) -> Resolved<R::V> {
    let zero = R::V::all(R::of(0.0));
    let mut at = frame(c, x);
    let mut beyond = None;
    if c.joints != 0 && is_beside::<R>(c, at) {
        let beside = joint::<R>(c, at);
        (at, beyond) = (beside.at, Some(beside.beyond));
    }
    let (mut distance, mut normal) = surface::<R>(c, at);
    if let Some(beyond) = beyond {
        distance = beyond.pick(R::V::all(R::of(FAR_BEHIND)), distance);
    }
    let body = motion::<R>(c, x);
    if friction.of::<R>(c) >= R::of(FIXED) {
        let inside = distance.at_most(R::V::all(R::of(ON_SURFACE)));
        return Resolved {
            u: [0, 1, 2].map(|a| inside.pick(body[a], u[a])),
            touched: inside,
            stuck: inside,
            more: false,
        };
    }
    let relative = sub(u, body);
    let (mut sides, mut behind) = (None, None);
    let mut level = level::<R>(distance, node);
    // Written out, since what closures call is not compiled for wide vectors.
    if let Some(matter) = &node {
        let side = node_side::<R>(c, at, distance, normal, matter, within, relative);
        normal = side.normal;
        level = (level - side.around).max(level.min(zero));
        let surface = Surface { distance, normal: side.seen, slack: R::V::all(R::of(SEAM)) };
        if let Some(seam) = seam::<R>(surface, within, || fills::<R>(c, at, distance)) {
            sides = beside::<R>(c, at, distance, seam);
        }
        behind = behind_thin::<R>(c, at, distance, matter);
    }
    let along = dot(relative, normal);
    let gap = distance - level;
    let stopped = -gap - along;
    let mut touched = zero.below(stopped);
    let stuck = friction.sticks::<R>(c, distance, node);
    if !touched.any() && stuck.is_none() && sides.is_none() && behind.is_none() {
        return Resolved { u, touched, stuck: touched, more: false };
    }
    let tangent = friction.outside::<R>(c, sub(relative, scale(normal, along)), stopped, node);
    let kept = sub(tangent, scale(normal, gap));
    let mut relative = [0, 1, 2].map(|a| touched.pick(kept[a], relative[a]));
    if let Some(stuck) = stuck {
        let leaving = scale(normal, along.max(-gap));
        relative = [0, 1, 2].map(|a| stuck.pick(leaving[a], relative[a]));
        touched = stuck.pick(stuck, touched);
    }
    let mut stuck = stuck.unwrap_or_else(|| zero.below(zero));
    if let Some(sides) = sides {
        let held = resolve_sides::<R>(c, &sides, gap, relative, friction);
        touched = held.touched.pick(held.touched, touched);
        stuck = held.stuck.pick(held.stuck, stuck);
        relative = [0, 1, 2].map(|a| held.touched.pick(held.u[a], relative[a]));
    }
    if let Some(behind) = behind {
        let (kept, held) = stay::<R>(&behind, relative);
        (relative, touched) = (kept, held.pick(held, touched));
    }
    if !touched.any() {
        return Resolved { u, touched, stuck, more: false };
    }
    let kept = add(body, relative);
    Resolved { u: [0, 1, 2].map(|a| touched.pick(kept[a], u[a])), touched, stuck, more: false }
}

/// A collider that can be touched from a block, with a lower bound of its distance there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near<R: Real> {
    pub collider: usize,
    /// Slope of the tangent to the distance at the block's middle. The distance to a convex body is a convex function,
    /// so it is nowhere below its tangents. The distance to the wall around a container, or from a mesh, is not convex;
    /// there the slope is zero, and the bound, valid for points of the block only, follows from how distances change
    /// along a path.
    pub slope: [R::V; 3],
    pub offset: R::V,
    /// The largest displacement of the body's material in the block.
    pub own: R::V,
    /// The most by which bodies in reach of the block can make points faster.
    pub gained: R::V,
    /// Whether a point's end alone decides if it can be inside the collider: the collider stands still, and the bound
    /// holds everywhere.
    pub by_end: bool,
    /// Whether it may be so thin that nodes behind it hold matter that lies before it.
    pub thin: bool,
}

impl<R: Real> Near<R> {
    /// Whether any of the points at `x` is as near as `reach` when the step begins.
    #[inline(always)]
    pub fn within(&self, x: [R::V; 3], reach: R::V) -> bool {
        (dot(self.slope, x) + self.offset).at_most(reach).any()
    }

    /// Whether any of the points at `x` that move at most `speed` can touch the collider.
    #[inline(always)]
    pub fn reaches(&self, x: [R::V; 3], speed: R::V) -> bool {
        self.within(x, speed + self.own)
    }

    /// Whether any of the points that move at most `speed` from `x` to `to` can end inside the collider.
    #[inline(always)]
    pub fn holds(&self, x: [R::V; 3], speed: R::V, to: [R::V; 3]) -> bool {
        if self.by_end { self.reaches(to, R::V::all(R::of(0.0))) } else { self.reaches(x, speed + self.gained) }
    }
}

/// Distance up to which bodies act on points at `x` that do not move towards them: particles keep their [`CLEARANCE`],
/// nodes may stick, and those that may be full, at a seam or behind a thin body may also be held.
#[inline(always)]
fn ahead<R: Real>(near: &[Near<R>], x: [R::V; 3], node: Option<Matter<R::V>>) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    let Some(Matter { fill, parts, .. }) = node else { return all(CLEARANCE) };
    let held = |near: &Near<R>| near.within(x, all(if near.thin && parts.any() { BESIDE_SEAM } else { SEAM }));
    // Half of the kernel of a node on a surface lies before it.
    if all(0.5 * FULL).at_most(fill).any() || near.iter().any(held) { all(BESIDE_SEAM) } else { all(STUCK) }
}

/// `u` kept out of all of `near`. `node` is the matter at the points if these are nodes. `note` is called with the
/// index of each body that touches the points, their motion before and its effect on them.
#[inline(always)]
pub fn resolve_all<R: Real>(
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    x: [R::V; 3],
    mut u: [R::V; 3],
    friction: Friction,
    node: Option<Matter<R::V>>,
    mut note: impl FnMut(usize, [R::V; 3], &Resolved<R::V>),
) -> [R::V; 3] {
    let ahead = ahead(near, x, node);
    let mut speed = dot(u, u).sqrt() + ahead;
    let none = R::V::all(R::of(0.0));
    let mut within = Within::none(none);
    // Which points are still visited. As if taken one by one, points that nothing has touched and that are at no seam
    // are done.
    let mut going = none.at_most(none);
    // Which body was the last to touch them.
    let mut last = R::V::all(R::of(-1.0));
    let (all_near, mut first) = (near, Stop::<R>::none());
    for sweep in 0..SWEEPS {
        let mut again = none;
        for (n, near) in near.iter().enumerate() {
            if sweep > 0 {
                let n = R::V::all(R::of(n as f64));
                let unchanged = last.at_most(n).and(n.at_most(last));
                going = in_several::<R>(&within).pick(going, unchanged.pick(none, going));
                if !going.any() {
                    break;
                }
            }
            if !near.reaches(x, speed) {
                continue;
            }
            let collider = &colliders[near.collider];
            let mut resolved = resolve::<R>(colliders, all_near, n, x, u, friction, node, &mut within);
            if sweep > 0 && resolved.touched.any() {
                resolved.touched = resolved.touched.and(going);
                resolved.stuck = resolved.stuck.and(going);
                resolved.u = [0, 1, 2].map(|a| going.pick(resolved.u[a], u[a]));
            }
            if resolved.touched.any() {
                again = resolved.touched.pick(resolved.touched, again);
                // Points are pushed out of a mesh piece by piece, so that one visit may not suffice.
                let done = if collider.grid.is_some() { -1.0 } else { n as f64 };
                last = resolved.touched.pick(R::V::all(R::of(done)), last);
                let mut after = resolved.u;
                // Points are pushed out of a mesh piece by piece, each along its own normal.
                let straight = friction.of::<R>(collider) <= R::of(0.0) && !sdf::is_grid(collider.kind);
                if node.is_some()
                    && straight
                    && let Some(corner) = first.meet(n, u, &mut resolved)
                {
                    after = corner.left;
                    for (n, near) in all_near.iter().enumerate() {
                        if let Some(more) = corner.by_first(n, u) {
                            note(near.collider, u, &more);
                        }
                    }
                }
                note(near.collider, u, &resolved);
                u = after;
                speed = dot(u, u).sqrt() + ahead;
            }
        }
        again = within.between.pick(within.between, again);
        if !again.any() {
            break;
        }
        within.first = false;
        going = again;
    }
    u
}
