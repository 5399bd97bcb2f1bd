//! Counts the step. The shader also zeroes the step's own counters; the CPU path keeps those in its vectors' lengths.

use super::Kernel;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[write(Slot::Counters), write(Slot::DispatchOccupied), write(Slot::Dispatch)],
    over: Over::One,
    source: include_str!("../../shaders/stages/step_end.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.steps += 1;
}
