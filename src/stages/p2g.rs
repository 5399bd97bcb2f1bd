//! Sums the particles' mass and momentum on the nodes.
//!
//! Each node gets `m w` and `m w (u + D (x_i − x_p))`, scaled and rounded to integers one particle at a time, so that
//! the sums do not depend on the order of the particles (see [`crate::math::fixed`]).

use super::Kernel;
use super::bin_sleep::{AWAKE, BORDER};
use super::motion::{excess, momentum_scale, square};
use crate::bins::{NODES, TILE_NODES, origin, row_length, tile_first, tile_index, tile_rows};
use crate::cpu::constants::Constants;
use crate::cpu::gradient::{Gradient, mass_of};
use crate::cpu::par;
use crate::cpu::state::{Block, CpuState, Tally, fit};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::fixed::CHUNK;
use crate::math::kernel::Stencil;
use crate::math::linear::dot;
use crate::math::real::{Lanes, Real};
use crate::math::wide::{Wide, Work, widely};
use std::ops::Range;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Position),
        read(Slot::Displacement),
        read(Slot::Gradient),
        read(Slot::Order),
        read(Slot::Chunks),
        write(Slot::Grid),
        write(Slot::Counters),
        read(Slot::Materials).with_fused(),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/p2g.wgsl"),
};

/// Least number of blocks whose tiles are summed at a time: as many as stay in the cache until they are on the grid.
/// More in large scenes, since each batch asks all blocks which tiles reach them.
const BATCH: usize = 256;
const MOST_BATCHES: usize = 8;

/// Sums of a tile's nodes.
pub(super) type Tile<R> = [[<R as Real>::Sum; 4]; TILE_NODES];

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (position, displacement, gradient) = (&s.position[..], &s.displacement[..], &s.gradient[..]);
    let (constants, tally) = (&s.constants, &s.tally);
    // Where the largest motion is known, gradients are within bounds.
    let (bounds, scale) = (s.largest_motion.is_none(), momentum_scale(s.largest_motion, constants));
    let nodes = Nodes::<R> {
        blocks: &s.blocks,
        sources: &s.sources,
        masses: Some(tally),
        borders: true,
        tiles: &mut s.tiles,
        grid: &mut s.grid,
    };
    let scatter = Scatter { position, displacement, gradient, constants, tally, bounds, scale };
    nodes.sum(s.occupied, |tile, origin, particles| widely(&scatter, (tile, origin, particles)));
}

/// Adds particles to the tile of their block.
struct Scatter<'a, R: Real> {
    position: &'a [[R; 4]],
    displacement: &'a [[R; 4]],
    gradient: &'a [Gradient<R>],
    constants: &'a Constants<R>,
    tally: &'a Tally,
    /// Whether gradients must be bounded.
    bounds: bool,
    /// Units per unit of momentum.
    scale: R,
}

impl<R: Real> Work<(&mut Tile<R>, [u32; 3], Range<usize>)> for Scatter<'_, R> {
    #[inline(always)]
    fn on(&self, wide: Option<Wide>, (tile, origin, particles): (&mut Tile<R>, [u32; 3], Range<usize>)) {
        let Scatter { constants, scale, .. } = *self;
        for p in particles {
            let mass = mass_of(&self.gradient[p]);
            let u = within_bound(&self.displacement[p], constants, self.tally);
            let [x, y, z] = &self.gradient[p];
            let [mut x, mut y, mut z] = [R::V::from4(*x), R::V::from4(*y), R::V::from4(*z)];
            let beyond = || excess(square(&self.gradient[p]), constants, self.tally);
            if let Some(factor) = self.bounds.then(beyond).flatten() {
                let factor = R::V::all(factor);
                [x, y, z] = [x * factor, y * factor, z * factor];
            }
            let momentum = mass * scale;
            let value = u * R::V::from4([momentum, momentum, momentum, mass * constants.mass_scale]);
            // Clears the columns' fourth lanes.
            let unit = R::V::from4([momentum, momentum, momentum, R::of(0.0)]);
            scatter_affine::<R>(wide, tile, origin, self.position[p], value, [x * unit, y * unit, z * unit]);
        }
    }
}

