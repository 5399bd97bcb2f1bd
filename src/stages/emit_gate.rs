//! Checks for each particle that is to appear whether its place is free, and counts the accepted ones, group by group.

use super::Kernel;
use super::g2p::tile;
use super::volume_g2p::gather;
use crate::bins::{key_at, last_blocks, neighbour, origin};
use crate::cpu::state::CpuState;
use crate::gpu::layout::GROUP;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel::Stencil;
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Candidates),
        read(Slot::Table),
        read(Slot::Grid),
        write(Slot::Accepted),
        write(Slot::Vacancies),
        write(Slot::Counters),
    ],
    over: Over::Candidates,
    source: include_str!("../../shaders/stages/emit_gate.wgsl"),
};

/// How many candidates of each group may appear.
pub(crate) fn of_groups(accepted: &[u32]) -> impl Iterator<Item = u32> {
    accepted.chunks(GROUP as usize).filter_map(<[u32]>::last).copied()
}

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (table, grid, last) = (&s.table, &s.grid, last_blocks(s.constants.period));
    let free = |at: [R; 3], limit: R| {
        if limit < R::of(0.0) {
            return false;
        }
        let key = key_at(at);
        let links = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| table.find(neighbour(key, k, last)));
        let masses = tile(grid, &links, |stored| R::loaded(stored[3]));
        let [x, y, z] = at;
        gather(&masses, origin(key), &Stencil::at([x, y, z, R::of(0.0)])) <= limit
    };
    s.accepted.clear();
    for group in s.candidates.chunks(GROUP as usize) {
        let mut may_appear = 0;
        s.accepted.extend(group.iter().map(|c| {
            may_appear += u32::from(free(c.position, c.limit));
            may_appear
        }));
    }
}
