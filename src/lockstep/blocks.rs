//! Comparison of the shared pressures of blocks.

use super::compared::{Compared, floats, integers};
use crate::Result;
use crate::bins::TILE_NODES;
use crate::cpu::CpuSolver;
use crate::gpu::layout::coupling::{IMAGES, MATRIX, VECTORS};
use crate::gpu::layout::{Block, BlockPressure};
use crate::gpu::slots::Slot;
use crate::headless::Headless;
use crate::stages::bin_sleep::AWAKE;

/// A value with its block and its place there.
type At<T> = ((u32, usize), T);

fn of_block<T>(key: u32, values: impl IntoIterator<Item = T>) -> impl Iterator<Item = At<T>> {
    values.into_iter().enumerate().map(move |(i, value)| ((key, i), value))
}

/// The push of the liquids of each block, none where it sleeps. `active` are the device's blocks, the occupied ones
/// first.
pub(super) fn tiles(cpu: &CpuSolver<f32>, gpu: &Headless, active: &[Block]) -> Result<Compared> {
    let s = &cpu.state;
    let here = s.blocks.iter().zip(&s.block_tiles).flat_map(|(b, tile)| {
        let pushes = tile.iter().flat_map(|node| [node[0], node[1], node[2]]);
        of_block(b.key, pushes.map(|push| if b.sleep == AWAKE { push } else { 0 }))
    });
    let there: Vec<i32> = gpu.read(Slot::BlockTiles)?;
    let there = active[..s.occupied].iter().zip(there.chunks(3 * TILE_NODES));
    Ok(integers(here, there.flat_map(|(b, tile)| of_block(b.key, tile.iter().copied()))))
}

/// The couplings between their pressures.
pub(super) fn couplings(cpu: &CpuSolver<f32>, gpu: &Headless, active: &[Block]) -> Result<Compared> {
    let s = &cpu.state;
    let here = s.blocks.iter().zip(&s.couplings);
    let upper = |m: [f32; 64]| (0..8).flat_map(move |row| (row..8).map(move |column| m[8 * row + column]));
    let here = here.flat_map(|(b, c)| of_block(b.key, upper(c.matrix).chain(c.motion)));
    let vectors: &[[f32; 4]] = &gpu.read(Slot::Couplings)?;
    let blocks = vectors.len() / VECTORS;
    // The matrix and, behind it, the motion.
    let of = |block| (MATRIX..IMAGES).flat_map(move |which| vectors[which * blocks + block]);
    Ok(floats(here, active.iter().enumerate().flat_map(|(i, b)| of_block(b.key, of(i)))))
}

/// The pressures of the blocks that take part.
pub(super) fn pressures(cpu: &CpuSolver<f32>, gpu: &Headless, active: &[Block]) -> Result<Compared> {
    let s = &cpu.state;
    let here = s.blocks.iter().zip(&s.block_pressures).filter(|(_, p)| p.volume > 0.0);
    let here = here.flat_map(|(b, p)| {
        of_block(b.key, [p.volume, p.load, p.most, p.compliance, p.inverse, p.found, p.residual, p.direction])
    });
    let there: Vec<BlockPressure> = gpu.read(Slot::BlockPressures)?;
    let there = active[..s.occupied].iter().zip(there).filter(|(_, p)| p.volume > 0.0).flat_map(|(b, p)| {
        of_block(b.key, [p.volume, p.load, p.most, p.compliance, p.inverse, p.found, p.residual, p.direction])
    });
    Ok(floats(here, there))
}