/// The sums on the nodes that particles are added to.
pub(super) struct Nodes<'a, R: Real> {
    pub blocks: &'a [Block],
    pub sources: &'a [[u32; 8]],
    /// Where the last channel holds masses, the tally of sums that leave their range.
    pub masses: Option<&'a Tally>,
    /// Whether sleeping particles beside awake ones contribute.
    pub borders: bool,
    pub tiles: &'a mut Vec<Tile<R>>,
    pub grid: &'a mut [[[R::Sum; 4]; NODES]],
}

impl<R: Real> Nodes<'_, R> {
    /// Calls `scatter` to add particles to the tile of their block, given its origin, and adds the tiles to the grid.
    pub fn sum(self, occupied: usize, scatter: impl Fn(&mut Tile<R>, [u32; 3], Range<usize>) + Sync) {
        let Nodes { blocks, sources, masses, borders, tiles, grid } = self;
        let brings = |block: usize| match blocks[block].sleep {
            AWAKE => true,
            BORDER => borders,
            _ => false,
        };
        let note = |saturated| {
            if let Some(tally) = masses {
                Tally::add(&tally.saturated_nodes, saturated);
            }
        };
        let batch = occupied.div_ceil(MOST_BATCHES).max(BATCH);
        fit(tiles, batch.min(occupied), empty::<R>());
        for begin in (0..occupied).step_by(batch) {
            let end = (begin + batch).min(occupied);
            par::each_block(&mut tiles[..end - begin], |i, tile| {
                let b = begin + i;
                if !brings(b) {
                    return;
                }
                let Block { key, start, count, .. } = blocks[b];
                let origin = origin(key);
                *tile = empty::<R>();
                for first in (start..start + count).step_by(CHUNK as usize) {
                    let chunk = first as usize..(first + CHUNK).min(start + count) as usize;
                    let mut part = empty::<R>();
                    let target = if first == start { &mut *tile } else { &mut part };
                    scatter(target, origin, chunk);
                    if first != start {
                        let saturated =
                            tile.iter_mut().zip(&part).filter_map(|(a, b)| merge::<R>(a, b).then_some(())).count();
                        note(saturated as u32);
                    }
                }
            });
            let tiles = &*tiles;
            par::each_block(&mut *grid, |b, nodes| {
                let mut saturated = 0;
                for (k, &from) in sources[b].iter().enumerate() {
                    let from = from as usize;
                    if !(begin..end).contains(&from) || !brings(from) {
                        continue;
                    }
                    let tile = &tiles[from - begin];
                    let length = row_length(k);
                    for (t, n) in tile_rows(k) {
                        for (sum, part) in nodes[n..n + length].iter_mut().zip(&tile[t..t + length]) {
                            saturated += u32::from(merge::<R>(sum, part));
                        }
                    }
                }
                note(saturated);
            });
        }
    }
}

fn empty<R: Real>() -> Tile<R> {
    [[R::Sum::default(); 4]; TILE_NODES]
}

/// Adds `part` to `sum`; true if the mass channel left its range.
#[inline(always)]
fn merge<R: Real>(sum: &mut [R::Sum; 4], part: &[R::Sum; 4]) -> bool {
    let (merged, wrapped) = R::merge(*sum, *part);
    *sum = merged;
    wrapped
}

/// Adds a particle's `value`, which changes by `columns` per cell along the axes, to the 27 nodes.
#[inline(always)]
pub(super) fn scatter_affine<R: Real>(
    wide: Option<Wide>,
    tile: &mut Tile<R>,
    origin: [u32; 3],
    position: [R; 4],
    value: R::V,
    columns: [R::V; 3],
) {
    let stencil = Stencil::at(position);
    let [wx, wy, wz] = [stencil.along(0), stencil.along(1), stencil.along(2)];
    let [rx, ry, rz, _] = stencil.middle.to4();
    let [rx, ry, rz] = [R::V::all(rx), R::V::all(ry), R::V::all(rz)];
    let [dx, dy, dz] = columns;
    let first = tile_first(stencil.first, origin);
    // One bounds check for all 27.
    let nodes = &mut tile[first..=first + tile_index(2, 2, 2)];

    let middle = value + dx * rx + dy * ry + dz * rz;
    let strides = [tile_index(0, 1, 0), tile_index(0, 0, 1)];
    let rows = match wide {
        Some(wide) => R::add_rows(wide, nodes, strides, middle, columns, [wx, wy, wz]),
        None => None,
    };
    let total = match rows {
        Some(total) => total,
        None => add_nodes::<R>(nodes, middle, columns, [wx, wy, wz]),
    };
    // The particle's whole less the sum of its rounded parts goes to the middle node: otherwise many small parts that
    // all round to nothing would slow the matter.
    let remainder = R::difference(R::quantise(value), total);
    add::<R>(&mut nodes[tile_index(1, 1, 1)], remainder);
}

