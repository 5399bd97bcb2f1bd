//! Finds or makes the block of every particle and counts the block's particles. Particles with a NaN, an infinite number
//! or a volume ratio that is none are quarantined before they can affect others.

use super::Kernel;
use super::bin_sleep::{ASLEEP, rested};
use super::sound::{is_fate, sound};
use crate::bins::{NONE, key_at};
use crate::cpu::par;
use crate::cpu::state::{Block, CpuState, QUARANTINED, Tally};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        write(Slot::Position),
        read(Slot::Displacement),
        read(Slot::Gradient),
        write(Slot::Bin),
        write(Slot::Table),
        write(Slot::Blocks),
        write(Slot::Counters),
        write(Slot::DispatchOccupied),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/bin_insert.wgsl"),
};

/// Stands in for the key of a particle with a NaN, an infinite number or a volume ratio that is none. No key is that large.
const UNSOUND: u32 = NONE - 1;

/// Particles that one task searches for runs.
const STRETCH: usize = 1024;

/// Consecutive particles of one block. Particles are stored by block, so that only those that have left their block
/// interrupt a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Run {
    /// The block's key, later its number; `NONE` for particles that take no part.
    pub block: u32,
    pub first: u32,
    pub count: u32,
    /// Whether one of them has not rested for long enough.
    restless: bool,
}

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.rest.resize(if s.features.sleep { s.position.len() } else { 0 }, 0);
    // Runs first, on all cores; then blocks in the order of their first particle.
    let mut runs = std::mem::take(&mut s.runs);
    runs.resize(s.position.len().div_ceil(STRETCH), Vec::new());
    let state = &*s;
    par::each_block(&mut runs[..], |i, runs| find_runs(state, i * STRETCH, runs));
    s.table.clear();
    s.blocks.clear();
    s.restless.clear();
    let (mut last, mut block) = (NONE, NONE);
    for run in runs.iter_mut().flatten() {
        if run.block == UNSOUND {
            let unsound = &mut s.position[run.first as usize..(run.first + run.count) as usize];
            unsound.iter_mut().for_each(|position| position[3] = R::of(QUARANTINED));
            Tally::add(&s.tally.quarantined, run.count);
            run.block = NONE;
        }
        if run.block == NONE {
            continue;
        }
        if run.block != last {
            (last, block) = (run.block, s.table.find_or_insert(run.block, s.blocks.len() as u32));
            if block as usize == s.blocks.len() {
                s.blocks.push(Block::new(last, 0));
                s.restless.push(false);
            }
        }
        run.block = block;
        s.blocks[block as usize].count += run.count;
        s.restless[block as usize] |= run.restless;
    }
    s.runs = runs;
    s.occupied = s.blocks.len();
}

/// Finds the runs of the stretch that begins at the particle `first`.
fn find_runs<R: Real>(s: &CpuState<R>, first: usize, runs: &mut Vec<Run>) {
    runs.clear();
    for p in first..s.position.len().min(first + STRETCH) {
        let [x, y, z, ratio] = s.position[p];
        let rest = s.rest.get(p);
        // Nothing has touched what slept.
        let slept = || rest.is_some_and(|rest| rest & ASLEEP != 0);
        let key = if is_fate(ratio) {
            NONE
        } else if R::of(0.0) < ratio && (slept() || sound(&s.position[p], &s.displacement[p], &s.gradient[p])) {
            key_at([x, y, z])
        } else {
            UNSOUND
        };
        // Stored by bin_sleep only, as on devices.
        let restless =
            rest.is_some_and(|rest| rested(*rest, s.displacement[p], &s.constants) < s.constants.rest_needed);
        match runs.last_mut() {
            Some(run) if run.block == key => {
                run.count += 1;
                run.restless |= restless;
            }
            _ => runs.push(Run { block: key, first: p as u32, count: 1, restless }),
        }
    }
}
