//! Finds or makes the block of every particle and counts the block's particles.

use super::Kernel;
use crate::bins::{NONE, key_at};
use crate::cpu::par;
use crate::cpu::state::{Block, CpuState};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Position),
        write(Slot::Bin),
        write(Slot::Table),
        write(Slot::Blocks),
        write(Slot::Counters),
        write(Slot::DispatchOccupied),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/bin_insert.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let position = &s.position;
    // Keys first, on all cores; then blocks in the order of their first particle.
    par::each(&mut s.particle_block, |p, key| {
        let [x, y, z, ratio] = position[p];
        *key = if ratio > R::of(0.0) { key_at([x, y, z]) } else { NONE };
    });
    s.table.clear();
    s.blocks.clear();
    let mut last = (NONE, NONE);
    for entry in &mut s.particle_block {
        if *entry == NONE {
            continue;
        }
        if *entry != last.0 {
            let block = s.table.find_or_insert(*entry, s.blocks.len() as u32);
            if block as usize == s.blocks.len() {
                s.blocks.push(Block { key: *entry, start: 0, count: 0 });
            }
            last = (*entry, block);
        }
        *entry = last.1;
        s.blocks[last.1 as usize].count += 1;
    }
    s.occupied = s.blocks.len();
}
