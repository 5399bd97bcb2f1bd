//! The room: the volume fraction that the grid measures at a point amid matter at rest. It is 1 less the share that
//! walls and bodies hide (occlude). Twin: `shaders/lib/room.wgsl`.
//!
//! Without it matter would crowd unnoticed in the last cell before a wall.

use super::contact::{Near, frame};
use crate::cpu::constants::{ColliderConstants, Constants};
use crate::math::linear::sub;
use crate::math::real::{Lanes, Real};
use crate::math::sdf::{self, BOX, CAPSULE, CYLINDER, GRID, SPHERE};

/// Distance in cells from which a body hides nothing.
pub(crate) const SIGHT: f64 = 2.5;

/// The share of what bodies hide that counts for excesses. Faces of bodies lie between nodes, which hold and release
/// the matter in the last cell before them alternately: with the full share, pools beside them simmer.
pub(crate) const HIDDEN: f64 = 0.75;

/// The room at points.
pub(super) struct Room<T> {
    /// Less matter than this counts as a deficit.
    pub least: T,
    /// More than this counts as compression.
    pub most: T,
}

/// The room at four points; `near` are the colliders that may be in sight of them. Of several bodies, and of a
/// container's walls, the one that hides most counts, since they may lie side by side or in each other.
#[inline(always)]
pub(super) fn room<R: Real>(
    at: [R::V; 3],
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    constants: &Constants<R>,
) -> Room<R::V> {
    let one = R::V::all(R::of(1.0));
    let walls = before_walls::<R>(at, constants);
    // The domain's sides are the first of the colliders.
    let sides = 6 - constants.open_sides.count_ones() as usize;
    let mut room = Room { least: walls, most: walls };
    for near in near.iter().filter(|near| near.collider >= sides && near.within(at, R::V::all(R::of(SIGHT)))) {
        let hidden = hidden_by::<R>(&colliders[near.collider], at);
        room.least = room.least.min(one - hidden);
        room.most = room.most.min(one - hidden * R::V::all(R::of(HIDDEN)));
    }
    room
}

/// The room that the domain's closed sides leave.
#[inline(always)]
fn before_walls<R: Real>(at: [R::V; 3], constants: &Constants<R>) -> R::V {
    let one = R::V::all(R::of(1.0));
    let sight = R::V::all(R::of(SIGHT));
    let mut room = one;
    for (a, x) in at.into_iter().enumerate() {
        let sides = constants.open_sides >> (2 * a);
        let [below, above] = [x - R::V::all(constants.lo[a]), R::V::all(constants.hi[a]) - x];
        if sides & 1 == 0 && below.below(sight).any() {
            room = room * (one - behind::<R>(below));
        }
        if sides & 2 == 0 && above.below(sight).any() {
            room = room * (one - behind::<R>(above));
        }
    }
    room
}

/// Decrease of the share behind a plane per cell of distance, up to half a cell.
pub(crate) const FADING: f64 = 23.0 / 48.0;

/// The share of a kernel that lies behind a plane through nodes, at a distance: 1 − Σ w A with the weights w of the
/// nodes and the shares A of their kernels before the plane. Exact; for planes between nodes within 0.02.
#[inline(always)]
fn behind<R: Real>(distance: R::V) -> R::V {
    let half = R::V::all(R::of(0.5));
    distance.below(half).pick(half - distance * R::V::all(R::of(FADING)), far_behind::<R>(distance))
}

/// The same from half a cell on.
#[inline(always)]
fn far_behind<R: Real>(distance: R::V) -> R::V {
    let all = |x: f64| R::V::all(R::of(x));
    let far = (all(2.5) - distance).max(all(0.0));
    let near = (all(1.5) - distance).max(all(0.0));
    far * (far * all(1.0 / 96.0)) + near * (near * all(7.0 / 32.0))
}

/// The share that lies before a plane, for points on either side.
#[inline(always)]
fn before<R: Real>(distance: R::V) -> R::V {
    let [zero, half, one] = [0.0, 0.5, 1.0].map(|x| R::V::all(R::of(x)));
    let apart = far_behind::<R>(distance.abs());
    let apart = distance.below(zero).pick(apart, one - apart);
    distance.abs().below(half).pick(half + distance * R::V::all(R::of(FADING)), apart)
}

/// The share between two planes at the distance `half` to either side of the middle. Well inside, or where the farther
/// plane is out of sight, considering only the nearer one loses nothing.
#[inline(always)]
fn between<R: Real>(half: R::V, x: R::V) -> R::V {
    let (way, sight) = (x.abs(), R::V::all(R::of(SIGHT)));
    let nearer = half - way;
    if !nearer.below(sight).any() {
        return R::V::all(R::of(1.0));
    }
    let before = before::<R>(nearer);
    if half.below(sight).any() { before - behind::<R>(half + way) } else { before }
}

/// The share that a body hides at points: that of a plane at the same distance, but no more than the box hides, or the
/// box around another body: the product of what lies between its sides along the axes. For a container that of its
/// nearest wall.
#[inline(always)]
fn hidden_by<R: Real>(c: &ColliderConstants<R::V>, at: [R::V; 3]) -> R::V {
    let p = frame(c, at);
    let [radius, half, _] = c.size;
    let (distance, _) = sdf::distance_normal::<R>(c.kind, c.size, c.grid.as_deref(), p);
    let flat = before::<R>(-distance);
    let in_box = |extent: [R::V; 3], p: [R::V; 3]| {
        flat.min(between::<R>(extent[0], p[0]) * between::<R>(extent[1], p[1]) * between::<R>(extent[2], p[2]))
    };
    let around = |extent| in_box(extent, p);
    match c.kind {
        BOX => around(c.size),
        SPHERE => around([radius; 3]),
        CAPSULE => around([radius, half + radius, radius]),
        CYLINDER => around([radius, half, radius]),
        GRID => c.grid.as_deref().map_or(flat, |grid| {
            let [extent, middle] = [grid.extent, grid.middle()].map(|v| v.to_array().map(|x| R::V::all(R::of(x))));
            in_box(extent, sub(p, middle))
        }),
        _ => flat,
    }
}
