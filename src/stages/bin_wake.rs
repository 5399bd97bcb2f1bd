//! Notes which blocks are awake: those with particles that have not been at rest for long enough, those around them, and
//! those that something disturbs.

use super::Kernel;
use crate::bins::{LAST_BLOCK, coordinates, key, last_blocks, wrapped};
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;
use std::sync::atomic::{AtomicU32, Ordering};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Disturbances),
        read(Slot::Blocks),
        write(Slot::Table),
        write(Slot::Counters),
    ],
    over: Over::Nodes,
    source: include_str!("../../shaders/stages/bin_wake.wgsl"),
};

/// Bit of a block, on devices: some of its particles have not been at rest for long enough to sleep.
pub const RESTLESS: u32 = 1;
/// It is awake.
pub const WOKEN: u32 = 1 << 1;
/// Something disturbs it.
pub const DISTURBED: u32 = 1 << 2;
/// On devices: some of its particles have been at rest for long enough, but did not sleep in the step before.
pub const DROWSY: u32 = 1 << 3;
/// On the CPU path: it is awake or beside one that is.
pub const BESIDE: u32 = 1 << 4;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.awake.clear();
    s.awake.resize_with(s.occupied, AtomicU32::default);
    let state = &*s;
    par::blocks(s.occupied, |b| {
        let at = coordinates(state.blocks[b].key);
        if state.disturbances.iter().any(|disturbance| disturbance.holds(at)) {
            state.awake[b].fetch_or(WOKEN | DISTURBED, Ordering::Relaxed);
        }
        if state.restless[b] {
            note_around(state, at, WOKEN);
        }
    });
}

/// Notes bits at the occupied ones of a block and those around it.
pub(super) fn note_around<R: Real>(s: &CpuState<R>, at: [u32; 3], bits: u32) {
    let last = last_blocks(s.constants.period);
    let occupied =
        around(at).map(|at| s.table.find(key(wrapped(at, last))) as usize).filter(|block| *block < s.occupied);
    occupied.for_each(|block| {
        s.awake[block].fetch_or(bits, Ordering::Relaxed);
    });
}

/// A block and those around it.
fn around(at: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..27u32).filter_map(move |n| {
        let [x, y, z] = [n % 3, n / 3 % 3, n / 9];
        let there = [at[0] + x, at[1] + y, at[2] + z];
        there.iter().all(|c| (1..=LAST_BLOCK + 1).contains(c)).then(|| there.map(|c| c - 1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_end_at_the_lattice() {
        assert_eq!(around([0, 5, 1023]).count(), 2 * 3 * 2);
        assert_eq!(around([7, 7, 7]).count(), 27);
    }
}
