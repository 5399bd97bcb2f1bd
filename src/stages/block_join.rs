//! Computes for each block of nodes the couplings, through its free nodes, between the pressures of the blocks whose
//! tiles reach it, and the effect of the predicted motion on these blocks.

use super::Kernel;
use super::bin_sleep::AWAKE;
use super::p2g::Tile;
use super::predict::reply;
use crate::bins::{EDGE, NODES, NONE, node_index, tile_index};
use crate::cpu::blocks::Coupling;
use crate::cpu::par;
use crate::cpu::solve::Held;
use crate::cpu::state::{Block, CpuState};
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
    let (blocks, sources, tiles) = (&s.blocks, &s.sources, &s.block_tiles);
    let (grid, field, held) = (&s.grid, &s.field, &s.held);
    let unit = R::of(1.0) / s.solve.force_scale_of(&s.constants, R::of(1.0));
    par::each_block(&mut s.couplings[..], |b, coupling| {
        *coupling = Coupling::default();
        if blocks[b].is_idle() {
            return;
        }
        let nodes = Nodes { grid: &grid[b], field: &field[b], held: &held[b], unit };
        let reached: [_; 8] =
            std::array::from_fn(|k| Some(nodes.reached(tile_of::<R>(tiles, blocks, sources[b][k])?, k)));
        for (row, of_row) in (0..).zip(&reached) {
            let Some(of_row) = of_row else { continue };
            coupling.motion[row] = nodes.motion(of_row, row);
            for (column, of_column) in (0..).zip(&reached).skip(row) {
                let Some(of_column) = of_column else { continue };
                let common = reach(row | column).map(node);
                let product = common.fold(R::of(0.0), |sum, n| sum + dot(of_row.pushed[n], of_column.moved[n]));
                coupling.matrix[8 * row + column] = product;
                coupling.matrix[8 * column + row] = product;
            }
        }
    });
}

/// The tile of one of the blocks whose tiles reach a block of nodes, if there is any that does not sleep.
#[inline(always)]
pub(super) fn tile_of<'a, R: Real>(tiles: &'a [Tile<R>], blocks: &[Block], source: u32) -> Option<&'a Tile<R>> {
    let pushes = source != NONE && blocks[source as usize].sleep == AWAKE;
    pushes.then(|| &tiles[source as usize])
}

/// The nodes of a block that are common to the tiles of some of the eight blocks: `of` is the bitwise OR of these
/// blocks' numbers.
#[inline(always)]
pub(super) fn reach(of: usize) -> impl Iterator<Item = [usize; 3]> {
    let most = [0, 1, 2].map(|axis| if of >> axis & 1 == 1 { 2 } else { EDGE });
    (0..most[2]).flat_map(move |z| (0..most[1]).flat_map(move |y| (0..most[0]).map(move |x| [x, y, z])))
}

/// Index of such a node in the tile of one of the eight.
#[inline(always)]
pub(super) fn place(of: usize, [x, y, z]: [usize; 3]) -> usize {
    let shift = |axis: usize| EDGE * (of >> axis & 1);
    tile_index(x + shift(0), y + shift(1), z + shift(2))
}

/// Its index in the block of nodes.
#[inline(always)]
pub(super) fn node([x, y, z]: [usize; 3]) -> usize {
    node_index(x, y, z)
}

/// The push of a tile at one of its nodes.
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

/// The push of a tile at the nodes of a block, and the motion that it gives them.
struct Reached<R> {
    pushed: [[R; 3]; NODES],
    moved: [[R; 3]; NODES],
}

impl<R: Real> Nodes<'_, R> {
    #[inline(always)]
    fn reached(&self, tile: &Tile<R>, of: usize) -> Reached<R> {
        let mut reached = Reached { pushed: [[R::of(0.0); 3]; NODES], moved: [[R::of(0.0); 3]; NODES] };
        for at in reach(of) {
            let (n, t) = (node(at), place(of, at));
            let mass = R::loaded(self.grid[n][3]);
            if mass > R::of(0.0) {
                reached.pushed[n] = push(&tile[t], self.unit);
                reached.moved[n] = reply(&self.held[n], push(&tile[t], self.unit * (R::of(1.0) / mass)));
            }
        }
        reached
    }

    #[inline(always)]
    fn motion(&self, reached: &Reached<R>, of: usize) -> R {
        reach(of).map(node).fold(R::of(0.0), |sum, n| {
            let u = self.field[n];
            sum + dot(reached.pushed[n], [u[0], u[1], u[2]])
        })
    }
}
