//! Gathers the volume fraction at each particle from the sums of [`volume_p2g`](super::volume_p2g).

use super::Kernel;
use super::believed::{believed, believed_beside};
use super::even::{Extremes, is_even, is_even_beside, is_loose};
use super::g2p::tile;
use super::solid::LIQUID;
use crate::bins::{TILE_NODES, origin, tile_first, tile_index};
use crate::cpu::gradient::material_of;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel::Stencil;
use crate::math::real::Real;
use std::cell::LazyCell;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Position),
        write(Slot::Displacement),
        read(Slot::Order),
        read(Slot::Chunks),
        read(Slot::Grid),
        write(Slot::Counters),
        read(Slot::Gradient),
        read(Slot::Materials),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/volume_g2p.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (grid, links, position) = (&s.grid, &s.links, &s.position);
    let (gradient, materials) = (&s.gradient, &s.materials);
    let constants = &s.constants;
    let unit = R::of(1.0) / s.constants.mass_scale;
    let mixes = s.features.mixes();
    par::block_particles(&s.blocks[..s.occupied], &mut s.displacement[..], &|b, block, displacement| {
        let tile = tile(grid, &links[b], |sums| R::dequantise(sums[3], true) * unit);
        let origin = origin(block.key);
        // Negated where there are solids.
        let solids = LazyCell::new(|| {
            let counts = super::g2p::tile(grid, &links[b], |sums| R::dequantise(sums[0], false));
            std::array::from_fn(|n| if counts[n] > R::of(0.0) { -tile[n] } else { tile[n] })
        });
        let extremes = LazyCell::new(|| Extremes::of(origin, constants, |node| tile[node]));
        let first = block.start as usize;
        for ((displacement, position), gradient) in
            displacement.iter_mut().zip(&position[first..]).zip(&gradient[first..])
        {
            let material = &materials[material_of(gradient)];
            let stencil = Stencil::at(*position);
            let fraction = gather(&tile, origin, &stencil);
            let even = || is_even(extremes.at(stencil.first), material.even);
            let loose = |lacking| {
                let across = || extremes.difference(stencil.first, |node| tile[node]);
                material.model == LIQUID && is_loose(extremes.at(stencil.first), across, lacking)
            };
            displacement[3] = if mixes {
                let beside = |even| is_even_beside(&solids, origin, stencil.first, constants, material.even, even);
                believed_beside(fraction, position[3], even, loose, beside)
            } else {
                believed(fraction, position[3], even, loose)
            };
        }
    });
}

/// The value at a stencil's point of a tile that begins at the node `origin`.
#[inline(always)]
pub(super) fn gather<R: Real>(tile: &[R; TILE_NODES], origin: [u32; 3], stencil: &Stencil<R>) -> R {
    let [wx, wy, wz] = [stencil.along(0), stencil.along(1), stencil.along(2)];
    let first = tile_first(stencil.first, origin);
    let nodes = &tile[first..=first + tile_index(2, 2, 2)];
    let row = |j: usize, k: usize| {
        let node = |i: usize| nodes[tile_index(i, j, k)];
        node(0) * wx[0] + node(1) * wx[1] + node(2) * wx[2]
    };
    let plane = |k: usize| row(0, k) * wy[0] + row(1, k) * wy[1] + row(2, k) * wy[2];
    plane(0) * wz[0] + plane(1) * wz[1] + plane(2) * wz[2]
}
