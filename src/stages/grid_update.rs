//! Turns sums into displacements, adds gravity, applies boundaries.

use super::Kernel;
use super::collider_cull::touching;
use super::contact::resolve_all;
use crate::bins::{EDGE, NODES, coordinates};
use crate::cpu::par;
use crate::cpu::state::{Constants, CpuState, Tally};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::{dot, scale};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Colliders),
        read(Slot::Blocks),
        read(Slot::Cull),
        write(Slot::Grid),
        write(Slot::Counters),
    ],
    over: Over::Nodes,
    source: include_str!("../../shaders/stages/grid_update.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool) {
    let (constants, colliders, blocks, tally) = (&s.constants, &s.colliders, &s.blocks, &s.tally);
    let (cull, words) = (&s.cull, s.cull_words);
    par::each_block(&mut s.grid, |b, stored| {
        let mut nodes = [[R::of(0.0); 4]; NODES];
        let mut saturated = 0;
        let mut fastest = R::of(0.0);
        for (node, sum) in nodes.iter_mut().zip(&*stored) {
            *node = free_node::<R>(*sum, constants, first);
            fastest = fastest.max(node[0] * node[0] + node[1] * node[1] + node[2] * node[2]);
            saturated += u32::from(R::saturated(sum[3]));
        }
        Tally::add(&tally.saturated_nodes, saturated);
        let masks = &cull[b * words..(b + 1) * words];
        let near = touching(colliders, masks, blocks[b].key, fastest.sqrt());
        let origin = coordinates(blocks[b].key).map(|c| c * EDGE as u32);
        for (n, node) in nodes.iter_mut().enumerate().filter(|(_, node)| !near.is_empty() && node[3] > R::of(0.0)) {
            let at = [n % EDGE, n / EDGE % EDGE, n / EDGE / EDGE];
            let x = [0, 1, 2].map(|a| R::of(f64::from(origin[a] + at[a] as u32)));
            let u = resolve_all(colliders, &near, x, [node[0], node[1], node[2]], true);
            node[..3].copy_from_slice(&u);
        }
        *stored = nodes.map(|node| node.map(R::stored));
    });
}

/// A node's displacement without boundaries, and its mass.
#[inline(always)]
fn free_node<R: Real>(sum: [R::Sum; 4], constants: &Constants<R>, first: bool) -> [R; 4] {
    let mass = R::dequantise(sum[3], true);
    if mass <= R::of(0.0) {
        return [R::of(0.0); 4];
    }
    let unit = constants.mass_scale / constants.momentum_scale / mass;
    let mut u = [0, 1, 2].map(|c| R::dequantise(sum[c], false) * unit);
    if first {
        u = [0, 1, 2].map(|c| u[c] + constants.kick[c]);
    }
    let length = dot(u, u);
    let bound = constants.max_displacement;
    if length > bound * bound {
        u = scale(u, bound / length.sqrt());
    }
    [u[0], u[1], u[2], mass / constants.mass_scale]
}
