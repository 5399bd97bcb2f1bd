//! Turns sums into the displacements that the stresses at the beginning of the step would bring, applies boundaries, and notes
//! where they hold.

use super::collider_cull::touching;
use super::contact::{Friction, Near, STICKING, resolve_all};
use super::grid_update::free_node;
use crate::bins::{EDGE, NODES, coordinates};
use crate::cpu::par;
use crate::cpu::solve::{Held, MOTION_SCALE};
use crate::cpu::state::{ColliderConstants, CpuState, Tally};
use crate::math::linear::{cross, dot, scale, sub};
use crate::math::real::{Lanes, Real};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (constants, solve) = (&s.constants, &s.solve);
    let (colliders, blocks, tally, tools) = (&s.colliders, &s.blocks, &s.tally, &s.tools);
    let (cull, words) = (&s.cull, s.cull_words);
    s.held.resize(s.blocks.len(), [Held::default(); NODES]);
    s.field.resize(s.blocks.len(), [[R::of(0.0); 4]; NODES]);
    s.force.resize(s.blocks.len(), [[R::Sum::default(); 4]; NODES]);
    par::each_block(&mut s.force, |_, nodes| *nodes = [[R::Sum::default(); 4]; NODES]);
    let motion = par::PerBlock::<R::Whole>::new(s.blocks.len());
    par::each_triple(&mut s.grid, &mut s.field, &mut s.held, |b, stored, field, solved| {
        let origin = coordinates(blocks[b].key).map(|c| c * EDGE as u32);
        let mut nodes = [[R::of(0.0); 4]; NODES];
        let (mut saturated, mut fastest) = (0, R::of(0.0));
        for (n, (node, sum)) in nodes.iter_mut().zip(&*stored).enumerate() {
            let at = [n % EDGE, n / EDGE % EDGE, n / (EDGE * EDGE)];
            let at = [0, 1, 2].map(|a| origin[a] + at[a] as u32);
            *node = free_node::<R>(*sum, constants, solve, true, tools, at);
            fastest = fastest.max(node[0] * node[0] + node[1] * node[1] + node[2] * node[2]);
            saturated += u32::from(R::saturated(sum[3]));
        }
        Tally::add(&tally.saturated_nodes, saturated);
        *solved = [Held::default(); NODES];
        let free = nodes;
        let masks = &cull[b * words..(b + 1) * words];
        let near = touching::<R>(colliders, masks, blocks[b].key, fastest.sqrt());
        if !near.is_empty() {
            for (row, (nodes, solved)) in nodes.chunks_exact_mut(EDGE).zip(solved.chunks_exact_mut(EDGE)).enumerate() {
                let at = [origin[0], origin[1] + row as u32 % 4, origin[2] + row as u32 / 4];
                hold_row::<R>(colliders, &near, at, nodes, solved);
            }
        }
        let kick = dot(constants.kick, constants.kick);
        let mut total = R::Whole::default();
        for node in &nodes {
            let square = node[0] * node[0] + node[1] * node[1] + node[2] * node[2];
            total += R::whole(node[3] * (square + kick) * R::of(MOTION_SCALE));
        }
        motion.set(b, total);
        for (held, node) in solved.iter_mut().zip(&nodes) {
            held.motion = [node[0], node[1], node[2]];
        }
        *field = nodes.map(|node| [node[0], node[1], node[2], R::of(0.0)]);
        *stored = free.map(|node| node.map(R::stored));
    });
    let mut total = R::Whole::default();
    motion.take().into_iter().for_each(|m| total += m);
    s.solve.motion = R::of_whole(total) * R::of(1.0 / MOTION_SCALE);
}

/// Keeps a row of four nodes, the first at `at`, out of the bodies in reach.
fn hold_row<R: Real>(
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    at: [u32; 3],
    nodes: &mut [[R; 4]],
    solved: &mut [Held<R>],
) {
    let [ux, uy, uz, mass] = R::V::transposed([0, 1, 2, 3].map(|n| R::V::from4(nodes[n])));
    let zero = R::V::all(R::of(0.0));
    let taking_part = zero.below(mass);
    if !taking_part.any() {
        return;
    }
    let [x, y, z] = at.map(|c| R::of(f64::from(c)));
    let along = R::V::from4([0.0, 1.0, 2.0, 3.0].map(|n| x + R::of(n)));
    let at = [along, R::V::all(y), R::V::all(z)];
    let u = resolve_all::<R>(colliders, near, at, [ux, uy, uz], Friction::Sticking, |c, before, after| {
        let change = sub(after, before).map(Lanes::to4);
        for (n, solved) in solved.iter_mut().enumerate() {
            hold(solved, [change[0][n], change[1][n], change[2][n]], c.friction.to4()[0]);
        }
    });
    let [ux, uy, uz] = u.map(|c| taking_part.pick(c, zero));
    let resolved = R::V::transposed([ux, uy, uz, mass]);
    nodes.iter_mut().zip(resolved).for_each(|(node, lanes)| *node = lanes.to4());
}

/// Adds to the directions in which a node is held that in which contact has changed its motion.
fn hold<R: Real>(held: &mut Held<R>, change: [R; 3], friction: R) {
    let square = dot(change, change);
    if square <= R::of(0.0) {
        return;
    }
    let normal = scale(change, R::of(1.0) / square.sqrt());
    let (axis, count) = match (held.axis, held.count) {
        _ if friction >= R::of(STICKING) => ([R::of(0.0); 3], 3),
        (_, 0) => (normal, 1),
        (first, 1) => {
            let line = cross(first, normal);
            let square = dot(line, line);
            if square < R::of(1e-3) { (first, 1) } else { (scale(line, R::of(1.0) / square.sqrt()), 2) }
        }
        (line, 2) if dot(line, normal).abs() > R::of(0.03) => (line, 3),
        other => other,
    };
    (held.axis, held.count) = (axis, count);
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
