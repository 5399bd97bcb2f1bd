//! Numbers the particles that may appear and the free slots. The shader does so by groups; this twin counts them.

use super::Kernel;
use super::emit_gate::of_groups;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[read(Slot::Constants), write(Slot::Vacancies), write(Slot::Counters)],
    over: Over::One,
    source: include_str!("../../shaders/stages/emit_scan.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let accepted: u32 = of_groups(&s.accepted).sum();
    let free = s.capacity - s.id.len() as u32 + s.vacant.len() as u32;
    let emitted = accepted.min(free);
    s.tally.emitted += u64::from(emitted);
    s.tally.refused += u64::from(accepted - emitted);
    s.tally.withheld += s.candidates.len() as u64 - u64::from(accepted);
}
