//! Turns sums into the displacements due to the motion and the pressures at the beginning of the step, applies
//! boundaries, and records where they hold nodes.

use super::Kernel;
use super::contact::{self, Friction};
use super::grid_update::{Bodies, Free, Touch, bodies};
use crate::bins::{EDGE, NODES};
use crate::cpu::par;
use crate::cpu::solve::{Held, MOTION_SCALE, counted_motion, motion_scale};
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::{add, cross, dot, scale, sub};
use crate::math::real::{Lanes, Real};
use crate::math::wide::{Wide, Work, widely};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Colliders).with_colliders(),
        read(Slot::Blocks),
        read(Slot::Cull).with_colliders(),
        write(Slot::Grid),
        write(Slot::Field),
        write(Slot::Held),
        write(Slot::Solve),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
        read(Slot::Tools).with_tools(),
        read(Slot::Materials).with_sticking(),
    ],
    over: Over::Nodes,
    source: include_str!("../../shaders/stages/predict.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.held.resize(s.blocks.len(), [Held::default(); NODES]);
    s.field.resize(s.blocks.len(), [[R::of(0.0); 4]; NODES]);
    s.force.resize(s.blocks.len(), [[R::Sum::default(); 4]; NODES]);
    let free = Free {
        constants: &s.constants,
        largest_motion: s.largest_motion,
        pressed: s.solve.pressure > R::of(0.0) && !s.features.resumes,
        first: true,
        tools: &s.tools,
        tally: &s.tally,
    };
    let bodies = bodies!(s);
    let scale = motion_scale(s.largest_motion, s.constants.kick);
    let work = Predict { free, bodies, scale, motion: par::Totals::new(s.blocks.len()), largest: par::Largest::new() };
    let nodes = (&mut s.grid[..], (&mut s.field[..], &mut s.held[..]));
    par::each_block(nodes, |b, (stored, (field, held))| widely(&work, (b, stored, field, held)));
    let (sums, [largest]) = (work.motion.take(), work.largest.take::<R>());
    s.solve.motion = counted_motion(sums.map(|sum| sum * R::of(1.0 / MOTION_SCALE)), scale, s.constants.kick);
    s.solve.largest_answer = s.solve.largest_answer.max(largest.sqrt() * (R::of(1.0) / scale));
}

/// Predicts the nodes of a block.
struct Predict<'a, R: Real> {
    free: Free<'a, R>,
    bodies: Bodies<'a, R>,
    /// Scale and sums for [`counted_motion`].
    scale: R,
    motion: par::Totals<R, 5>,
    /// Largest square of the scaled motion of a node.
    largest: par::Largest<1>,
}

