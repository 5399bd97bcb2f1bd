//! What the grid measures at a point amid matter at rest: 1, less what walls and bodies hide of it. Twin: `shaders/lib/room.wgsl`.
//!
//! Without it matter crowds in the last cell before a wall unnoticed.

use super::contact::{Near, frame};
use crate::cpu::state::{ColliderConstants, Constants};
use crate::math::real::{Lanes, Real};
use crate::math::sdf::{self, BOX, CAPSULE, CYLINDER, SPHERE};

/// From how far on a body hides nothing any more, in cells.
pub(crate) const SIGHT: f64 = 2.5;

/// The share of what bodies hide that counts where there is too much. They lie between nodes, which hold what is in the last cell before them
/// by fits and starts: with all of it pools beside them simmer.
pub(crate) const HIDDEN: f64 = 0.75;

/// The room there is at points.
pub(super) struct Room<T> {
    /// Where there is less matter than that, it has come apart.
    pub least: T,
    /// Where there is more, it is compressed.
    pub most: T,
}

/// The room at four points, from which these colliders may be in sight. Of several bodies, and of a container's walls, the one that hides most
/// counts: they may lie side by side, or in each other.
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

/// What the domain's closed sides leave.
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

/// What is taken of the share behind a plane per cell of distance from it, as far as half a cell.
const FADING: f64 = 23.0 / 48.0;

/// The share that lies behind a plane of nodes at a distance: 1 − Σ w A with the weights w of the nodes and the shares A of their
/// kernels before the plane. Exact; between nodes within 0.02.
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

/// The share that lies before a plane, which points may be behind.
#[inline(always)]
fn before<R: Real>(distance: R::V) -> R::V {
    let [zero, half, one] = [0.0, 0.5, 1.0].map(|x| R::V::all(R::of(x)));
    let apart = far_behind::<R>(distance.abs());
    let apart = distance.below(zero).pick(apart, one - apart);
    distance.abs().below(half).pick(half + distance * R::V::all(R::of(FADING)), apart)
}

/// The share between two planes at this distance to both sides of the middle. Amid them, or where the other is out of sight, nothing is lost
/// by a look at the one.
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

/// The share that a body hides at points: that of a plane as near, but no more than between the planes of a box's sides, or than the box around a
/// round body hides; of a container that of its nearest wall.
///
/// A box hides less than that past its edges: the product along its axes, with which small ones have no more than .3 to .9 of their lift.
#[inline(always)]
fn hidden_by<R: Real>(c: &ColliderConstants<R::V>, at: [R::V; 3]) -> R::V {
    let p = frame(c, at);
    let [radius, half, _] = c.size;
    let (distance, _) = sdf::distance_normal::<R>(c.kind, c.size, c.grid.as_deref(), p);
    let flat = before::<R>(-distance);
    let around = |extent: [R::V; 3]| {
        flat.min(between::<R>(extent[0], p[0]) * between::<R>(extent[1], p[1]) * between::<R>(extent[2], p[2]))
    };
    match c.kind {
        BOX => {
            let mut hidden = flat;
            // Along the other axes the far side is out of sight, and the near one no nearer than the body.
            for (half, x) in c.size.into_iter().zip(p) {
                if half.below(R::V::all(R::of(SIGHT))).any() {
                    hidden = hidden.min(between::<R>(half, x));
                }
            }
            hidden
        }
        SPHERE => around([radius; 3]),
        CAPSULE => around([radius, half + radius, radius]),
        CYLINDER => around([radius, half, radius]),
        _ => flat,
    }
}
