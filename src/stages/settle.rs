//! Applies boundaries to the displacements that the solve has found, with what it found them to exert.

use super::collider_cull::touching;
use super::grid_update::resolve_row;
use super::predict::free;
use crate::bins::{EDGE, NODES, coordinates};
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::math::linear::{add, dot, scale, sub};
use crate::math::real::Real;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (constants, colliders, blocks) = (&s.constants, &s.colliders, &s.blocks);
    let (cull, words, loads, force, held) = (&s.cull, s.cull_words, &s.loads, &s.force, &s.held);
    let unit = R::of(1.0) / s.solve.force_scale(&s.constants, true);
    par::each_block(&mut s.grid, |b, stored| {
        let origin = coordinates(blocks[b].key).map(|c| c * EDGE as u32);
        let mut nodes = [[R::of(0.0); 4]; NODES];
        let mut fastest = R::of(0.0);
        for ((node, stored), force) in nodes.iter_mut().zip(&*stored).zip(&force[b]) {
            let [x, y, z, mass] = stored.map(R::loaded);
            if mass <= R::of(0.0) {
                continue;
            }
            let unit = unit * (R::of(1.0) / mass);
            let mut u = add([x, y, z], [0, 1, 2].map(|c| R::dequantise(force[c], false) * unit));
            let length = dot(u, u);
            let bound = constants.max_displacement;
            if length > bound * bound {
                u = scale(u, bound / length.sqrt());
            }
            *node = [u[0], u[1], u[2], mass];
            fastest = fastest.max(dot(u, u));
        }
        let masks = &cull[b * words..(b + 1) * words];
        let near = touching::<R>(colliders, masks, blocks[b].key, fastest.sqrt());
        if !near.is_empty() {
            for (row, nodes) in nodes.chunks_exact_mut(EDGE).enumerate() {
                let at = [origin[0], origin[1] + row as u32 % 4, origin[2] + row as u32 / 4];
                resolve_row::<R>(colliders, &near, at, nodes, loads, constants.load_scale);
            }
        }
        // The stresses are those of nodes that are held; they let go in the next step.
        for (node, held) in nodes.iter_mut().zip(&held[b]).filter(|(_, held)| held.count > 0) {
            let kept = sub(held.motion, free(held, held.motion));
            let u = add(free(held, [node[0], node[1], node[2]]), kept);
            node[..3].copy_from_slice(&u);
        }
        *stored = nodes.map(|node| node.map(R::stored));
    });
}
