//! Turns the effect of the answers on the nodes into velocities along the direction of search, where bodies do not hold
//! the nodes.

use super::Kernel;
use super::predict::{reply, work};
use crate::bins::NODES;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Grid),
        read(Slot::Held),
        write(Slot::Force),
        write(Slot::Field),
        write(Slot::Solve),
        write(Slot::Counters),
        read(Slot::Blocks).with_sleep(),
    ],
    over: Over::SolveNodes,
    source: include_str!("../../shaders/stages/project.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    if !s.solve.active {
        return;
    }
    let (grid, held, blocks) = (&s.grid, &s.held, &s.blocks);
    let unit = R::of(1.0) / s.solve.force_scale(&s.constants, false);
    let (mix, scale) = (s.solve.mixing(), s.solve.energy_scale());
    let first = s.solve.count == 0;
    let sums = par::Totals::<R, 1>::new(s.blocks.len());
    par::each_block((&mut s.field[..], &mut s.force[..]), |b, (field, force)| {
        if blocks[b].is_idle() {
            return;
        }
        let mut total = R::Whole::default();
        for (n, (field, force)) in field.iter_mut().zip(force.iter_mut()).enumerate() {
            let mass = R::loaded(grid[b][n][3]);
            if mass > R::of(0.0) {
                let unit = unit * (R::of(1.0) / mass);
                let mut u = reply(&held[b][n], [0, 1, 2].map(|c| R::dequantise(force[c], false) * unit));
                if !first {
                    u = [0, 1, 2].map(|c| u[c] + mix * field[c]);
                }
                *field = [u[0], u[1], u[2], R::of(0.0)];
                let square = work(&held[b][n], u);
                total += R::whole(mass * square * scale);
            }
        }
        *force = [[R::Sum::default(); 4]; NODES];
        sums.set(b, [total]);
    });
    let [energy] = sums.take();
    s.solve.mix = mix;
    s.solve.energy = energy * (R::of(1.0) / scale);
}
