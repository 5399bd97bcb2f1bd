//! How points move along bodies given by grids of distances. Twin: `shaders/lib/swept.wgsl`.

use super::contact::{Friction, Resolved, STICKING, STUCK, frame, motion, way_in, way_out};
use super::matter::{Matter, level};
use super::seam::{Behind, SEAM, Surface, Within, behind_thin_mesh, seam, stay};
use crate::cpu::constants::ColliderConstants;
use crate::math::distance_grid::{DistanceGrid, REACH};
use crate::math::linear::{add, dot, scale, sub, transform};
use crate::math::real::{Lanes, Real};
use crate::math::sdf;

/// Largest number of pieces of the way along such a body.
pub const PIECES: usize = 64;
/// Largest gap between a mesh and another body at which they count as touching, in spacings of its grid: the accuracy
/// of its surface near edges.
pub(crate) const ROUGH: f64 = 0.25;
/// How often a point at the end of its way is pushed out of such a body: its distances are not quite those along its
/// normals.
pub const MENDS: usize = 3;

/// Distance and normal at one point.
fn of_grid<R: Real>(grid: &DistanceGrid, kind: u32, p: [R; 3]) -> (R, [R; 3]) {
    let (distance, normal) = grid.distance_normal(p);
    if sdf::is_inverted(kind) { (-distance, normal.map(|c| -c)) } else { (distance, normal) }
}

/// Beside a body given by a grid of distances, which need not be convex, the way of a point relative to the body is
/// walked in pieces.
///
/// A piece is as long as the distance allows without meeting the body, but at least half of the grid's spacing. Where
/// it is that, the rest of the way may go against the normal by no more than the distance, as beside a convex body; and
/// where it ends inside, the point is pushed out. The body has no parts thinner than two spacings, so that this is the
/// side from which it came. A point that needs too many pieces stops on the way. A point that began inside is held at
/// its depth.
///
/// The walk begins at the place `off` other bodies from which the mesh is queried, if there are any. Nodes at a seam
/// with one of these, and nodes behind a thin part, are held as beside other bodies.
#[allow(clippy::too_many_arguments)] // the arguments of `resolve_all`, the grid, and the place of the query
#[inline(never)]
pub(super) fn resolve_swept<R: Real>(
    c: &ColliderConstants<R::V>,
    grid: &DistanceGrid,
    x: [R::V; 3],
    off: Option<[R::V; 3]>,
    u: [R::V; 3],
    friction: Friction,
    node: Option<Matter<R::V>>,
    within: &mut Within<R::V>,
) -> Resolved<R::V> {
    let zero = R::V::all(R::of(0.0));
    let (at, way) = way_in::<R>(c, x, u);
    let from = off.map_or(at, |off| frame(c, off));
    let held = node.as_ref().and_then(|matter| hold::<R>(c, grid, at, from, matter, within));
    let node = node.map(|node| node.map(Lanes::to4));
    let (from, way) = (from.map(Lanes::to4), way.map(Lanes::to4));
    let friction = friction.of::<R>(c);
    let walked = [0, 1, 2, 3].map(|n| {
        let lane = |v: &[[R; 4]; 3]| [v[0][n], v[1][n], v[2][n]];
        walk(grid, c.kind, lane(&from), lane(&way), friction, node.map(|node| node.map(|lanes| lanes[n])))
    });
    let mask = |of: fn(&Walked<R>) -> bool| {
        zero.below(R::V::from4(walked.map(|w| R::of(f64::from(u8::from(w.as_ref().is_some_and(of)))))))
    };
    let (mut touched, mut stuck) = (mask(|_| true), mask(|w| w.stuck));
    let mut u = u;
    if touched.any() {
        let way = [0, 1, 2].map(|a| R::V::from4(walked.map(|w| w.map_or(R::of(0.0), |w| w.way[a]))));
        let kept = way_out::<R>(c, x, way);
        u = [0, 1, 2].map(|a| touched.pick(kept[a], u[a]));
    }
    if let Some(Held { enclosed, behind }) = held {
        let body = motion::<R>(c, x);
        if let Some(behind) = behind {
            let (kept, changed) = stay::<R>(&behind, sub(u, body));
            let kept = add(body, kept);
            u = [0, 1, 2].map(|a| changed.pick(kept[a], u[a]));
            touched = changed.pick(changed, touched);
        }
        u = [0, 1, 2].map(|a| enclosed.pick(body[a], u[a]));
        touched = enclosed.pick(enclosed, touched);
        stuck = enclosed.pick(enclosed, stuck);
    }
    Resolved { u, touched, stuck, more: false }
}

