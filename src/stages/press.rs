//! Prepares the solve of the implicit scheme: viscosity, and the pressure that each particle brings from the step before.
//!
//! A pressure q adds q (x_i − x_p) to what a particle brings to a node, so that one scatter takes motion and pressure there.

use super::Kernel;
use super::p2g::bounded_gradient;
use super::seek::compliance;
use super::viscosity::viscosity;
use crate::cpu::par;
use crate::cpu::solve::{Search, Solve};
use crate::cpu::state::{Constants, CpuState, Gradient, MaterialConstants};
use crate::gpu::slots::{Over, Slot, read, write};
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
            let (bounded, rate) = bounded_gradient(gradient.map(|c| [c[0], c[1], c[2]]), constants, tally);
            gradient.iter_mut().zip(bounded).for_each(|(to, from)| to[..3].copy_from_slice(&from));
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
