//! Counts the free slots. The shader counts them by groups of slots; this twin lists the slots that were used before.

use super::Kernel;
use crate::cpu::state::{CpuState, QUARANTINED};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[read(Slot::Constants), read(Slot::Position), write(Slot::Vacancies)],
    over: Over::SlotGroups,
    source: include_str!("../../shaders/stages/emit_count.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let free = |x: &[R; 4]| x[3] <= R::of(0.0) && x[3] != R::of(QUARANTINED);
    s.vacant.clear();
    let places = (0..).zip(&s.id).zip(&s.position);
    s.vacant.extend(places.filter(|(_, x)| free(x)).map(|((place, slot), _)| (*slot, place)));
    s.vacant.sort_unstable();
}
