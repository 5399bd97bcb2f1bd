//! Joints: faces of boxes that other bodies cover, and where these lie flush beside them. Bodies have joints with those
//! that move as they do without turning; those of bodies at rest are found once.

use super::ColliderInput;
use crate::math::kernel::KERNEL_REACH;
use crate::math::real::{Lanes, Real};
use crate::math::sdf::{self, BOX, GRID, HALF_SPACE};
use crate::stages::joint::{edge, face};
use glam::{DMat3, DVec3};

/// How far before a face other bodies have to hold it, in cells: right before it, and as far as kernels reach.
const BEFORE: [f64; 2] = [1e-2, KERNEL_REACH];

/// Largest gap, in cells, at which a point counts as in a body.
const GAP: f64 = 1e-3;

/// Length, in cells, below which parts of a face are not divided further: the joint of two bodies before it goes through
/// such parts.
const FINEST: f64 = 0.25;

/// The most points that are examined for a face, after which it counts as not covered.
const MOST_POINTS: u32 = 4_000;

/// Where along an edge it is examined whether bodies lie flush.
const ALONG: [f64; 5] = [-0.9, -0.45, 0.0, 0.45, 0.9];

/// The joints of bodies at rest, which remain until one of them is moved.
#[derive(Debug, Clone, Default)]
pub(crate) struct Joints {
    /// Where the bodies are that are at rest.
    at: Vec<Option<(DVec3, DMat3)>>,
    joints: Vec<u32>,
}

impl Joints {
    /// Those of these bodies.
    pub(super) fn of(bodies: &[ColliderInput]) -> Self {
        Joints { at: bodies.iter().map(at_rest).collect(), joints: bodies.iter().map(|body| body.joints).collect() }
    }

    /// Notes the joints of bodies.
    pub(super) fn note(&self, bodies: &mut [ColliderInput]) {
        let known = self.are_of(bodies);
        if known {
            for (body, joints) in bodies.iter_mut().zip(&self.joints).filter(|(body, _)| at_rest(body).is_some()) {
                body.joints = *joints;
            }
            if self.at.iter().all(Option::is_some) {
                return;
            }
        }
        find(bodies, |body| !known || at_rest(body).is_none());
    }

    /// Whether they are those of these bodies, too.
    pub(super) fn are_of(&self, bodies: &[ColliderInput]) -> bool {
        bodies.len() == self.at.len() && bodies.iter().zip(&self.at).all(|(body, at)| at_rest(body) == *at)
    }
}

fn at_rest(body: &ColliderInput) -> Option<(DVec3, DMat3)> {
    (body.shift == DVec3::ZERO && body.turn == DMat3::ZERO).then_some((body.position, body.axes))
}

/// Finds the [joints](crate::stages::joint) of those of the bodies that are `sought`.
fn find(bodies: &mut [ColliderInput], sought: impl Fn(&ColliderInput) -> bool) {
    let bounds: Vec<_> = bodies.iter().map(|body| if sought(body) { bounds(body) } else { None }).collect();
    // From left to right, so that most pairs that are far apart are never looked at.
    let mut order: Vec<_> = (0..bodies.len()).filter(|i| bounds[*i].is_some()).collect();
    let lower = |i: usize| bounds[i].map_or(f64::NEG_INFINITY, |[lo, _]| lo.x);
    order.sort_by(|a, b| lower(*a).total_cmp(&lower(*b)));
    let mut near = vec![Vec::new(); bodies.len()];
    for (place, &i) in order.iter().enumerate() {
        let Some([lo, hi]) = bounds[i] else { continue };
        for &j in order[place + 1..].iter().take_while(|j| lower(**j) <= hi.x) {
            let turn = [bodies[i].turn, bodies[j].turn];
            let alike = bodies[i].shift == bodies[j].shift && turn == [DMat3::ZERO; 2];
            if alike && bounds[j].is_some_and(|[l, h]| l.cmple(hi).all() && lo.cmple(h).all()) {
                near[i].push(j);
                near[j].push(i);
            }
        }
    }
    let found = near.iter().enumerate().filter(|(_, near)| !near.is_empty());
    let found: Vec<_> = found.map(|(i, near)| (i, joints(&bodies[i], &Others { bodies, near }))).collect();
    found.into_iter().for_each(|(i, joints)| bodies[i].joints = joints);
}

