//! Turns sums into displacements, adds gravity, applies boundaries.

use super::collider_cull::touching;
use super::contact::{Friction, Near, resolve_all};
use super::{Kernel, load, tool};
use crate::bins::{EDGE, NODES, coordinates};
use crate::cpu::par;
use crate::cpu::solve::Solve;
use crate::cpu::state::{ColliderConstants, Constants, CpuState, Tally, ToolConstants};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::load::Running;
use crate::math::linear::{dot, scale};
use crate::math::real::{Lanes, Real};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Colliders).with_colliders(),
        read(Slot::Blocks),
        read(Slot::Cull).with_colliders(),
        write(Slot::Grid),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
        read(Slot::Tools).with_tools(),
    ],
    over: Over::Nodes,
    source: include_str!("../../shaders/stages/grid_update.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool) {
    let (constants, colliders, blocks, tally) = (&s.constants, &s.colliders, &s.blocks, &s.tally);
    let solve = &s.solve;
    let (cull, words, loads) = (&s.cull, s.cull_words, &s.loads);
    let tools = if first { &s.tools[..] } else { &[] };
    par::each_block(&mut s.grid, |b, stored| {
        let origin = coordinates(blocks[b].key).map(|c| c * EDGE as u32);
        let mut nodes = [[R::of(0.0); 4]; NODES];
        let mut saturated = 0;
        let mut fastest = R::of(0.0);
        for (n, (node, sum)) in nodes.iter_mut().zip(&*stored).enumerate() {
            let at = [n % EDGE, n / EDGE % EDGE, n / (EDGE * EDGE)];
            let at = [0, 1, 2].map(|a| origin[a] + at[a] as u32);
            *node = free_node::<R>(*sum, constants, solve, first, tools, at);
            fastest = fastest.max(node[0] * node[0] + node[1] * node[1] + node[2] * node[2]);
            saturated += u32::from(R::saturated(sum[3]));
        }
        Tally::add(&tally.saturated_nodes, saturated);
        let masks = &cull[b * words..(b + 1) * words];
        let near = touching::<R>(colliders, masks, blocks[b].key, fastest.sqrt());
        if !near.is_empty() {
            for (row, nodes) in nodes.chunks_exact_mut(EDGE).enumerate() {
                let at = [origin[0], origin[1] + row as u32 % 4, origin[2] + row as u32 / 4];
                resolve_row::<R>(colliders, &near, at, nodes, loads, constants.load_scale);
            }
        }
        *stored = nodes.map(|node| node.map(R::stored));
    });
}

/// Keeps a row of four nodes, the first at `at`, out of the bodies in reach. Nodes without mass stay as they are.
#[inline(always)]
pub(super) fn resolve_row<R: Real>(
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    at: [u32; 3],
    nodes: &mut [[R; 4]],
    loads: &[Running],
    load_scale: R,
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
    let u = resolve_all::<R>(colliders, near, at, [ux, uy, uz], Friction::Full, |c, before, after| {
        load::note::<R>(loads, c, at, before, after, mass * R::V::all(load_scale));
    });
    let [ux, uy, uz] = u.map(|c| taking_part.pick(c, zero));
    let resolved = R::V::transposed([ux, uy, uz, mass]);
    nodes.iter_mut().zip(resolved).for_each(|(node, lanes)| *node = lanes.to4());
}

/// A node's displacement without boundaries, and its mass.
#[inline(always)]
pub(super) fn free_node<R: Real>(
    sum: [R::Sum; 4],
    constants: &Constants<R>,
    solve: &Solve<R>,
    first: bool,
    tools: &[ToolConstants<R>],
    at: [u32; 3],
) -> [R; 4] {
    let mass = R::dequantise(sum[3], true);
    if mass <= R::of(0.0) {
        return [R::of(0.0); 4];
    }
    let unit = constants.mass_scale / solve.momentum_scale(constants) / mass;
    let mut u = [0, 1, 2].map(|c| R::dequantise(sum[c], false) * unit);
    if first {
        u = [0, 1, 2].map(|c| u[c] + constants.kick[c]);
    }
    if !tools.is_empty() {
        u = tool::wielded(tools, at.map(|c| R::of(f64::from(c))), u);
    }
    let length = dot(u, u);
    let bound = constants.max_displacement;
    if solve.pressure <= R::of(0.0) && length > bound * bound {
        u = scale(u, bound / length.sqrt());
    }
    [u[0], u[1], u[2], mass / constants.mass_scale]
}
