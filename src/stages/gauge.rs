//! Finds the largest motion that particles bring to nodes, before [`sharpen`](super::sharpen) needs their momenta
//! summed. Displacement gradients are bounded as where stresses are added.

use super::Kernel;
use super::motion::{self, bound_gradient};
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Position),
        read(Slot::Displacement),
        write(Slot::Gradient),
        write(Slot::Counters),
        read(Slot::Bin).with_sleep(),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/gauge.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (displacement, constants, tally) = (&s.displacement, &s.constants, &s.tally);
    let largest = par::Largest::new();
    par::block_particles(&s.blocks[..s.occupied], &mut s.gradient[..], &|_, block, gradient| {
        let first = block.start as usize;
        let most = gradient.iter_mut().zip(&displacement[first..]).map(|(gradient, u)| {
            bound_gradient(gradient, constants, tally);
            motion::largest(*u, gradient, constants)
        });
        largest.note([most.fold(R::of(0.0), R::max)]);
    });
    let [found] = largest.take();
    motion::note(&mut s.largest_motion, found);
}
