//! Takes a step of conjugate gradients towards the stresses, and sums on the nodes what they do.
//!
//! Wanted are stresses S with C S + sym ∇u(S) = 0 for solids, of liquids the traces with the volume's error on the right. The
//! form of Chronopoulos and Gear (1989) needs both its sums at one place, so that an iteration is one pass over the particles and one
//! over the nodes.

use super::g2p::{gather, tile};
use super::p2g::{Nodes, scatter_affine};
use super::solid;
use super::strain::{self, Compliance};
use crate::bins::{NODES, coordinates};
use crate::cpu::par;
use crate::cpu::state::{Block, Constants, CpuState, Gradient, MaterialConstants, Search, Solve};
use crate::math::real::{Lanes, Real};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Largest error in volume that a step takes back, as a share.
pub(crate) const MAX_ERROR: f64 = 0.02;

/// Share in which the pressures that particles bring along become what the nodes know of them: what is left of noise that moves no
/// node would add up.
const LEAK: f64 = 0.05;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool, last: bool) {
    if s.solids {
        let mut search = std::mem::take(&mut s.tensors);
        seek(s, &mut search, first, last);
        s.tensors = search;
    } else {
        let mut search = std::mem::take(&mut s.scalars);
        seek(s, &mut search, first, last);
        s.scalars = search;
    }
}

fn seek<R: Real, const N: usize>(s: &mut CpuState<R>, search: &mut [Search<R, N>], first: bool, last: bool) {
    let particles = Particles {
        position: &s.position,
        gradient: &s.gradient,
        materials: &s.materials,
        constants: &s.constants,
        field: &s.field,
        links: &s.links,
        blocks: &s.blocks[..s.occupied],
    };
    if s.solve.active {
        step(&particles, search, &mut s.solve, first);
    } else if !last {
        return;
    }
    let scale = s.solve.force_scale(&s.constants, last);
    let pressure_scale = s.solve.pressure_scale(&s.constants);
    let nodes =
        Nodes::<R> { blocks: &s.blocks, sources: &s.sources, tally: &s.tally, tiles: &mut s.tiles, grid: &mut s.force };
    nodes.sum(s.occupied, |tile, origin, p| {
        let (search, gradient) = (&search[p], &s.gradient[p]);
        let material = &s.materials[gradient[1][3].floor_index() as usize];
        let stress = if last {
            search.stress
        } else {
            Compliance::of::<N>(material, &s.constants).0.times(search.softness).answer(
                &search.residual,
                search.shares,
                s.solve.bound,
            )
        };
        let unit = gradient[0][3] * scale;
        let columns =
            strain::columns(&stress).map(|c| R::V::from4([c[0] * unit, c[1] * unit, c[2] * unit, R::of(0.0)]));
        let mut value = [R::of(0.0); 4];
        if first {
            value[3] = gradient[0][3] * gradient[2][3] * pressure_scale;
        }
        scatter_affine::<R>(tile, origin, s.position[p], R::V::from4(value), columns);
    });
    if last {
        let (search, materials) = (&*search, &s.materials);
        par::each(&mut s.gradient[..search.len()], |p, gradient| {
            if materials[gradient[1][3].floor_index() as usize].model == solid::LIQUID {
                gradient[2][3] += search[p].stress[0] + search[p].leak;
            }
        });
    }
}

struct Particles<'a, R: Real> {
    position: &'a [[R; 4]],
    gradient: &'a [Gradient<R>],
    materials: &'a [MaterialConstants<R>],
    constants: &'a Constants<R>,
    field: &'a [[[R; 4]; NODES]],
    links: &'a [[u32; 8]],
    blocks: &'a [Block],
}

/// Gathers what the last stresses have done to the strain, and goes on.
fn step<R: Real, const N: usize>(
    particles: &Particles<'_, R>,
    search: &mut [Search<R, N>],
    solve: &mut Solve<R>,
    first: bool,
) {
    let Particles { position, gradient, materials, constants, field, links, blocks } = *particles;
    let before = *solve;
    let scale = before.square_scale();
    let totals = Mutex::new(vec![[R::Whole::default(); 2]; blocks.len()]);
    let largest = [const { AtomicU64::new(0) }; 3];
    par::block_particles(blocks, search, &|b, block, search| {
        let tile = tile(field, &links[b], |node| *node);
        let origin = coordinates(block.key).map(|c| c << 2);
        let mut sums = [R::Whole::default(); 2];
        let mut most = [R::of(0.0); 3];
        for (i, search) in search.iter_mut().enumerate() {
            let p = block.start as usize + i;
            let material = &materials[gradient[p][1][3].floor_index() as usize];
            let mut d = [[R::of(0.0); 4]; 3];
            let mean = gather(&tile, origin, position[p], &mut d);
            let found = strain::of_gradient::<R, N>(&d);
            let (compliance, share) = Compliance::of::<N>(material, constants);
            let compliance = compliance.times(search.softness);
            if first {
                search.residual = found.map(|e| -e);
                if material.model == solid::LIQUID {
                    let wanted = wanted(position[p][3], share);
                    let q = gradient[p][2][3];
                    let trace = if N == 1 { found[0] } else { found[0] + found[1] + found[2] };
                    let three = if N == 1 { R::of(1.0) } else { R::of(3.0) };
                    let error = (wanted - trace) * (R::of(1.0) / three) - compliance.mean * q;
                    search.residual = std::array::from_fn(|i| if i < 3 { error } else { R::of(0.0) });
                }
            } else {
                if before.count == 1 {
                    search.leak = R::of(LEAK) * (mean[3] - gradient[p][2][3]);
                }
                let answer = compliance.answer(&search.residual, search.shares, before.last_bound);
                let image = strain::add(&found, &compliance.strain(&answer), R::of(1.0));
                search.direction = strain::add(&answer, &search.direction, before.mix);
                search.image = strain::add(&image, &search.image, before.mix);
                search.stress = strain::add(&search.stress, &search.direction, before.step);
                search.residual = strain::add(&search.residual, &search.image, -before.step);
            }
            let answer = compliance.answer(&search.residual, search.shares, before.bound);
            let mass = gradient[p][0][3] * scale;
            sums[0] += R::whole(mass * strain::inner(&search.residual, &answer));
            sums[1] += R::whole(mass * strain::inner(&answer, &compliance.strain(&answer)));
            // Beyond the bound, so that it is known where an answer was cut.
            let unbounded = compliance.answer(&search.residual, search.shares, R::of(1e30));
            for (most, tensor) in most.iter_mut().zip([&unbounded, &search.direction, &search.stress]) {
                *most = most.max(strain::inner(tensor, tensor));
            }
        }
        totals.lock().expect("no thread panics")[b] = sums;
        for (largest, most) in largest.iter().zip(most) {
            largest.fetch_max(most.f64().to_bits(), Ordering::Relaxed);
        }
    });
    let mut total = [R::Whole::default(); 2];
    for sums in totals.into_inner().expect("no thread panics") {
        total[0] += sums[0];
        total[1] += sums[1];
    }
    [solve.square, solve.compliant] = total.map(|sum| R::of_whole(sum) * (R::of(1.0) / scale));
    [solve.answer, solve.direction, solve.found] = largest.map(|l| R::of(f64::from_bits(l.into_inner())).sqrt());
}

/// The divergence that takes back the share of a liquid's error in volume.
#[inline(always)]
fn wanted<R: Real>(ratio: R, share: R) -> R {
    let most = R::of(MAX_ERROR);
    (share * (R::of(1.0) / ratio - R::of(1.0))).max(-most).min(most)
}
