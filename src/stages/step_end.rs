//! Counts the step and the results of its iterations, and zeroes its counters. Most of the counters exist only on the
//! device: the CPU path uses the lengths of its vectors, and its timeline counts steps.

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
