//! Sums the particles' volumes at rest on the nodes, where materials of different density, or liquids and solids, share
//! a grid: there mass alone does not tell how full a node is. Planned once per step, since positions do not change
//! within it, and only in such worlds.
//!
//! Where liquids share the grid with elastic or viscoplastic solids, it also counts the solids' particles at each node,
//! in the first channel.
//!
//! The sums occupy the grid's channels until the first iteration clears them.

use super::Kernel;
use super::p2g::{Nodes, Tile};
use super::solid::{ELASTIC, VISCOPLASTIC};
use crate::bins::{tile_first, tile_index};
use crate::cpu::gradient::{mass_of, material_of};
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel::Stencil;
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
    let (position, gradient, materials, scale) = (&s.position, &s.gradient, &s.materials, s.constants.mass_scale);
    let nodes = Nodes::<R> {
        blocks: &s.blocks,
        sources: &s.sources,
        masses: Some(&s.tally),
        borders: true,
        tiles: &mut s.tiles,
        grid: &mut s.grid,
    };
    let notes_solids = s.features.mixes();
    nodes.sum(s.occupied, |tile, origin, particles| {
        for p in particles {
            let material = &materials[material_of(&gradient[p])];
            if notes_solids && (material.model == ELASTIC || material.model == VISCOPLASTIC) {
                note_solid(tile, origin, position[p]);
            }
            scatter::<R>(tile, origin, position[p], mass_of(&gradient[p]) * material.inverse_density * scale);
        }
    });
}

/// Counts a solid particle at its nodes.
#[inline(always)]
fn note_solid<R: Real>(tile: &mut Tile<R>, origin: [u32; 3], position: [R; 4]) {
    let nodes = &mut tile[tile_first(Stencil::<R>::at(position).first, origin)..];
    let [one, ..] = R::quantise(R::V::all(R::of(1.0)));
    for n in 0..27 {
        let [count, ..] = &mut nodes[tile_index(n % 3, n / 3 % 3, n / 9)];
        *count = R::sum(*count, one);
    }
}

#[inline(always)]
fn scatter<R: Real>(tile: &mut Tile<R>, origin: [u32; 3], position: [R; 4], volume: R) {
    let stencil = Stencil::<R>::at(position);
    let [wx, wy, wz] = [stencil.along(0), stencil.along(1), stencil.along(2)];
    let first = tile_first(stencil.first, origin);
    let nodes = &mut tile[first..=first + tile_index(2, 2, 2)];
    let nothing = R::of(0.0);
    let row = R::V::from4([wx[0], wx[1], wx[2], nothing]) * R::V::all(volume);
    let mut total = [R::Sum::default(); 4];
    for (k, wz) in wz.into_iter().enumerate() {
        for (j, wy) in wy.into_iter().enumerate() {
            let part = R::quantise(row * R::V::all(wz * wy));
            for i in 0..3 {
                let [.., sum] = &mut nodes[tile_index(i, j, k)];
                *sum = R::sum(*sum, part[i]);
                total[3] = R::sum(total[3], part[i]);
            }
        }
    }
    // The remainder of rounding node by node goes to the middle node.
    let whole = R::quantise(R::V::from4([nothing, nothing, nothing, volume]));
    let [.., middle] = &mut nodes[tile_index(1, 1, 1)];
    *middle = R::sum(*middle, R::difference(whole, total)[3]);
}
