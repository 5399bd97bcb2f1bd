//! Gathers displacement and gradient for each particle.
//!
//! `u = Σ w u_i`, `D = 4 Σ w u_i ⊗ (x_i − x_p)`: exact for affine fields, because the kernel's second moment is a
//! quarter (Jiang, Schroeder, Teran 2017). Sums go axis by axis, and moments are taken about the middle node first.

use super::Kernel;
use super::believed::believed;
use super::even::{Extremes, evenness, is_even, is_loose};
use super::solid::LIQUID;
use crate::bins::{NODES, TILE_NODES, origin, row_length, tile_first, tile_index, tile_rows};
use crate::cpu::constants::{Constants, MaterialConstants};
use crate::cpu::gradient::{Gradient, evenness_mut, material_of};
use crate::cpu::par;
use crate::cpu::state::{Block, CpuState};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel::Stencil;
use crate::math::real::{Lanes, Real};
use crate::math::wide::{Wide, Work, widely};
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
    let work = Gather {
        grid: &s.grid,
        links: &s.links,
        position: &s.position,
        materials: &s.materials,
        constants: &s.constants,
        volumes: s.features.volumes,
        firm: s.features.firm(),
    };
    let particles = (&mut s.displacement[..], &mut s.gradient[..]);
    par::block_particles(&s.blocks[..s.occupied], particles, &|b, block, parts| widely(&work, (b, block, parts)));
}

/// Gathers for the particles of a block.
struct Gather<'a, R: Real> {
    grid: &'a [[[R::Sum; 4]; NODES]],
    links: &'a [[u32; 8]],
    position: &'a [[R; 4]],
    materials: &'a [MaterialConstants<R>],
    constants: &'a Constants<R>,
    /// Whether the volume fractions from the stage `volume_g2p` are kept.
    volumes: bool,
    /// Whether particles store how evenly matter lies.
    firm: bool,
}

/// Displacements and gradients of a block's particles.
type Gathered<'a, R> = (&'a mut [[R; 4]], &'a mut [Gradient<R>]);

impl<R: Real> Work<(usize, &Block, Gathered<'_, R>)> for Gather<'_, R> {
    #[inline(always)]
    fn on(&self, _: Option<Wide>, (b, block, (displacement, gradient)): (usize, &Block, Gathered<'_, R>)) {
        let tile = tile(self.grid, &self.links[b], |&[x, y, z, mass]| {
            [R::loaded(x), R::loaded(y), R::loaded(z), R::loaded(mass)]
        });
        let origin = origin(block.key);
        let position = &self.position[block.start as usize..][..block.count as usize];
        let extremes = LazyCell::new(|| Extremes::of(origin, self.constants, |node| tile[node][3]));
        for ((x, displacement), gradient) in position.iter().zip(displacement).zip(gradient) {
            let stencil = Stencil::at(*x);
            let [ux, uy, uz, mass] = gather(&tile, origin, &stencil, gradient);
            if self.firm {
                *evenness_mut(gradient) = evenness(extremes.at(stencil.first), self.constants);
            }
            let fraction = if self.volumes {
                displacement[3]
            } else {
                let material = &self.materials[material_of(gradient)];
                let even = || is_even(extremes.at(stencil.first), material.even);
                let loose = |lacking| {
                    let across = || extremes.difference(stencil.first, |node| tile[node][3]) * material.inverse_density;
                    material.model == LIQUID && is_loose(extremes.at(stencil.first), across, lacking)
                };
                believed(mass * material.inverse_density, x[3], even, loose)
            };
            *displacement = [ux, uy, uz, fraction];
        }
    }
}

/// The results of `read` for the nodes of a tile, whose blocks are `links`; the default for blocks that do not exist.
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
    let along = |a: usize| {
        let [a, b, c] = stencil.along(a);
        [R::V::all(a), R::V::all(b), R::V::all(c)]
    };
    let [wx, wy, wz] = [along(0), along(1), along(2)];
    let first = tile_first(stencil.first, origin);
    // One bounds check for all 27.
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
    // From moments about the middle node to moments about the particle.
    for ((column, moment), middle) in gradient.iter_mut().zip([x, y, z]).zip(stencil.middle.to4()) {
        let [x, y, z, _] = ((moment + sum * R::V::all(middle)) * four).to4();
        *column = [x, y, z, column[3]];
    }
    sum.to4()
}

/// Along a line of three nodes: the weighted sum, and the weighted sum of the values times their distances from the
/// middle.
#[inline(always)]
fn weighted<R: Real>([a, b, c]: [R::V; 3], w: &[R::V; 3]) -> (R::V, R::V) {
    let (a, b, c) = (a * w[0], b * w[1], c * w[2]);
    (a + b + c, c - a)
}
