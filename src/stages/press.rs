//! Prepares the solve of the implicit scheme: viscosity, and the pressure that each particle brings from the step before.
//!
//! A pressure q adds q (x_i − x_p) to what a particle brings to a node, so that one scatter takes motion and pressure there.

use super::Kernel;
use super::seek::compliance;
use super::viscosity::viscosity;
use crate::cpu::par;
use crate::cpu::solve::{Search, Solve};
use crate::cpu::state::{Constants, CpuState, Gradient, MaterialConstants, Tally};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::linear::dot;
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        write(Slot::Gradient),
        write(Slot::Search),
        write(Slot::Solve),
        write(Slot::Counters),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/press.wgsl"),
};

/// Largest pressure that a particle brings along.
pub(crate) const MAX_PRESSURE: f64 = 1024.0;
/// Largest divergence that it may answer to.
pub(crate) const MAX_DIVERGENCE: f64 = 0.25;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (position, materials, constants, tally) = (&s.position, &s.materials, &s.constants, &s.tally);
    s.search.resize(s.position.len(), Search::default());
    let largest = par::Largest::new();
    let particles = (&mut s.gradient[..], &mut s.search[..]);
    par::block_particles(&s.blocks[..s.occupied], particles, &|_, block, (gradient, search)| {
        let mut most = [R::of(0.0); 3];
        for (i, (gradient, search)) in gradient.iter_mut().zip(search).enumerate() {
            let material = &materials[gradient[1][3].floor_index() as usize];
            let rate = bound(gradient, constants, tally);
            viscosity(material, gradient, constants);
            let compliance = brought(material, gradient, position[block.start as usize + i][3], constants);
            *search = Search { compliance, ..Search::default() };
            let q = gradient[2][3];
            (0..3).for_each(|c| gradient[c][c] += q);
            most = [most[0].max(q.abs()), most[1].max(rate), most[2].max(compliance)];
        }
        largest.note(most);
    });
    let [pressure, rate, compliance] = largest.take::<R>();
    s.solve = Solve { pressure, rate: rate.sqrt(), compliance, ..Solve::default() };
}

/// Keeps the gradient within the bound that the fixed-point scale is made for, and gives the square of its norm.
#[inline(always)]
fn bound<R: Real>(d: &mut Gradient<R>, constants: &Constants<R>, tally: &Tally) -> R {
    let column = |c: usize| [d[c][0], d[c][1], d[c][2]];
    let norm = dot(column(0), column(0)) + dot(column(1), column(1)) + dot(column(2), column(2));
    let bound = constants.max_gradient;
    if norm > bound * bound {
        let factor = bound / norm.sqrt();
        d.iter_mut().for_each(|c| c[..3].iter_mut().for_each(|e| *e *= factor));
        Tally::add(&tally.gradient_clamped, 1);
        return bound * bound;
    }
    norm
}

/// Bounds the pressure that a particle brings along, and gives its compliance: no pressure and no compliance where it has come apart and
/// does not close up.
#[inline(always)]
fn brought<R: Real>(m: &MaterialConstants<R>, d: &mut Gradient<R>, ratio: R, constants: &Constants<R>) -> R {
    let (zero, one) = (R::of(0.0), R::of(1.0));
    let trace = d[0][0] + d[1][1] + d[2][2];
    if ratio + ratio * trace > constants.tension_limit {
        d[2][3] = zero;
        return zero;
    }
    let compliance = compliance(m, constants);
    let most = (R::of(MAX_DIVERGENCE) * (one / compliance)).min(R::of(MAX_PRESSURE));
    d[2][3] = d[2][3].max(-most).min(most);
    compliance
}
