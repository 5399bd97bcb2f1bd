//! Makes the blocks that the tiles of occupied ones also reach; gives each occupied block its range and its chunks.

use super::Kernel;
use crate::bins::{NONE, last_blocks, neighbour};
use crate::cpu::state::{Block, CpuState};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        write(Slot::Table),
        write(Slot::Blocks),
        write(Slot::Links),
        write(Slot::Chunks),
        write(Slot::Counters),
        write(Slot::Dispatch),
    ],
    over: Over::Occupied,
    source: include_str!("../../shaders/stages/bin_link.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let last = last_blocks(s.constants.period);
    let mut start = 0;
    for block in &mut s.blocks {
        block.start = start;
        start += block.count;
    }
    s.links.clear();
    for b in 0..s.occupied {
        let key = s.blocks[b].key;
        let mut links = [b as u32; 8];
        for (k, link) in links.iter_mut().enumerate().skip(1) {
            let there = neighbour(key, k as u32, last);
            *link = s.table.find_or_insert(there, s.blocks.len() as u32);
            if *link as usize == s.blocks.len() {
                s.blocks.push(Block::new(there, start));
            }
        }
        s.links.push(links);
    }
    s.sources.clear();
    s.sources.resize(s.blocks.len(), [NONE; 8]);
    for (b, links) in (0..).zip(&s.links) {
        for (k, &link) in links.iter().enumerate() {
            s.sources[link as usize][k] = b;
        }
    }
}
