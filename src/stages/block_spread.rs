//! Adds the effect of the pressures of blocks to the predicted motion of the nodes.

use super::Kernel;
use super::block_join::{node, place, push, reach, tile_of};
use super::predict::reply;
use crate::bins::NODES;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::{add, scale};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Couplings),
        read(Slot::BlockPressures),
        write(Slot::BlockTiles),
        read(Slot::Grid),
        read(Slot::Held),
        write(Slot::Field),
        write(Slot::Counters),
        read(Slot::Blocks).with_sleep(),
    ],
    over: Over::SolveNodes,
    source: include_str!("../../shaders/stages/block_spread.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (grid, held, blocks, sources) = (&s.grid, &s.held, &s.blocks, &s.sources);
    let (tiles, pressures) = (&s.block_tiles, &s.block_pressures);
    let unit = R::of(1.0) / s.solve.force_scale_of(&s.constants, R::of(1.0));
    par::each_block(&mut s.field[..], |b, field| {
        if blocks[b].is_idle() {
            return;
        }
        let mut pushes = [[R::of(0.0); 3]; NODES];
        for (k, source) in sources[b].into_iter().enumerate() {
            let Some(tile) = tile_of::<R>(tiles, blocks, source) else { continue };
            let found = pressures[source as usize].found;
            for at in reach(k) {
                let pushed = push(&tile[place(k, at)], unit);
                pushes[node(at)] = add(pushes[node(at)], scale(pushed, found));
            }
        }
        for (n, (field, pushed)) in field.iter_mut().zip(pushes).enumerate() {
            let mass = R::loaded(grid[b][n][3]);
            if mass > R::of(0.0) {
                let moved = reply(&held[b][n], scale(pushed, R::of(1.0) / mass));
                (0..3).for_each(|a| field[a] += moved[a]);
            }
        }
    });
}