/// Adds to 27 nodes a value that is `middle` at the middle one and changes by `columns` from node to node, weighted and
/// rounded; returns the sum of all parts.
#[inline(always)]
fn add_nodes<R: Real>(
    nodes: &mut [[R::Sum; 4]],
    middle: R::V,
    [dx, dy, dz]: [R::V; 3],
    [wx, wy, wz]: [[R; 3]; 3],
) -> [R::Sum; 4] {
    let mut total = [R::Sum::default(); 4];
    for (k, plane) in [middle - dz, middle, middle + dz].into_iter().enumerate() {
        for (j, row) in [plane - dy, plane, plane + dy].into_iter().enumerate() {
            let weight = wz[k] * wy[j];
            for (i, node) in [row - dx, row, row + dx].into_iter().enumerate() {
                let part = R::quantise(node * R::V::all(weight * wx[i]));
                add::<R>(&mut nodes[tile_index(i, j, k)], part);
                add::<R>(&mut total, part);
            }
        }
    }
    total
}

#[inline(always)]
fn add<R: Real>(sum: &mut [R::Sum; 4], part: [R::Sum; 4]) {
    for (sum, part) in sum.iter_mut().zip(part) {
        *sum = R::sum(*sum, part);
    }
}

/// A displacement within the bound that the fixed-point scale is made for, with 1 as the fourth lane.
#[inline(always)]
fn within_bound<R: Real>(&[x, y, z, _]: &[R; 4], constants: &Constants<R>, tally: &Tally) -> R::V {
    let length = dot([x, y, z], [x, y, z]);
    let bound = constants.max_displacement;
    let factor = if length > bound * bound {
        Tally::add(&tally.speed_clamped, 1);
        bound / length.sqrt()
    } else {
        R::of(1.0)
    };
    R::V::from4([x, y, z, R::of(1.0)]) * R::V::from4([factor, factor, factor, R::of(1.0)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use wide::f32x4;

    /// Positions, values and how these change along the axes.
    struct Particles(Vec<([f32; 4], f32x4, [f32x4; 3])>);

    impl Work<&mut Tile<f32>> for Particles {
        #[inline(always)]
        fn on(&self, wide: Option<Wide>, tile: &mut Tile<f32>) {
            for &(position, value, columns) in &self.0 {
                scatter_affine::<f32>(wide, tile, [4; 3], position, value, columns);
            }
        }
    }

    /// In all cells of a block, the last one included.
    #[test]
    fn rows_at_once_add_what_nodes_one_by_one_do() {
        let some = |i: u32, most: f32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / 16_777_216.0 * most;
        let particle = |i: u32| {
            let lanes = |of: u32| f32x4::from([0, 1, 2, 3].map(|c| some(i * 64 + of * 4 + c, 2e6) - 1e6));
            let position = [0, 1, 2, 3].map(|a| 4.5 + some(i * 64 + 32 + a, 3.999));
            (position, lanes(0), [lanes(1), lanes(2), lanes(3)])
        };
        let mut particles: Vec<_> = (0..1000).map(particle).collect();
        particles.push(([8.49, 8.49, 8.49, 1.0], f32x4::splat(1e5), [f32x4::splat(-3e4); 3]));
        let particles = Particles(particles);
        let mut tiles = [empty::<f32>(), empty::<f32>()];
        widely(&particles, &mut tiles[0]);
        particles.on(None, &mut tiles[1]);
        assert!(tiles[1][TILE_NODES - 1] != [0; 4]);
        assert_eq!(tiles[0], tiles[1]);
    }
}
