//! Clears the table of blocks.

use super::Kernel;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[read(Slot::Blocks), write(Slot::Table), write(Slot::Counters)],
    over: Over::Blocks,
    source: include_str!("../../shaders/stages/bin_clear.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.table.clear();
}
