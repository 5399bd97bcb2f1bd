//! Writes the particles of each block into its range.
//!
//! The shader writes indices; this twin moves the particles themselves, so that each core can own whole blocks.

use super::Kernel;
use crate::bins::NONE;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Bin),
        read(Slot::Table),
        read(Slot::Blocks),
        write(Slot::Order),
        write(Slot::Counters),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/bin_scatter.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    if s.particle_block.is_sorted() {
        return;
    }
    let taking_part: u32 = s.blocks.iter().map(|b| b.count).sum();
    let mut next: Vec<u32> = s.blocks.iter().map(|b| b.start).collect();
    let mut removed = taking_part;
    s.order.resize(s.position.len(), 0);
    for (p, &block) in s.particle_block.iter().enumerate() {
        let place = if block == NONE { &mut removed } else { &mut next[block as usize] };
        s.order[*place as usize] = p as u32;
        *place += 1;
    }
    permute(&mut s.position, &mut s.scratch, &s.order);
    permute(&mut s.displacement, &mut s.scratch, &s.order);
    for column in 0..3 {
        permute_column(&mut s.gradient, column, &mut s.scratch, &s.order);
        permute_column(&mut s.deformation, column, &mut s.scratch, &s.order);
    }
    if !s.deviator.is_empty() {
        // Those that have appeared bring none.
        s.deviator.resize(s.position.len(), Default::default());
    }
    for part in 0..2 {
        permute_column(&mut s.deviator, part, &mut s.scratch, &s.order);
    }
    // The blocks have served; the next step finds them anew.
    permute(&mut s.id, &mut s.particle_block, &s.order);
}

fn permute<T: Copy + Default + Send + Sync>(items: &mut Vec<T>, scratch: &mut Vec<T>, order: &[u32]) {
    scratch.resize(items.len(), T::default());
    let from = &*items;
    par::each(scratch, |i, to| *to = from[order[i] as usize]);
    std::mem::swap(items, scratch);
}

/// One column at a time, so that the scratch memory is a third of the gradients'.
fn permute_column<R: Real, const N: usize>(
    items: &mut [[[R; 4]; N]],
    column: usize,
    scratch: &mut [[R; 4]],
    order: &[u32],
) {
    if items.is_empty() {
        return;
    }
    let from = &*items;
    par::each(scratch, |i, to| *to = from[order[i] as usize][column]);
    let scratch = &*scratch;
    par::each(items, |i, to| to[column] = scratch[i]);
}