/// A box around what a convex body can cover or touch; `None` for others.
fn bounds(body: &ColliderInput) -> Option<[DVec3; 2]> {
    let half = match body.kind {
        HALF_SPACE => DVec3::INFINITY,
        BOX => {
            let axes = body.axes.to_cols_array_2d().map(|axis| DVec3::from_array(axis).abs());
            axes[0] * body.size.x + axes[1] * body.size.y + axes[2] * body.size.z
        }
        // A capsule reaches as far as its half height and its radius together.
        kind if kind < GRID => DVec3::splat(body.size.x + body.size.y),
        _ => return None,
    };
    let half = half + 0.5 * (KERNEL_REACH + GAP);
    Some([body.position - half, body.position + half])
}

/// Convex bodies near one.
struct Others<'a> {
    bodies: &'a [ColliderInput],
    near: &'a [usize],
}

impl Others<'_> {
    fn hold(&self, point: DVec3) -> bool {
        self.near.iter().any(|i| holds(&self.bodies[*i], point))
    }

    /// Whether one of them holds all of these points, and what is between them.
    fn holds_all(&self, points: &[DVec3]) -> bool {
        self.near.iter().any(|i| points.iter().all(|point| holds(&self.bodies[*i], *point)))
    }
}

fn holds(body: &ColliderInput, point: DVec3) -> bool {
    let there = (body.axes.transpose() * (point - body.position)).to_array();
    let lanes = |v: [f64; 3]| v.map(|x| <f64 as Real>::V::from4([x; 4]));
    let (distance, _) = sdf::distance_normal::<f64>(body.kind, lanes(body.size.to_array()), None, lanes(there));
    distance.to4()[0] <= GAP
}

/// The joints of a body.
fn joints(body: &ColliderInput, others: &Others<'_>) -> u32 {
    if body.kind != BOX {
        return 0;
    }
    let place = |p: DVec3| body.position + body.axes * p;
    let mut joints = 0;
    for axis in 0..3 {
        // The opposite face of a thinner one would be in reach, too.
        for upper in [false, true].into_iter().filter(|_| body.size[axis] >= KERNEL_REACH) {
            let mut points = 0;
            let at = |before: f64, u: f64, v: f64| {
                let mut p = DVec3::ZERO;
                p[axis] = (body.size[axis] + before) * if upper { 1.0 } else { -1.0 };
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
                place(p)
            };
            let [u, v] = [body.size[(axis + 1) % 3], body.size[(axis + 2) % 3]];
            if covered(others, &at, [-u, u], [-v, v], &mut points) {
                joints |= 1 << face(axis, upper);
            }
        }
    }
    if joints == 0 {
        return 0;
    }
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let along = 3 - a - b;
        for (a_upper, b_upper) in [(false, false), (false, true), (true, false), (true, true)] {
            let beyond = |axis: usize, upper: bool| (body.size[axis] + BEFORE[0]) * if upper { 1.0 } else { -1.0 };
            let free = ALONG.iter().any(|share| {
                let mut p = DVec3::ZERO;
                (p[a], p[b], p[along]) = (beyond(a, a_upper), beyond(b, b_upper), body.size[along] * share);
                !others.hold(place(p))
            });
            joints |= u32::from(free) << edge((a, a_upper), (b, b_upper));
        }
    }
    joints
}

