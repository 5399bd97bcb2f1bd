//! Gathers displacement and gradient for each particle.
//!
//! `u = Σ w u_i`, `D = 4 Σ w u_i ⊗ (x_i − x_p)`: exact for affine fields, because the kernel's second moment is a
//! quarter (Jiang, Schroeder, Teran 2017). Sums go axis by axis.

use super::Kernel;
use super::believed::believed;
use crate::bins::{NODES, TILE_NODES, coordinates, row_length, tile_index, tile_rows};
use crate::cpu::par;
use crate::cpu::state::{CpuState, Gradient};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel;
use crate::math::real::{Lanes, Real};

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
    let volumes = s.volumes;
    let particles = (&mut s.displacement[..], &mut s.gradient[..]);
    par::block_particles(&s.blocks[..s.occupied], particles, &|b, block, (displacement, gradient)| {
        let tile = tile(grid, &links[b], |stored| stored.map(R::loaded));
        let origin = coordinates(block.key).map(|c| c << 2);
        let first = block.start as usize;
        for i in 0..block.count as usize {
            let gradient = &mut gradient[i];
            let x = &position[first + i];
            let [ux, uy, uz, mass] = gather(&tile, origin, *x, gradient);
            let fraction = if volumes {
                // What volume_g2p measured holds for the whole step.
                displacement[i][3]
            } else {
                let unit = materials[gradient[1][3].floor_index() as usize].inverse_density;
                believed(mass * unit, x, origin, constants, |node| tile[node][3] * unit)
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
    position: [R; 4],
    gradient: &mut Gradient<R>,
) -> [R; 4] {
    let axis = |a: usize| {
        let (first, f) = kernel::base(position[a]);
        let w = kernel::weights(f);
        let r = [-f, R::of(1.0) - f, R::of(2.0) - f];
        ((first - origin[a]) as usize, w.map(R::V::all), [0, 1, 2].map(|i| R::V::all(w[i] * r[i])))
    };
    let ((x0, wx, mx), (y0, wy, my), (z0, wz, mz)) = (axis(0), axis(1), axis(2));
    let zero = R::V::all(R::of(0.0));
    let [mut sum, mut sum_x, mut sum_y, mut sum_z] = [zero; 4];
    for k in 0..3 {
        let [mut plane, mut plane_x, mut plane_y] = [zero; 3];
        for j in 0..3 {
            let first = tile_index(x0, y0 + j, z0 + k);
            let nodes = &tile[first..first + 3];
            let n = [R::V::from4(nodes[0]), R::V::from4(nodes[1]), R::V::from4(nodes[2])];
            let row = n[0] * wx[0] + n[1] * wx[1] + n[2] * wx[2];
            let row_x = n[0] * mx[0] + n[1] * mx[1] + n[2] * mx[2];
            plane += row * wy[j];
            plane_x += row_x * wy[j];
            plane_y += row * my[j];
        }
        sum += plane * wz[k];
        sum_x += plane_x * wz[k];
        sum_y += plane_y * wz[k];
        sum_z += plane * mz[k];
    }
    let four = R::V::all(R::of(4.0));
    for (column, moment) in gradient.iter_mut().zip([sum_x, sum_y, sum_z]) {
        let moment = (moment * four).to4();
        column[..3].copy_from_slice(&moment[..3]);
    }
    sum.to4()
}