/// A block's sums, velocities, and the directions in which its nodes are held.
type Predicted<'a, R> =
    (usize, &'a mut [[<R as Real>::Sum; 4]; NODES], &'a mut [[R; 4]; NODES], &'a mut [Held<R>; NODES]);

impl<R: Real> Work<Predicted<'_, R>> for Predict<'_, R> {
    #[inline(always)]
    fn on(&self, _: Option<Wide>, (b, stored, field, held): Predicted<'_, R>) {
        let Predict { free, bodies, scale, motion, largest } = self;
        let block = &bodies.blocks[b];
        if block.is_idle() {
            return;
        }
        let mut nodes = free.nodes(bodies.origin(b), stored);
        *stored = nodes.map(|node| node.map(R::stored));
        *held = [Held::default(); NODES];
        bodies.resolve(b, &mut nodes, Friction::Sticking, |touch| note(held, &touch));
        let mut total = [R::Whole::default(); 5];
        let mut most = R::of(0.0);
        for (n, ((node, field), held)) in nodes.iter().zip(field).zip(held).enumerate() {
            if block.stands_still(n) {
                *held = Held { count: if node[3] > R::of(0.0) { 3 } else { 0 }, body: NO_BODY, ..Held::default() };
                *field = [R::of(0.0); 4];
                continue;
            }
            let u = [node[0], node[1], node[2]];
            let scaled = u.map(|u| u * *scale);
            let square = dot(scaled, scaled);
            most = most.max(square);
            // Moved by one, so that none is negative.
            let [x, y, z] = scaled.map(|u| u + R::of(1.0));
            for (total, one) in total.iter_mut().zip([square, R::of(1.0), x, y, z]) {
                *total += R::whole(node[3] * one * R::of(MOTION_SCALE));
            }
            held.motion = held_motion(held, u);
            *field = [u[0], u[1], u[2], R::of(0.0)];
        }
        motion.set(b, total);
        largest.note([most]);
    }
}

/// Records the directions in which a body holds the nodes of a block that it touches, and the share of their motion
/// that it removes.
#[inline(always)]
fn note<R: Real>(held: &mut [Held<R>; NODES], touch: &Touch<'_, R>) {
    let held = &mut held[touch.first..touch.first + EDGE];
    if let Some((share, normal)) = touch.braked {
        let (share, normal) = (share.to4(), normal.map(Lanes::to4));
        for (n, held) in held.iter_mut().enumerate() {
            brake(held, share[n], normal.map(|axis| axis[n]));
        }
        return;
    }
    // The node is held in that direction already.
    if touch.more {
        return;
    }
    let change = sub(touch.after, touch.before);
    let counts = counts::<R>(change, touch.after, touch.stuck);
    if !counts.any() {
        return;
    }
    let relative = sub(touch.after, contact::motion::<R>(touch.collider, touch.at)).map(Lanes::to4);
    let (change, counts, stuck) = (change.map(Lanes::to4), counts.lanes(), touch.stuck.lanes());
    for (n, held) in held.iter_mut().enumerate().filter(|(n, held)| counts[*n] && held.count < 3) {
        let [change, relative] = [&change, &relative].map(|v| [v[0][n], v[1][n], v[2][n]]);
        if stuck[n] {
            hold_sticking(held, touch.body, relative);
        } else {
            hold(held, touch.body, change, relative);
        }
    }
}

/// Where a body changes the motion of nodes, to `after`, by more than rounding; for nodes that stick, any change
/// counts.
#[inline(always)]
fn counts<R: Real>(change: [R::V; 3], after: [R::V; 3], stuck: R::V) -> R::V {
    let [zero, touch, slight] = [0.0, TOUCH, SLIGHT].map(|x| R::V::all(R::of(x)));
    let rounding = stuck.pick(zero, dot(after, after) * slight);
    touch.max(rounding).at_most(dot(change, change))
}

/// In place of the body of nodes that are held by none.
pub(crate) const NO_BODY: u32 = u32::MAX >> 2;

/// Square of the smallest change that counts, in cells. Devices may flush squares below 1e-38 to zero.
pub(crate) const TOUCH: f64 = 1e-24;

/// The same as a share of the square of the motion. Less is rounding where there has been contact, in an arbitrary
/// direction.
pub(crate) const SLIGHT: f64 = 1e-10;

/// How much nearer to a body a node that it holds may come in a step, in cells.
pub(crate) const NEARER: f64 = 0.01;

/// Square of the sine between two directions below which they count as the same.
pub(crate) const ALONG: f64 = 1e-3;

/// Cosine between two directions up to which they count as perpendicular.
pub(crate) const ACROSS: f64 = 0.03;

/// Adds the direction of a `change` of a node's motion that [`counts`] to those in which the node is held; the motion
/// is `relative` to the body afterwards. A node that still comes nearer is not held: held nodes are neither pushed nor
/// pulled, and nothing should pull matter the rest of the way.
fn hold<R: Real>(held: &mut Held<R>, body: usize, change: [R; 3], relative: [R; 3]) {
    let normal = scale(change, R::of(1.0) / dot(change, change).sqrt());
    if dot(relative, normal) < R::of(-NEARER) {
        return;
    }
    let (axis, count) = match (held.axis, held.count) {
        (_, 0) => (normal, 1),
        (first, 1) => {
            let line = cross(first, normal);
            let square = dot(line, line);
            if square < R::of(ALONG) {
                return;
            }
            (scale(line, R::of(1.0) / square.sqrt()), 2)
        }
        (line, 2) if dot(line, normal).abs() > R::of(ACROSS) => (line, 3),
        _ => return,
    };
    (held.axis, held.count, held.body) = (axis, count, body as u32);
}

/// The same for a node that sticks to a body: it is held in all directions, or, where it leaves the body or may come
/// nearer, only perpendicular to its motion, which is along the normal.
fn hold_sticking<R: Real>(held: &mut Held<R>, body: usize, relative: [R; 3]) {
    held.body = body as u32;
    let square = dot(relative, relative);
    if square <= R::of(NEARER * NEARER) {
        held.count = 3;
        return;
    }
    let line = scale(relative, R::of(1.0) / square.sqrt());
    let other = cross(held.axis, line);
    let alike = match held.count {
        0 => true,
        1 => dot(held.axis, line).abs() <= R::of(ACROSS),
        _ => dot(other, other) < R::of(ALONG),
    };
    (held.axis, held.count) = (line, if alike { 2 } else { 3 });
}

/// Records that a node loses this share of its motion along a body. Its motion is stored later, by [`held_motion`].
fn brake<R: Real>(held: &mut Held<R>, share: R, normal: [R; 3]) {
    if share > R::of(0.0) {
        (held.braked, held.motion) = (share, normal);
    }
}

/// The motion to store for a node that would move by `u`: for a braked node, the held part of `u` plus the free part of
/// the body's normal.
fn held_motion<R: Real>(held: &Held<R>, u: [R; 3]) -> [R; 3] {
    if held.braked > R::of(0.0) { add(sub(u, free(held, u)), free(held, held.motion)) } else { u }
}

/// The motion that a node gets from forces that would give a free node the motion `v`: with P `v` ↦ `free`, P ((1 − b)
/// I + b n nᵀ) P.
#[inline(always)]
pub(super) fn reply<R: Real>(held: &Held<R>, v: [R; 3]) -> [R; 3] {
    let moved = free(held, v);
    let braked = held.braked;
    if braked <= R::of(0.0) {
        return moved;
    }
    let normal = free(held, held.motion);
    add(scale(moved, R::of(1.0) - braked), scale(normal, braked * dot(normal, moved)))
}

/// Twice the work per mass of the forces that have given a node the motion `u`: the product of `u` with the inverse of
/// [`reply`] applied to it (Sherman and Morrison).
#[inline(always)]
pub(super) fn work<R: Real>(held: &Held<R>, u: [R; 3]) -> R {
    let square = dot(u, u);
    let braked = held.braked;
    if braked <= R::of(0.0) {
        return square;
    }
    let one = R::of(1.0);
    let normal = free(held, held.motion);
    let along = dot(normal, u);
    let left = one - braked;
    (square - braked * (along * along) * (one / (left + braked * dot(normal, normal)))) * (one / left)
}

/// The part of `v` in the directions in which a node is free.
#[inline(always)]
pub(super) fn free<R: Real>(held: &Held<R>, v: [R; 3]) -> [R; 3] {
    match held.count {
        0 => v,
        1 => sub(v, scale(held.axis, dot(held.axis, v))),
        2 => scale(held.axis, dot(held.axis, v)),
        _ => [R::of(0.0); 3],
    }
}
