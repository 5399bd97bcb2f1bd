//! Notes for each block the colliders that can be touched from it.

use super::Kernel;
use super::contact::{Near, distance_normal_before, motion};
use super::footing::MOVED;
use super::seam::thin_axis;
use crate::bins::{EDGE, coordinates};
use crate::cpu::constants::ColliderConstants;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::distance_grid::REACH;
use crate::math::linear::{dot, sub};
use crate::math::real::{Lanes, Real};
use crate::math::sdf::{GRID, HALF_SPACE, is_grid};
use crate::world::MAX_COLLIDERS;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Colliders),
        read(Slot::Blocks),
        write(Slot::Cull),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
    ],
    over: Over::Blocks,
    source: include_str!("../../shaders/stages/collider_cull.wgsl"),
};

/// From a block's first node to the middle of its nodes and particles, cells along each axis.
pub(crate) const TO_MIDDLE: f64 = 2.25;
/// Distance from that middle to the farthest node or particle: √3 · 2.25.
pub(crate) const BLOCK_RADIUS: f64 = 3.8972;
/// Least distance up to which bodies are noted, however short motions are: particles and their nodes take account of
/// bodies up to 2.5 cells away.
pub(crate) const LEAST_REACH: f64 = 3.0;
/// Room for rounding in a lower bound, cells.
pub(crate) const ROUNDING: f64 = 1e-2;
/// Number of bodies that a word notes, one bit each.
pub(crate) const BODIES_PER_WORD: usize = 31;
/// The bit that is set if any later word of the block notes a body; otherwise these need not be read.
pub(crate) const MORE: u32 = 1 << BODIES_PER_WORD;
/// The most words that a block has.
pub(crate) const MOST_WORDS: usize = words(MAX_COLLIDERS);

/// Number of words in which a block notes this many bodies.
pub(crate) const fn words(bodies: usize) -> usize {
    bodies.div_ceil(BODIES_PER_WORD)
}

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let words = s.cull_words;
    s.cull.resize(s.blocks.len() * words, 0);
    let (blocks, colliders, reach) =
        (&s.blocks, &s.colliders, R::of(BLOCK_RADIUS) + s.constants.max_displacement.max(R::of(LEAST_REACH)));
    let beyond: Vec<_> = colliders.iter().map(|c| beyond::<R>(c, reach)).collect();
    // Four blocks at a time, one per lane.
    par::each_chunk(&mut s.cull, 4 * words, |first, masks| {
        masks.fill(0);
        let count = masks.len() / words;
        let keys = [0, 1, 2, 3].map(|n: usize| blocks[4 * first + n.min(count - 1)].key);
        let middles = keys.map(|key| coordinates(key).map(middle::<R>));
        let middle = [0, 1, 2].map(|a| R::V::from4(middles.map(|m| m[a])));
        for (c, collider) in colliders.iter().enumerate() {
            if beyond[c].is_some_and(|most| {
                let way = sub(middle, collider.position);
                !dot(way, way).at_most(R::V::all(most)).any()
            }) {
                continue;
            }
            let (distance, _) = distance_normal_before::<R>(collider, middle);
            let in_reach =
                way_to::<R>(collider, distance).at_most(R::V::all(reach) + motion_bound::<R>(collider, middle)).lanes();
            for (mask, reached) in masks.chunks_exact_mut(words).zip(in_reach) {
                mask[c / BODIES_PER_WORD] |= u32::from(reached) << (c % BODIES_PER_WORD);
            }
        }
        for mask in masks.chunks_exact_mut(words) {
            let mut more = 0;
            for word in mask.iter_mut().rev() {
                let any = *word != 0;
                *word |= more;
                more = if any { MORE } else { more };
            }
        }
    });
}

/// The middle of a block's nodes and particles along an axis, from the block's coordinate.
#[inline(always)]
fn middle<R: Real>(coordinate: u32) -> R {
    R::of(f64::from(coordinate * EDGE as u32)) + R::of(TO_MIDDLE)
}

