//! Puts each particle that appears into the free slot of the same number.

use super::Kernel;
use super::emit_gate::of_groups;
use crate::cpu::gradient::undeformed;
use crate::cpu::state::CpuState;
use crate::gpu::layout::GROUP;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Candidates),
        read(Slot::Accepted),
        read(Slot::Vacancies),
        write(Slot::Position),
        write(Slot::Displacement),
        write(Slot::Gradient),
        write(Slot::Deformation).with_deformation(),
        write(Slot::Counters),
    ],
    over: Over::SlotGroups,
    source: include_str!("../../shaders/stages/emit_place.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let accepted: u32 = of_groups(&s.accepted).sum();
    let never_used = s.capacity as usize - s.id.len();
    let fresh = (accepted as usize).saturating_sub(s.vacant.len()).min(never_used);
    s.reserve(fresh);
    let mut placed = 0;
    for c in 0..s.candidates.len() {
        let before = if c.is_multiple_of(GROUP as usize) { 0 } else { s.accepted[c - 1] };
        if s.accepted[c] == before {
            continue;
        }
        let number = placed;
        placed += 1;
        let particle = s.candidates[c].particle();
        if let Some(&(_, place)) = s.vacant.get(number) {
            let place = place as usize;
            (s.position[place], s.displacement[place], s.gradient[place]) = particle;
            if s.features.deforms() {
                s.deformation[place] = undeformed();
            }
        } else if number - s.vacant.len() < fresh {
            s.push(particle);
        }
    }
}
