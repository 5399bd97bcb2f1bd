//! Counts the step and what its iterations have come to, and zeroes its counters. Most of them only the device keeps: the CPU path has its
//! vectors' lengths, and its timeline counts steps.

use super::Kernel;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, write};
use crate::math::real::Real;
use crate::report::share;

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

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.largest_motion = None;
    let (solve, tally) = (&s.solve, &mut s.tally);
    tally.iterations += u64::from(solve.count);
    tally.capped += u64::from(solve.active);
    tally.worst_change = tally.worst_change.max(share(solve.change, solve.motion).f64());
}
