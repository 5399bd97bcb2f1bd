//! Finds the pressures of blocks, by conjugate gradients.

use super::Kernel;
use crate::bins::NONE;
use crate::cpu::blocks::{BlockPressure, Coupling};
use crate::cpu::solve::{PRECISION, inverse};
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        write(Slot::Couplings),
        write(Slot::BlockSums),
        write(Slot::BlockPressures),
        write(Slot::Chunks),
        write(Slot::Solve),
        write(Slot::Counters),
        read(Slot::Blocks).with_sleep(),
    ],
    over: Over::One,
    source: include_str!("../../shaders/stages/block_solve.wgsl"),
};

/// Largest number of iterations.
pub(crate) const ROUNDS: u32 = 32;
/// Share of the squared residual at which iterations end.
pub(crate) const LEFT: f64 = 1e-6;
/// Lower bound of the largest square in a sum, for scales; below it the iterations end.
pub(crate) const LEAST_SQUARE: f64 = 1e-24;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (pressures, couplings, sources, links) = (&mut s.block_pressures, &mut s.couplings, &s.sources, &s.links);
    let blocks = &s.blocks;
    let (zero, one, four) = (R::of(0.0), R::of(1.0), R::of(4.0));
    for (pressure, links) in pressures.iter_mut().zip(links).filter(|(pressure, _)| pressure.volume > zero) {
        let of = |part: fn(&Coupling<R>, usize) -> R| four * sum_of(links, couplings, part);
        pressure.residual -= of(|coupling, k| coupling.motion[k]);
        pressure.inverse = one / (of(|coupling, k| coupling.matrix[9 * k]) + pressure.compliance);
        pressure.direction = pressure.residual * pressure.inverse;
    }
    let mut square = total(pressures.iter().map(squared));
    let least = square * R::of(LEFT);
    for _ in 0..ROUNDS {
        if square <= least {
            break;
        }
        let busy = couplings.iter_mut().zip(sources).zip(blocks).filter(|(_, block)| !block.is_idle());
        busy.for_each(|((coupling, sources), _)| join(coupling, &directions(sources, pressures)));
        let joined = couplings.iter().map(|coupling| coupling.work);
        let own = pressures.iter().map(|p| p.compliance * (p.direction * p.direction));
        let curvature = total(joined.chain(own));
        if curvature <= zero {
            break;
        }
        let step = square * (one / curvature);
        for (pressure, links) in pressures.iter_mut().zip(links).filter(|(pressure, _)| pressure.volume > zero) {
            let image = four * sum_of(links, couplings, |coupling, k| coupling.image[k]);
            let image = image + pressure.compliance * pressure.direction;
            pressure.found += step * pressure.direction;
            pressure.residual -= step * image;
        }
        let next = total(pressures.iter().map(squared));
        let mix = next * (one / square);
        square = next;
        for pressure in pressures.iter_mut() {
            pressure.direction = pressure.residual * pressure.inverse + mix * pressure.direction;
        }
    }
    for pressure in pressures.iter_mut() {
        let whole = (pressure.load + pressure.found).min(pressure.most).max(zero);
        pressure.found = whole - pressure.load;
    }
    s.solve.pressure_bound = pressures.iter().fold(zero, |most, p| most.max(p.found.abs()));
}

/// Sums over the eight blocks of nodes that a tile reaches.
#[inline(always)]
fn sum_of<R: Real>(links: &[u32; 8], couplings: &[Coupling<R>], part: impl Fn(&Coupling<R>, usize) -> R) -> R {
    links.iter().enumerate().fold(R::of(0.0), |sum, (k, link)| sum + part(&couplings[*link as usize], k))
}

/// The directions of the eight blocks whose tiles reach a block of nodes.
#[inline(always)]
fn directions<R: Real>(sources: &[u32; 8], pressures: &[BlockPressure<R>]) -> [R; 8] {
    sources.map(|source| if source == NONE { R::of(0.0) } else { pressures[source as usize].direction })
}

/// Computes the effect of the directions at the nodes of a block.
#[inline(always)]
fn join<R: Real>(coupling: &mut Coupling<R>, directions: &[R; 8]) {
    let product = |a: &[R; 8]| a.iter().zip(directions).fold(R::of(0.0), |sum, (a, d)| sum + *a * *d);
    let rows = coupling.matrix.as_chunks::<8>().0;
    coupling.image = std::array::from_fn(|k| product(&rows[k]));
    coupling.work = R::of(4.0) * product(&coupling.image).max(R::of(0.0));
}

#[inline(always)]
fn squared<R: Real>(pressure: &BlockPressure<R>) -> R {
    pressure.residual * (pressure.residual * pressure.inverse)
}

/// The sum of non-negative numbers, independent of their order; 0 where all are negligible.
fn total<R: Real>(terms: impl Iterator<Item = R> + Clone) -> R {
    let largest = terms.clone().fold(R::of(0.0), R::max);
    if largest <= R::of(LEAST_SQUARE) {
        return R::of(0.0);
    }
    let unit = inverse(largest, LEAST_SQUARE);
    let mut sum = R::Whole::default();
    terms.for_each(|term| sum += R::whole(term * unit * R::of(PRECISION)));
    R::of_whole(sum) * R::of(1.0 / PRECISION) * (R::of(1.0) / unit)
}
