//! Zeroes the nodes of the active blocks.

use super::Kernel;
use crate::bins::NODES;
use crate::cpu::par;
use crate::cpu::state::{CpuState, fit};
use crate::gpu::slots::{Over, Slot, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[write(Slot::Grid), write(Slot::Counters)],
    over: Over::Nodes,
    source: include_str!("../../shaders/stages/grid_clear.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let zero = [[R::Sum::default(); 4]; NODES];
    fit(&mut s.grid, s.blocks.len(), zero);
    par::each_block(&mut s.grid[..], |_, nodes| *nodes = zero);
}
