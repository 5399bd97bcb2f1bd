//! Puts the particles of blocks that are not awake to sleep, and notes which nodes they hold: blocks beside an awake
//! one still bring mass to the nodes, which stand still there; the others bring none.

use super::Kernel;
use super::bin_wake::{BESIDE, DISTURBED, WOKEN, note_around};
use crate::bins::{EDGE, NODES, NONE, TILE_EDGE, coordinates};
use crate::cpu::constants::Constants;
use crate::cpu::gradient::Gradient;
use crate::cpu::par;
use crate::cpu::state::{Block, CpuState};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::dot;
use crate::math::real::Real;
use std::sync::atomic::Ordering;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        write(Slot::Displacement),
        write(Slot::Gradient),
        write(Slot::Bin),
        read(Slot::Order),
        read(Slot::Table),
        write(Slot::Blocks),
        write(Slot::Chunks),
        write(Slot::Counters),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/bin_sleep.wgsl"),
};

/// State of a block: its particles move.
pub const AWAKE: u32 = 0;
/// Its particles sleep, beside some that are awake.
pub const BORDER: u32 = 1;
/// Its particles sleep, among others that do.
pub const DEEP: u32 = 2;
/// Bit of a particle's time at rest: it sleeps, or did in the step before, and has been stopped.
pub const ASLEEP: u32 = 1 << 31;
/// Bit of a block's [`tiles`](crate::cpu::state::Block::tiles): a tile that reaches the block brings mass.
pub const REACHED: u32 = 1 << 8;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let state = &*s;
    par::blocks(s.occupied, |b| {
        if state.awake[b].load(Ordering::Relaxed) & WOKEN != 0 {
            note_around(state, coordinates(state.blocks[b].key), BESIDE);
        }
    });
    s.asleep = 0;
    let mut sleep = Vec::with_capacity(s.occupied);
    for (block, awake) in s.blocks.iter_mut().zip(&s.awake) {
        let awake = awake.load(Ordering::Relaxed);
        block.sleep = match (awake & WOKEN != 0, awake & BESIDE != 0) {
            (true, _) => AWAKE,
            (false, true) => BORDER,
            (false, false) => DEEP,
        };
        sleep.push(block.sleep);
        s.asleep += if block.sleep == AWAKE { 0 } else { block.count };
    }
    for (block, sources) in s.blocks.iter_mut().zip(&s.sources) {
        let tiles = sources.iter().enumerate().filter(|(_, from)| **from != NONE);
        block.tiles = tiles.fold(0, |tiles, (k, from)| match sleep[*from as usize] {
            AWAKE => tiles | REACHED,
            BORDER => tiles | REACHED | 1 << k,
            _ => tiles,
        });
    }
    let (awake, constants) = (&s.awake, &s.constants);
    let particles = (&mut s.rest[..], (&mut s.displacement[..], &mut s.gradient[..]));
    par::all_block_particles(&s.blocks[..s.occupied], particles, &|b, block, (rest, (displacement, gradient))| {
        let moving = displacement.iter_mut().zip(gradient);
        if block.sleep != AWAKE {
            for (rest, (u, d)) in rest.iter_mut().zip(moving).filter(|(rest, _)| **rest & ASLEEP == 0) {
                *rest = constants.rest_needed | ASLEEP;
                stop(u, d);
            }
        } else if awake[b].load(Ordering::Relaxed) & DISTURBED != 0 {
            rest.fill(0);
        } else {
            rest.iter_mut().zip(moving).for_each(|(rest, (u, _))| *rest = rested(*rest, *u, constants));
        }
    });
}

/// Stops a particle that sleeps.
#[inline(always)]
fn stop<R: Real>(u: &mut [R; 4], d: &mut Gradient<R>) {
    if u[..3].iter().any(|c| *c != R::of(0.0)) {
        u[..3].fill(R::of(0.0));
        d.iter_mut().for_each(|column| column[..3].fill(R::of(0.0)));
    }
}

/// How long a particle has been at rest by now, in µs, up to the time that sleep needs. A particle whose fraction is
/// still 0 has just appeared and has not been measured on the grid.
#[inline(always)]
pub(super) fn rested<R: Real>(before: u32, [x, y, z, fraction]: [R; 4], constants: &Constants<R>) -> u32 {
    let moves = dot([x, y, z], [x, y, z]) > constants.rest_square;
    if moves || fraction == R::of(0.0) {
        0
    } else {
        ((before & !ASLEEP) + constants.rest_lasted).min(constants.rest_needed)
    }
}

impl Block {
    /// Whether its nodes have no mass, because every block that could bring some sleeps.
    #[inline(always)]
    pub fn is_idle(&self) -> bool {
        self.tiles == 0
    }

    /// Whether one of its nodes stands still: a tile of sleeping particles reaches it.
    #[inline(always)]
    pub fn stands_still(&self, node: usize) -> bool {
        // Tiles of the blocks below reach two nodes far into this one.
        let reached = |along: usize| along % EDGE < TILE_EDGE - EDGE;
        let mut mask = 1;
        mask |= if reached(node) { mask << 1 } else { 0 };
        mask |= if reached(node / EDGE) { mask << 2 } else { 0 };
        mask |= if reached(node / (EDGE * EDGE)) { mask << 4 } else { 0 };
        self.tiles & mask != 0
    }

    /// Stops the nodes that stand still.
    #[inline(always)]
    pub fn hold<R: Real>(&self, nodes: &mut [[R; 4]; NODES]) {
        if self.tiles & !REACHED != 0 {
            let still = nodes.iter_mut().enumerate().filter(|(n, _)| self.stands_still(*n));
            still.for_each(|(_, node)| node[..3].fill(R::of(0.0)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bins::{node_index, row_length, tile_rows};

    /// A node stands still where such a tile reaches it, with tiles placed as by the transfers.
    #[test]
    fn tiles_that_sleep_hold_their_nodes() {
        for k in 0..8 {
            let mut held = [false; NODES];
            for (_, node) in tile_rows(k) {
                held[node..node + row_length(k)].fill(true);
            }
            for (node, held) in held.into_iter().enumerate() {
                let block = Block { tiles: 1 << k, ..Block::new(0, 0) };
                assert_eq!(block.stands_still(node), held, "node {node} of the tile's block {k}");
            }
        }
        let block = |tiles| Block { tiles, ..Block::new(0, 0) };
        let node = node_index(0, 3, 3);
        assert!(block(0b1_1000_0010).stands_still(node) && !block(0b1_1000_0000).stands_still(node));
    }
}
