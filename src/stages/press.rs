//! Prepares the solve of the implicit scheme: viscosity, and the stress that each particle brings from the step before.
//!
//! A stress S adds S (x_i − x_p) to what a particle brings to a node, so that one scatter takes motion and stress there.

use super::solid;
use super::strain::Compliance;
use crate::cpu::par;
use crate::cpu::state::{Constants, CpuState, Gradient, MaterialConstants, Search, Solve, Tally};
use crate::math::linear::dot;
use crate::math::real::Real;
use std::sync::atomic::{AtomicU64, Ordering};

/// Largest stress that a particle brings along.
pub(crate) const MAX_STRESS: f64 = 256.0;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (position, deformation, materials) = (&s.position, &s.deformation, &s.materials);
    let (constants, tally) = (&s.constants, &s.tally);
    let solids = s.solids;
    if solids {
        s.tensors.resize(s.position.len(), Search::default());
    } else {
        s.scalars.resize(s.position.len(), Search::default());
    }
    let largest = [const { AtomicU64::new(0) }; 2];
    let tensors = solids.then_some(&mut s.tensors[..]);
    let scalars = (!solids).then_some(&mut s.scalars[..]);
    let particles = (&mut s.gradient[..], (tensors, scalars));
    par::block_particles(&s.blocks[..s.occupied], particles, &|_, block, (gradient, (mut tensors, mut scalars))| {
        let mut most = [R::of(0.0); 2];
        for (i, gradient) in gradient.iter_mut().enumerate() {
            let p = block.start as usize + i;
            let material = &materials[gradient[1][3].floor_index() as usize];
            let rate = bound(gradient, constants, tally);
            viscosity(material, gradient, constants);
            let (stress, shares, softness) = if material.model == solid::LIQUID {
                liquid(material, gradient, position[p][3], constants, solids)
            } else {
                solid::stress(material, &deformation[p], gradient, constants)
            };
            let mut square = R::of(0.0);
            for (d, stress) in gradient.iter_mut().zip(stress) {
                square += dot(stress, stress);
                d.iter_mut().zip(stress).for_each(|(d, stress)| *d += stress);
            }
            most = [most[0].max(square), most[1].max(rate)];
            if let Some(search) = &mut tensors {
                search[i] = Search { shares, softness, ..Search::default() };
            }
            if let Some(search) = &mut scalars {
                search[i] = Search { shares, softness, ..Search::default() };
            }
        }
        for (largest, most) in largest.iter().zip(most) {
            largest.fetch_max(most.f64().to_bits(), Ordering::Relaxed);
        }
    });
    let [stress, rate] = largest.map(|most| R::of(f64::from_bits(most.into_inner())).sqrt());
    s.solve = Solve { stress, rate, ..Solve::default() };
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

/// Takes from the shear rate what viscosity takes in a step: of a rate that it would take r times over, the share r/(1 + r).
#[inline(always)]
fn viscosity<R: Real>(m: &MaterialConstants<R>, d: &mut Gradient<R>, constants: &Constants<R>) {
    let times = R::of(8.0) * m.viscosity * m.inverse_density * constants.seconds;
    if times > R::of(0.0) {
        super::constraint::take_shear(times * (R::of(1.0) / (R::of(1.0) + times)), d);
    }
}

/// The pressure that a liquid particle brings along, which it is left with, and what of it takes part in the solve: nothing where
/// it has come apart and does not close up.
#[inline(always)]
fn liquid<R: Real>(
    m: &MaterialConstants<R>,
    d: &mut Gradient<R>,
    ratio: R,
    constants: &Constants<R>,
    solids: bool,
) -> ([[R; 3]; 3], [R; 2], R) {
    let (zero, one) = (R::of(0.0), R::of(1.0));
    let trace = d[0][0] + d[1][1] + d[2][2];
    let loose = ratio + ratio * trace > constants.tension_limit;
    let (compliance, _) = if solids { Compliance::of::<6>(m, constants) } else { Compliance::of::<1>(m, constants) };
    // No more than a strain of 1/16 answers to.
    let most = (one / compliance.mean * R::of(0.0625)).min(R::of(MAX_STRESS));
    let q = if loose { zero } else { d[2][3].max(zero - most).min(most) };
    d[2][3] = q;
    ([[q, zero, zero], [zero, q, zero], [zero, zero, q]], [zero, if loose { zero } else { one }], one)
}
