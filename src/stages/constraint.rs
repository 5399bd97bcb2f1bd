//! Corrects the displacement gradient of each particle towards its material's constraint.

use super::Kernel;
use super::solid::{LIQUID, Solids, constrain};
use super::viscosity::take_shear;
use crate::cpu::constants::MaterialConstants;
use crate::cpu::gradient::Gradient;
use crate::cpu::lanes::{entries, materials_of, matrices, store};
use crate::cpu::par;
use crate::cpu::state::{Block, CpuState};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;
use crate::math::wide::{Wide, Work, widely};

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
    let work = Constraint {
        position: &s.position,
        deformation: &s.deformation,
        materials: &s.materials,
        tension_limit: s.constants.tension_limit,
    };
    par::block_particles(&s.blocks[..s.occupied], &mut s.gradient[..], &|_, block, gradients| {
        widely(&work, (block, gradients));
    });
}

/// Corrects the particles of a block.
struct Constraint<'a, R: Real> {
    position: &'a [[R; 4]],
    deformation: &'a [Gradient<R>],
    materials: &'a [MaterialConstants<R>],
    tension_limit: R,
}

impl<R: Real> Work<(&Block, &mut [Gradient<R>])> for Constraint<'_, R> {
    #[inline(always)]
    fn on(&self, _: Option<Wide>, (block, gradients): (&Block, &mut [Gradient<R>])) {
        let Constraint { position, deformation, materials, tension_limit } = *self;
        for (start, four) in (block.start as usize..).step_by(4).zip(gradients.chunks_mut(4)) {
            let of = materials_of(four, materials);
            for (n, gradient) in four.iter_mut().enumerate() {
                relax_shear(of[n], gradient);
                if of[n].model == LIQUID {
                    liquid(of[n], position[start + n][3], tension_limit, gradient);
                }
            }
            if of.iter().all(|m| m.model == LIQUID) {
                continue;
            }
            let (f, slack) = matrices::<R>(&deformation[start..][..four.len()]);
            let (d, _) = matrices::<R>(four);
            let steered = entries::<R>(constrain::<R>(&Solids::of(of), &f, slack, &d));
            for (n, gradient) in four.iter_mut().enumerate().filter(|(n, _)| of[*n].model != LIQUID) {
                store(gradient, steered[n]);
            }
        }
    }
}

/// Viscosity removes a share of the deviatoric part of `(D + Dᵀ)/2`.
#[inline(always)]
fn relax_shear<R: Real>(material: &MaterialConstants<R>, d: &mut Gradient<R>) {
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
