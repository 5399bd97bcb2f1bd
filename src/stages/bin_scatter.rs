//! Writes the particles of each block into its range.
//!
//! The shader writes indices; this twin moves the particles themselves, so that each core can own whole blocks.

use super::Kernel;
use crate::bins::NONE;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;
use std::ops::Range;

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
    if s.runs.iter().flatten().is_sorted_by_key(|run| run.block) {
        return;
    }
    let taking_part: u32 = s.blocks.iter().map(|b| b.count).sum();
    let mut next: Vec<u32> = s.blocks.iter().map(|b| b.start).collect();
    let mut removed = taking_part;
    s.order.resize(s.position.len(), 0);
    for run in s.runs.iter().flatten() {
        let place = if run.block == NONE { &mut removed } else { &mut next[run.block as usize] };
        let places = *place as usize..(*place + run.count) as usize;
        s.order[places].iter_mut().zip(run.first..).for_each(|(place, p)| *place = p);
        *place += run.count;
    }
    // Particles before and after this range stay where they are.
    let stays = |(place, from): (usize, &u32)| place == *from as usize;
    let first = s.order.iter().enumerate().position(|entry| !stays(entry)).unwrap_or(0);
    let moving = first..s.order.iter().enumerate().rposition(|entry| !stays(entry)).map_or(0, |last| last + 1);
    let order = &s.order[moving.clone()];
    s.scratch.resize(s.position.len(), [R::of(0.0); 4]);
    permute(&mut s.position, &mut s.scratch, order, &moving);
    permute(&mut s.displacement, &mut s.scratch, order, &moving);
    for column in 0..3 {
        permute_column(&mut s.gradient, column, &mut s.scratch, order, &moving);
        permute_column(&mut s.deformation, column, &mut s.scratch, order, &moving);
    }
    if !s.deviator.is_empty() {
        // Particles that have just appeared bring none.
        s.deviator.resize(s.position.len(), Default::default());
    }
    for part in 0..2 {
        permute_column(&mut s.deviator, part, &mut s.scratch, order, &moving);
    }
    s.scratch_id.resize(s.position.len(), 0);
    if s.features.sleep {
        permute(&mut s.rest, &mut s.scratch_id, order, &moving);
    }
    permute(&mut s.id, &mut s.scratch_id, order, &moving);
}

/// Permutes the items of the range `moving`, through as many of `scratch`.
fn permute<T: Copy + Send + Sync>(items: &mut [T], scratch: &mut [T], order: &[u32], moving: &Range<usize>) {
    let (from, scratch) = (&*items, &mut scratch[..moving.len()]);
    par::each(scratch, |i, to| *to = from[order[i] as usize]);
    let scratch = &*scratch;
    par::each(&mut items[moving.clone()], |i, to| *to = scratch[i]);
}

/// One column at a time, so that the scratch memory is a third of the gradients'.
fn permute_column<R: Real, const N: usize>(
    items: &mut [[[R; 4]; N]],
    column: usize,
    scratch: &mut [[R; 4]],
    order: &[u32],
    moving: &Range<usize>,
) {
    if items.is_empty() {
        return;
    }
    let (from, scratch) = (&*items, &mut scratch[..moving.len()]);
    par::each(scratch, |i, to| *to = from[order[i] as usize][column]);
    let scratch = &*scratch;
    par::each(&mut items[moving.clone()], |i, to| to[column] = scratch[i]);
}