/// Whether others cover a part of a face, which extends from `u[0]` to `u[1]` and from `v[0]` to `v[1]`.
fn covered(
    others: &Others<'_>,
    at: &impl Fn(f64, f64, f64) -> DVec3,
    u: [f64; 2],
    v: [f64; 2],
    points: &mut u32,
) -> bool {
    *points += 8;
    let corners = [[u[0], v[0]], [u[0], v[1]], [u[1], v[0]], [u[1], v[1]]];
    let corners = corners.map(|[u, v]| BEFORE.map(|before| at(before, u, v)));
    let corners = corners.as_flattened();
    if *points > MOST_POINTS || !corners.iter().all(|corner| others.hold(*corner)) {
        return false;
    }
    let [wide, high] = [u[1] - u[0], v[1] - v[0]];
    if wide.max(high) < FINEST || others.holds_all(corners) {
        return true;
    }
    let halves = |[lo, hi]: [f64; 2]| [[lo, 0.5 * (lo + hi)], [0.5 * (lo + hi), hi]];
    if high < wide {
        halves(u).into_iter().all(|u| covered(others, at, u, v, points))
    } else {
        halves(v).into_iter().all(|v| covered(others, at, u, v, points))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;
    use std::slice;

    fn cuboid(lo: [f64; 3], hi: [f64; 3]) -> ColliderInput {
        let [lo, hi] = [lo, hi].map(DVec3::from_array);
        ColliderInput {
            kind: BOX,
            load: 0,
            position: 0.5 * (lo + hi),
            size: 0.5 * (hi - lo),
            grid: None,
            friction: 0.0,
            axes: DMat3::IDENTITY,
            shift: DVec3::ZERO,
            turn: DMat3::ZERO,
            faces: 0,
            joints: 0,
        }
    }

    fn found(mut bodies: Vec<ColliderInput>) -> Vec<u32> {
        find(&mut bodies, |_| true);
        bodies.iter().map(|b| b.joints).collect()
    }

    const COVERED_FACES: u32 = 0b11_1111;

    /// Two tiles, also where the second is two halves, or taller, or a bit apart.
    #[test]
    fn tiles_cover_each_other() {
        let tile = cuboid([0.0; 3], [6.0, 3.0, 8.0]);
        let beside = cuboid([6.0, 0.0, 0.0], [12.0, 3.0, 8.0]);
        let joints = found(vec![tile.clone(), beside.clone()]);
        assert_eq!(joints[0] & COVERED_FACES, 1 << face(0, true));
        assert_eq!(joints[1] & COVERED_FACES, 1 << face(0, false));
        assert!(joints[0] & 1 << edge((0, true), (1, true)) != 0);
        let halves = [([6.0, 0.0, 0.0], [12.0, 3.0, 4.3]), ([6.0, 0.0, 4.3], [12.0, 3.0, 8.0])];
        let halves = halves.map(|(lo, hi)| cuboid(lo, hi));
        let with = |others: &[ColliderInput]| found([slice::from_ref(&tile), others].concat());
        let joints = with(&halves);
        assert_eq!(joints[0] & COVERED_FACES, 1 << face(0, true));
        let gap = [halves[0].clone(), cuboid([6.0, 0.0, 5.0], [12.0, 3.0, 8.0])];
        assert_eq!(with(&gap)[0] & COVERED_FACES, 0);
        let taller = found(vec![tile.clone(), cuboid([6.0, 0.0, 0.0], [12.0, 5.0, 8.0])]);
        assert_eq!([0, 1].map(|i| taller[i] & COVERED_FACES), [1 << face(0, true), 0]);
        assert_eq!(taller[0] & 1 << edge((0, true), (1, true)), 0, "the taller one goes on above");
        let apart = ColliderInput { position: beside.position + DVec3::X * 0.1, ..beside };
        assert_eq!(found(vec![tile, apart]), [0, 0]);
    }

    /// A box sunk into the ground, whichever way the whole is turned.
    #[test]
    fn the_ground_covers_what_is_sunk_in_it() {
        for turn in [DQuat::IDENTITY, DQuat::from_rotation_z(0.3), DQuat::from_rotation_x(-1.1)] {
            let axes = DMat3::from_quat(turn);
            let plate = ColliderInput { axes, ..cuboid([-4.0, -3.0, -4.0], [4.0, 0.0, 4.0]) };
            let plate = ColliderInput { position: axes * plate.position, ..plate };
            let ground = ColliderInput { kind: HALF_SPACE, position: DVec3::ZERO, size: DVec3::ZERO, ..plate.clone() };
            let joints = found(vec![plate, ground]);
            assert_eq!(joints[0] & COVERED_FACES, COVERED_FACES & !(1 << face(1, true)), "{turn}");
            let flush = [(0, false), (0, true), (2, false), (2, true)];
            assert!(flush.iter().all(|f| joints[0] & 1 << edge((1, true), *f) != 0), "{turn}");
        }
    }
}
