//! Scales displacements, pressures and stresses when the step length has changed, so that velocities and stresses in SI
//! units stay the same.

use super::Kernel;
use crate::cpu::gradient::pressure_mut;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        write(Slot::Displacement),
        write(Slot::Gradient),
        write(Slot::Counters),
        write(Slot::Search).with_tensors(),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/rescale.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let factor = s.constants.rescale;
    par::each(&mut s.displacement, |_, u| u.iter_mut().take(3).for_each(|c| *c *= factor));
    let pressure = s.constants.pressure_rescale;
    par::each(&mut s.gradient, |_, d| {
        d.iter_mut().for_each(|c| c.iter_mut().take(3).for_each(|e| *e *= factor));
        *pressure_mut(d) *= pressure;
    });
    par::each(&mut s.deviator, |_, stress| stress.iter_mut().flatten().for_each(|e| *e *= pressure));
}
