//! Finds or makes the block of every particle and counts the block's particles. What is not made of numbers is taken out before it
//! can reach others.

use super::Kernel;
use super::bin_sleep::rested;
use super::sound::sound;
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

/// In the place of a key: the particle is not made of numbers. No key is that large.
const UNSOUND: u32 = NONE - 1;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (position, displacement, gradient) = (&s.position, &s.displacement, &s.gradient);
    // Keys first, on all cores; then blocks in the order of their first particle.
    par::each(&mut s.particle_block, |p, key| {
        let [x, y, z, ratio] = position[p];
        *key = if ratio <= R::of(0.0) {
            NONE
        } else if sound(&position[p], &displacement[p], &gradient[p]) {
            key_at([x, y, z])
        } else {
            UNSOUND
        };
    });
    s.rest.resize(if s.sleep { s.position.len() } else { 0 }, 0);
    let constants = &s.constants;
    par::each(&mut s.rest, |p, rest| *rest = rested(*rest, displacement[p], constants));
    s.table.clear();
    s.blocks.clear();
    s.restless.clear();
    // Particles of a block mostly follow each other: what they add up to is noted once for each stretch of them.
    let mut run = Run { key: NONE, block: 0, count: 0, restless: false };
    for (p, entry) in s.particle_block.iter_mut().enumerate() {
        if *entry == NONE {
            continue;
        }
        if *entry == UNSOUND {
            *entry = NONE;
            s.position[p][3] = R::of(QUARANTINED);
            Tally::add(&s.tally.quarantined, 1);
            continue;
        }
        if *entry != run.key {
            run.note(&mut s.blocks, &mut s.restless);
            let block = s.table.find_or_insert(*entry, s.blocks.len() as u32);
            if block as usize == s.blocks.len() {
                s.blocks.push(Block::new(*entry, 0));
                s.restless.push(false);
            }
            run = Run { key: *entry, block, count: 0, restless: false };
        }
        *entry = run.block;
        run.count += 1;
        run.restless |= s.rest.get(p).is_some_and(|rest| *rest < s.constants.rest_needed);
    }
    run.note(&mut s.blocks, &mut s.restless);
    s.occupied = s.blocks.len();
}

/// Particles of a block that follow each other.
struct Run {
    key: u32,
    block: u32,
    count: u32,
    restless: bool,
}

impl Run {
    fn note(&self, blocks: &mut [Block], restless: &mut [bool]) {
        if self.count > 0 {
            blocks[self.block as usize].count += self.count;
            restless[self.block as usize] |= self.restless;
        }
    }
}
