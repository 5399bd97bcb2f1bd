//! Sums the particles' volumes at rest on the nodes, where materials of different density share a grid: mass alone does not
//! tell how full a node is. Planned once per step, since positions stay put within it, and only in such worlds.
//!
//! Takes the place of the mass in the grid's channels until the first iteration clears them.

use super::Kernel;
use crate::bins::{TILE_NODES, coordinates, row_length, tile_index, tile_rows};
use crate::cpu::par;
use crate::cpu::state::{Block, CpuState, Tally, fit};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::fixed::CHUNK;
use crate::math::kernel;
use crate::math::real::{Lanes, Real};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        read(Slot::Gradient),
        read(Slot::Order),
        read(Slot::Chunks),
        write(Slot::Grid),
        write(Slot::Counters),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/volume_p2g.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    fit(&mut s.tiles, s.occupied, [[R::Sum::default(); 4]; TILE_NODES]);
    let (blocks, tally, scale) = (&s.blocks, &s.tally, s.constants.mass_scale);
    let (position, gradient, materials) = (&s.position, &s.gradient, &s.materials);
    par::each_block(&mut s.tiles, |b, tile| {
        let Block { key, start, count } = blocks[b];
        let origin = coordinates(key).map(|c| c << 2);
        tile.fill([R::Sum::default(); 4]);
        for first in (start..start + count).step_by(CHUNK as usize) {
            let mut part = [R::Sum::default(); TILE_NODES];
            for p in first as usize..(first + CHUNK).min(start + count) as usize {
                let material = &materials[gradient[p][1][3].floor_index() as usize];
                scatter::<R>(&mut part, origin, position[p], gradient[p][0][3] * material.inverse_density * scale);
            }
            Tally::add(&tally.saturated_nodes, tile.iter_mut().zip(part).map(|(node, v)| add::<R>(node, v)).sum());
        }
    });
    let (tiles, sources) = (&s.tiles, &s.sources);
    par::each_block(&mut s.grid, |b, nodes| {
        let mut saturated = 0;
        for (k, &from) in sources[b].iter().enumerate().filter(|(_, from)| (**from as usize) < tiles.len()) {
            let (tile, length) = (&tiles[from as usize], row_length(k));
            for (t, n) in tile_rows(k) {
                let row = nodes[n..n + length].iter_mut().zip(&tile[t..t + length]);
                saturated += row.map(|(node, from)| add::<R>(node, from[3])).sum::<u32>();
            }
        }
        Tally::add(&tally.saturated_nodes, saturated);
    });
}

/// Adds to a node's last channel; 1 if that left its range.
#[inline(always)]
fn add<R: Real>(node: &mut [R::Sum; 4], volume: R::Sum) -> u32 {
    let nothing = R::Sum::default();
    let (sum, wrapped) = R::merge(*node, [nothing, nothing, nothing, volume]);
    *node = sum;
    u32::from(wrapped)
}

#[inline(always)]
fn scatter<R: Real>(tile: &mut [R::Sum; TILE_NODES], origin: [u32; 3], position: [R; 4], volume: R) {
    let axis = |a: usize| {
        let (first, f) = kernel::base(position[a]);
        ((first - origin[a]) as usize, kernel::weights(f))
    };
    let ((x0, wx), (y0, wy), (z0, wz)) = (axis(0), axis(1), axis(2));
    let nothing = R::of(0.0);
    let row = R::V::from4([wx[0], wx[1], wx[2], nothing]) * R::V::all(volume);
    let mut total = [R::Sum::default(); 4];
    for (k, wz) in wz.into_iter().enumerate() {
        for (j, wy) in wy.into_iter().enumerate() {
            let part = R::quantise(row * R::V::all(wz * wy));
            let first = tile_index(x0, y0 + j, z0 + k);
            for i in 0..3 {
                tile[first + i] = R::sum(tile[first + i], part[i]);
                total[3] = R::sum(total[3], part[i]);
            }
        }
    }
    // What rounding node by node took goes to the middle node.
    let whole = R::quantise(R::V::from4([nothing, nothing, nothing, volume]));
    let middle = &mut tile[tile_index(x0 + 1, y0 + 1, z0 + 1)];
    *middle = R::sum(*middle, R::difference(whole, total)[3]);
}
