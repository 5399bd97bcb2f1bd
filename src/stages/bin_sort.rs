//! Sorts the particles of each chunk by cell, and notes the blocks of its tile. The CPU path needs no sorting: its
//! tiles fit into the first-level cache.

use super::Kernel;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Position),
        write(Slot::Order),
        write(Slot::Chunks),
        read(Slot::Links),
        read(Slot::Table),
        write(Slot::Counters),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/bin_sort.wgsl"),
};

/// Nothing: the order of particles within a block is of no consequence.
pub(crate) fn run<R: Real>(_: &mut CpuState<R>) {}
