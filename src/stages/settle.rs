//! Applies boundaries to the displacements that the solve has found, with what it found them to exert.

use super::Kernel;
use super::contact::Friction;
use super::grid_update::{Bodies, slowed};
use super::predict::free;
use crate::bins::NODES;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::{add, sub};
use crate::math::real::{Lanes, Real};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Colliders).with_colliders(),
        read(Slot::Blocks),
        read(Slot::Cull).with_colliders(),
        write(Slot::Grid),
        read(Slot::Held),
        write(Slot::Force),
        read(Slot::Solve),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
    ],
    over: Over::Nodes,
    source: include_str!("../../shaders/stages/settle.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let bodies = Bodies { blocks: &s.blocks, colliders: &s.colliders, cull: &s.cull, words: s.cull_words };
    let (bound, loads, load_scale) = (s.constants.max_displacement, &s.loads, R::V::all(s.constants.load_scale));
    let held = &s.held;
    let unit = R::of(1.0) / s.solve.force_scale(&s.constants, true);
    par::each_block((&mut s.grid[..], &mut s.force[..]), |b, (stored, force)| {
        let mut nodes = [[R::of(0.0); 4]; NODES];
        for ((node, stored), force) in nodes.iter_mut().zip(&*stored).zip(&*force) {
            let [x, y, z, mass] = stored.map(R::loaded);
            if mass <= R::of(0.0) {
                continue;
            }
            let unit = unit * (R::of(1.0) / mass);
            let [x, y, z] = slowed(add([x, y, z], [0, 1, 2].map(|c| R::dequantise(force[c], false) * unit)), bound);
            *node = [x, y, z, mass];
        }
        *force = [[R::Sum::default(); 4]; NODES];
        bodies.resolve(b, &mut nodes, Friction::Full, |touch| touch.load(loads, load_scale));
        // The pressures are those of nodes that are held; they let go in the next step.
        for (node, held) in nodes.iter_mut().zip(&held[b]).filter(|(_, held)| held.count > 0) {
            let kept = sub(held.motion, free(held, held.motion));
            let u = add(free(held, [node[0], node[1], node[2]]), kept);
            node[..3].copy_from_slice(&u);
        }
        *stored = nodes.map(|node| node.map(R::stored));
    });
}
