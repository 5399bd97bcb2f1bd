//! Counts the step and zeroes its counters, which only the device keeps: the CPU path has its vectors' lengths.

use super::Kernel;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        write(Slot::Counters),
        write(Slot::DispatchOccupied),
        write(Slot::Dispatch),
        write(Slot::Solve).with_implicit(),
    ],
    over: Over::One,
    source: include_str!("../../shaders/stages/step_end.wgsl"),
};

/// Nothing: the timeline counts steps.
pub(crate) fn run<R: Real>(_: &mut CpuState<R>) {}
