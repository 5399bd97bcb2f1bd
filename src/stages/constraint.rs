//! Corrects the displacement gradient of each particle towards its material's constraint.

use super::viscosity::take_shear;
use super::{Kernel, solid};
use crate::cpu::par;
use crate::cpu::state::{CpuState, Gradient, MaterialConstants};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        write(Slot::Gradient),
        read(Slot::Deformation).with_solids(),
        write(Slot::Counters),
        read(Slot::Bin).with_sleep(),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/constraint.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (position, materials, tension_limit) = (&s.position, &s.materials, s.constants.tension_limit);
    let deformation = &s.deformation;
    par::block_particles(&s.blocks[..s.occupied], &mut s.gradient[..], &|_, block, gradients| {
        for (p, gradient) in (block.start as usize..).zip(gradients) {
            let material = &materials[gradient[1][3].floor_index() as usize];
            viscosity(material, gradient);
            if material.model == solid::LIQUID {
                liquid(material, position[p][3], tension_limit, gradient);
            } else {
                solid::constrain(material, &deformation[p], gradient);
            }
        }
    });
}

/// Viscosity takes a share off the deviatoric part of `(D + Dᵀ)/2`.
#[inline(always)]
fn viscosity<R: Real>(material: &MaterialConstants<R>, d: &mut Gradient<R>) {
    let share = material.viscous_relaxation;
    if share > R::of(0.0) {
        take_shear(share, d);
    }
}

/// The liquid's constraint is `J (1 + tr D) = 1`. Its correction `(a/3)(1/J − 1 − tr D)` on the diagonal is the whole
/// error of an isolated particle for a = 1.
#[inline(always)]
fn liquid<R: Real>(material: &MaterialConstants<R>, ratio: R, tension_limit: R, d: &mut Gradient<R>) {
    let trace = d[0][0] + d[1][1] + d[2][2];
    let mut error = R::of(1.0) / ratio - R::of(1.0) - trace;
    if ratio > tension_limit {
        error = error.max(R::of(0.0));
    }
    let correction = material.gain * error;
    for (i, column) in d.iter_mut().enumerate() {
        column[i] += correction;
    }
}