/// For a bounded body at rest: the squared distance between its middle and a block's beyond which it is certainly out
/// of reach. Where there are many bodies, most are.
fn beyond<R: Real>(c: &ColliderConstants<R::V>, reach: R) -> Option<R> {
    let lane = |lanes: R::V| lanes.to4()[0];
    let at_rest = [c.shift, c.turn[0], c.turn[1], c.turn[2]].into_iter().flatten().all(|x| lane(x) == R::of(0.0));
    let most = lane(c.size[0] + c.size[1] + c.size[2]) + (reach + R::of(ROUNDING));
    (at_rest && is_convex(c) && c.kind != HALF_SPACE).then_some(most * most)
}

/// Lower bound of the way to a collider at this distance, also from the shifted place where a mesh beside other bodies
/// is queried.
#[inline(always)]
fn way_to<R: Real>(c: &ColliderConstants<R::V>, distance: R::V) -> R::V {
    match &c.grid {
        Some(grid) => distance * R::V::all(R::of(REACH)) - R::V::all(R::of(MOVED * grid.spacing)),
        None => distance,
    }
}

/// The colliders noted for a block that can be touched at the block's own speed. Omitting the others changes nothing;
/// the shaders do not do this.
pub(crate) fn touching<R: Real>(
    colliders: &[ColliderConstants<R::V>],
    masks: &[u32],
    key: u32,
    speed: R,
) -> Vec<Near<R>> {
    let middle = coordinates(key).map(|c| R::V::all(middle::<R>(c)));
    let mut near = Vec::new();
    for (word, &mask) in masks.iter().enumerate() {
        let mut rest = mask & !MORE;
        while rest != 0 {
            let collider = BODIES_PER_WORD * word + rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let (distance, normal) = distance_normal_before::<R>(&colliders[collider], middle);
            let bound = motion_bound::<R>(&colliders[collider], middle);
            let convex = is_convex(&colliders[collider]);
            let by_end = convex && !R::V::all(R::of(0.0)).below(bound).any();
            let slope = if convex { normal } else { [R::V::all(R::of(0.0)); 3] };
            let way = way_to::<R>(&colliders[collider], distance);
            let offset = way - R::V::all(R::of(ROUNDING));
            let thin = thin_axis::<R>(&colliders[collider]).is_some() || is_grid(colliders[collider].kind);
            near.push(Near { collider, slope, offset, own: bound, gained: R::V::all(R::of(0.0)), by_end, thin });
        }
        if mask & MORE == 0 {
            break;
        }
    }
    // A moving body that stops a point can make it faster, by at most twice the body's motion, so that it reaches
    // bodies farther away. So bodies are added, beginning with those in reach at the block's own speed, until no
    // further one is found. A mesh can also push a point out after each piece of its way, by as much as √3 pieces.
    let lane = |lanes: R::V| lanes.to4()[0];
    let mut gained = R::of(0.0);
    loop {
        let radius = R::of(BLOCK_RADIUS) + speed + gained;
        let reached = near.iter().filter(|c| lane(c.offset - c.own) <= radius);
        let fastest = reached.fold(R::of(0.0), |most, c| {
            let put_out =
                if is_grid(colliders[c.collider].kind) { R::of(1.74) * (speed + lane(c.own)) } else { R::of(0.0) };
            most.max(lane(c.own + c.own) + put_out)
        });
        if fastest <= gained {
            break;
        }
        gained = fastest;
    }
    let radius = R::of(BLOCK_RADIUS) + speed + gained;
    near.retain(|c| lane(c.offset - c.own) <= radius);
    for c in &mut near {
        // From the block's middle down to its farthest point: by the tangent's slope, which is then evaluated at the
        // points themselves, or by the whole radius.
        let down =
            if is_convex(&colliders[c.collider]) { dot(c.slope, middle) } else { R::V::all(R::of(BLOCK_RADIUS)) };
        c.offset = c.offset - down;
        c.gained = R::V::all(gained);
    }
    near
}

/// Whether the distance to a collider is a convex function.
fn is_convex<T>(c: &ColliderConstants<T>) -> bool {
    c.kind < GRID
}

/// The largest displacement of the collider's material in a block around `middle`.
#[inline(always)]
fn motion_bound<R: Real>(c: &ColliderConstants<R::V>, middle: [R::V; 3]) -> R::V {
    let body = motion::<R>(c, middle);
    let turn = (dot(c.turn[0], c.turn[0]) + dot(c.turn[1], c.turn[1]) + dot(c.turn[2], c.turn[2])).sqrt();
    dot(body, body).sqrt() + turn * R::V::all(R::of(BLOCK_RADIUS))
}