/// Nodes that a mesh holds beyond its normal.
struct Held<T> {
    /// Which are enclosed by bodies.
    enclosed: T,
    /// Which are behind a thin part.
    behind: Option<Behind<T>>,
}

/// Which nodes the mesh holds beyond its normal: they are `at` these places in its frame, and query it `from` these.
#[inline(always)]
fn hold<R: Real>(
    c: &ColliderConstants<R::V>,
    grid: &DistanceGrid,
    at: [R::V; 3],
    from: [R::V; 3],
    matter: &Matter<R::V>,
    within: &mut Within<R::V>,
) -> Option<Held<R::V>> {
    let all = |x: f64| R::V::all(R::of(x));
    let of_mesh = |p| sdf::distance_normal::<R>(c.kind, c.size, Some(grid), p);
    let (distance, normal) = of_mesh(at);
    let slack = all((ROUGH * grid.spacing).min(STUCK));
    let surface = Surface { distance, normal: transform(&c.axes, normal), slack };
    let seam = seam::<R>(surface, within, || {
        // At its edge, if the place of the query is.
        let edge = of_mesh(from).0.below(all(-SEAM)).pick(all(1.0), all(0.5));
        distance.below(-slack).pick(edge, edge * all(0.5))
    });
    let enclosed = seam.map(|seam| seam.enclosed).filter(|enclosed| enclosed.any());
    let behind = behind_thin_mesh::<R>(c, at, distance, normal, matter);
    let none = all(0.0).below(all(0.0));
    (enclosed.is_some() || behind.is_some()).then(|| Held { enclosed: enclosed.unwrap_or(none), behind })
}

/// The way of a point that met something.
#[derive(Clone, Copy)]
struct Walked<R> {
    way: [R; 3],
    stuck: bool,
}

/// How far a point gets on its way from `start`, in the body's frame; `None` if nothing is in the way.
fn walk<R: Real>(
    grid: &DistanceGrid,
    kind: u32,
    start: [R; 3],
    way: [R; 3],
    friction: R,
    node: Option<Matter<R>>,
) -> Option<Walked<R>> {
    let (zero, one, reach) = (R::of(0.0), R::of(1.0), R::of(REACH));
    let least = R::of(grid.spacing) * R::of(0.5);
    let (mut at, mut rest) = (start, way);
    let mut left = dot(rest, rest).sqrt();
    let (distance, mut normal) = of_grid(grid, kind, at);
    let level = level::<R>(R::V::all(distance), node.map(|node| node.map(R::V::all))).to4()[0];
    let mut gap = distance - level;
    let sticky = node.is_some() && friction >= R::of(STICKING);
    let slips = node.is_some_and(|node| sticky && node.grips == zero);
    let stuck = node.is_some_and(|node| sticky && distance <= node.sticky);
    let mut touched = stuck;
    if stuck {
        rest = scale(normal, dot(rest, normal).max(-gap));
        left = dot(rest, rest).sqrt();
    }
    for _ in 0..PIECES {
        let mut piece = gap * reach;
        if piece >= left {
            return touched.then(|| Walked { way: sub(add(at, rest), start), stuck });
        }
        if piece < least {
            let along = dot(rest, normal);
            let stopped = -gap - along;
            if stopped > zero {
                let mut tangent = sub(rest, scale(normal, along));
                if friction > zero && !slips {
                    let slip = dot(tangent, tangent).sqrt();
                    let taken = friction * stopped;
                    tangent = scale(tangent, if taken < slip { one - taken / slip } else { zero });
                }
                rest = sub(tangent, scale(normal, gap));
                left = dot(rest, rest).sqrt();
                touched = true;
            }
            piece = least;
        }
        if piece >= left {
            at = add(at, rest);
            left = zero;
            break;
        }
        let part = scale(rest, piece / left);
        at = add(at, part);
        rest = sub(rest, part);
        left -= piece;
        let (distance, outward) = of_grid(grid, kind, at);
        gap = distance - level;
        normal = outward;
        if gap < zero {
            at = sub(at, scale(normal, gap));
            gap = zero;
            touched = true;
        }
    }
    touched |= left > zero;
    for _ in 0..MENDS {
        let (distance, normal) = of_grid(grid, kind, at);
        let gap = distance - level;
        if gap >= zero {
            break;
        }
        at = sub(at, scale(normal, gap));
        touched = true;
    }
    touched.then(|| Walked { way: sub(at, start), stuck })
}
