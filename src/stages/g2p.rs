//! Gathers displacement and gradient for each particle.
//!
//! `u = Σ w u_i`, `D = 4 Σ w u_i ⊗ (x_i − x_p)`: exact for affine fields, because the kernel's second moment is a
//! quarter (Jiang, Schroeder, Teran 2017). Sums go axis by axis, and moments are taken about the middle node first.

use super::Kernel;
use super::believed::believed;
use super::even::{Extremes, evenness, is_even};
use crate::bins::{NODES, TILE_NODES, coordinates, row_length, tile_first, tile_index, tile_rows};
use crate::cpu::par;
use crate::cpu::state::{CpuState, Gradient};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel::Stencil;
use crate::math::real::{Lanes, Real};
use std::cell::LazyCell;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        write(Slot::Displacement),
        write(Slot::Gradient),
        read(Slot::Order),
        read(Slot::Chunks),
        read(Slot::Grid),
        write(Slot::Counters),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/g2p.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (grid, links, position, materials) = (&s.grid, &s.links, &s.position, &s.materials);
    let constants = &s.constants;
    let (volumes, firm) = (s.volumes, s.firm);
    let particles = (&mut s.displacement[..], &mut s.gradient[..]);
    par::block_particles(&s.blocks[..s.occupied], particles, &|b, block, (displacement, gradient)| {
        let tile = tile(grid, &links[b], |stored| stored.map(R::loaded));
        let origin = coordinates(block.key).map(|c| c << 2);
        let first = block.start as usize;
        let extremes = LazyCell::new(|| Extremes::of(origin, constants, |node| tile[node][3]));
        for i in 0..block.count as usize {
            let gradient = &mut gradient[i];
            let x = &position[first + i];
            let stencil = Stencil::at(*x);
            let [ux, uy, uz, mass] = gather(&tile, origin, &stencil, gradient);
            if firm {
                gradient[2][3] = evenness(extremes.at(stencil.first));
            }
            let fraction = if volumes {
                // What volume_g2p measured holds for the whole step.
                displacement[i][3]
            } else {
                let material = &materials[gradient[1][3].floor_index() as usize];
                let even = || is_even(extremes.at(stencil.first), material.even);
                believed(mass * material.inverse_density, x[3], even)
            };
            displacement[i] = [ux, uy, uz, fraction];
        }
    });
}

/// What `read` makes of the nodes of a tile, whose blocks are `links`. Blocks that there are not hold nothing.
#[inline(always)]
pub(super) fn tile<N, T: Copy + Default>(
    grid: &[[N; NODES]],
    links: &[u32; 8],
    read: impl Fn(&N) -> T,
) -> [T; TILE_NODES] {
    let mut tile = [T::default(); TILE_NODES];
    for (k, &link) in links.iter().enumerate() {
        let Some(from) = grid.get(link as usize) else { continue };
        let length = row_length(k);
        for (t, n) in tile_rows(k) {
            let row = tile[t..t + length].iter_mut().zip(&from[n..n + length]);
            row.for_each(|(node, stored)| *node = read(stored));
        }
    }
    tile
}

#[inline(always)]
pub(super) fn gather<R: Real>(
    tile: &[[R; 4]; TILE_NODES],
    origin: [u32; 3],
    stencil: &Stencil<R>,
    gradient: &mut Gradient<R>,
) -> [R; 4] {
    let [wx, wy, wz] = [0, 1, 2].map(|a| stencil.along(a).map(R::V::all));
    let first = tile_first(stencil.first, origin);
    // One look at the bounds for all 27.
    let nodes = &tile[first..=first + tile_index(2, 2, 2)];
    let none = [R::V::all(R::of(0.0)); 3];
    let [mut sums, mut xs, mut ys] = [none; 3];
    for k in 0..3 {
        let [mut rows, mut moments] = [none; 2];
        for j in 0..3 {
            let node = |i: usize| R::V::from4(nodes[tile_index(i, j, k)]);
            (rows[j], moments[j]) = weighted::<R>([node(0), node(1), node(2)], &wx);
        }
        (sums[k], ys[k]) = weighted::<R>(rows, &wy);
        xs[k] = weighted::<R>(moments, &wy).0;
    }
    let (sum, z) = weighted::<R>(sums, &wz);
    let (x, y) = (weighted::<R>(xs, &wz).0, weighted::<R>(ys, &wz).0);
    let four = R::V::all(R::of(4.0));
    // About the middle node; from there to the particle.
    for ((column, moment), middle) in gradient.iter_mut().zip([x, y, z]).zip(stencil.middle.to4()) {
        let moment = ((moment + sum * R::V::all(middle)) * four).to4();
        column[..3].copy_from_slice(&moment[..3]);
    }
    sum.to4()
}

/// Along a line of three: the weighted sum, and the weighted sum of the distances to the middle times the values.
#[inline(always)]
fn weighted<R: Real>([a, b, c]: [R::V; 3], w: &[R::V; 3]) -> (R::V, R::V) {
    let (a, b, c) = (a * w[0], b * w[1], c * w[2]);
    (a + b + c, c - a)
}
