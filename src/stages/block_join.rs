//! Finds for each block of nodes what the pressures of the blocks whose tiles reach it do to each other there, where bodies do not hold the
//! nodes, and what the predicted motion does to these blocks.

use super::Kernel;
use super::p2g::Tile;
use super::predict::reply;
use crate::bins::{EDGE, NODES, NONE, node_index, tile_index};
use crate::cpu::blocks::Coupling;
use crate::cpu::par;
use crate::cpu::solve::Held;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::dot;
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Table),
        read(Slot::Blocks),
        read(Slot::Grid),
        read(Slot::Field),
        read(Slot::Held),
        read(Slot::BlockTiles),
        write(Slot::Couplings),
        write(Slot::Counters),
    ],
    over: Over::SolveNodes,
    source: include_str!("../../shaders/stages/block_join.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.couplings.resize(s.blocks.len(), Coupling::default());
    let (grid, field, held, sources, tiles) = (&s.grid, &s.field, &s.held, &s.sources, &s.block_tiles);
    let unit = R::of(1.0) / s.solve.force_scale_of(&s.constants, R::of(1.0));
    par::each_block(&mut s.couplings[..], |b, coupling| {
        *coupling = Coupling::default();
        let nodes = Nodes { grid: &grid[b], field: &field[b], held: &held[b], unit };
        let tiles = sources[b].map(|source| tile_of::<R>(tiles, source));
        for (row, of_row) in (0..).zip(tiles) {
            let Some(of_row) = of_row else { continue };
            coupling.motion[row] = nodes.motion(of_row, row);
            for (column, of_column) in (0..).zip(tiles).skip(row) {
                let Some(of_column) = of_column else { continue };
                let product = nodes.product([of_row, of_column], [row, column]);
                coupling.matrix[8 * row + column] = product;
                coupling.matrix[8 * column + row] = product;
            }
        }
    });
}

/// The tile of one of the blocks whose tiles reach a block of nodes, if there is any.
#[inline(always)]
pub(super) fn tile_of<R: Real>(tiles: &[Tile<R>], source: u32) -> Option<&Tile<R>> {
    if source == NONE { None } else { Some(&tiles[source as usize]) }
}

/// The nodes that the tiles of these two of the eight blocks share in a block of nodes: place there, and places in the two tiles.
#[inline(always)]
pub(super) fn shared([a, b]: [usize; 2]) -> impl Iterator<Item = (usize, [usize; 2])> {
    let bit = |of: usize, axis: usize| of >> axis & 1;
    let most = [0, 1, 2].map(|axis| if bit(a | b, axis) == 1 { 2 } else { EDGE });
    let place = move |of: usize, [x, y, z]: [usize; 3]| {
        tile_index(x + EDGE * bit(of, 0), y + EDGE * bit(of, 1), z + EDGE * bit(of, 2))
    };
    let all = (0..most[2]).flat_map(move |z| (0..most[1]).flat_map(move |y| (0..most[0]).map(move |x| [x, y, z])));
    all.map(move |at| (node_index(at[0], at[1], at[2]), [place(a, at), place(b, at)]))
}

/// A push of a tile at one of its nodes.
#[inline(always)]
pub(super) fn push<R: Real>(node: &[R::Sum; 4], unit: R) -> [R; 3] {
    [0, 1, 2].map(|c| R::dequantise(node[c], false) * unit)
}

struct Nodes<'a, R: Real> {
    grid: &'a [[R::Sum; 4]; NODES],
    field: &'a [[R; 4]; NODES],
    held: &'a [Held<R>; NODES],
    unit: R,
}

impl<R: Real> Nodes<'_, R> {
    #[inline(always)]
    fn motion(&self, tile: &Tile<R>, row: usize) -> R {
        let mut sum = R::of(0.0);
        for (n, [t, _]) in shared([row, row]) {
            if R::loaded(self.grid[n][3]) > R::of(0.0) {
                let u = self.field[n];
                sum += dot(push(&tile[t], self.unit), [u[0], u[1], u[2]]);
            }
        }
        sum
    }

    #[inline(always)]
    fn product(&self, [a, b]: [&Tile<R>; 2], of: [usize; 2]) -> R {
        let mut sum = R::of(0.0);
        for (n, [at, bt]) in shared(of) {
            let mass = R::loaded(self.grid[n][3]);
            if mass > R::of(0.0) {
                let moved = push(&b[bt], self.unit * (R::of(1.0) / mass));
                sum += dot(push(&a[at], self.unit), reply(&self.held[n], moved));
            }
        }
        sum
    }
}
