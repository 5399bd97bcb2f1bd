//! Comparison of the implicit scheme's solve.

use super::active;
use super::compared::{Compared, floats};
use crate::bins::NODES;
use crate::cpu::CpuSolver;
use crate::error::Result;
use crate::gpu::layout::{Held, Search, Shear, Solve, StressSearch, Symmetric};
use crate::gpu::slots::Slot;
use crate::headless::Headless;
use crate::math::real::Real;
use crate::math::symmetric;
use crate::stages::bin_sleep::AWAKE;
use std::collections::BTreeSet;

/// The solve's state of the particles that are awake.
pub(super) fn searches(cpu: &CpuSolver<f32>, gpu: &Headless) -> Result<Compared> {
    let s = &cpu.state;
    let awake = s.blocks[..s.occupied].iter().filter(|b| b.sleep == AWAKE);
    let stored: Vec<usize> = awake.flat_map(|b| b.start as usize..(b.start + b.count) as usize).collect();
    let ids = || stored.iter().map(|i| s.id[*i] as usize);
    let mean = |s: &Search| vec![s.pressure, s.residual, s.direction, s.compliance];
    let lanes = |p: usize, x: Vec<f32>| x.into_iter().enumerate().map(move |(n, x)| ((p, n), x));
    if !s.features.tensors() {
        let there: Vec<Search> = gpu.read(Slot::Search)?;
        let here = ids().zip(&stored).flat_map(|(p, i)| lanes(p, mean(&search(cpu, *i))));
        return Ok(floats(here, ids().flat_map(|p| lanes(p, mean(&there[p])))));
    }
    let all = |s: &StressSearch| {
        let shear = [s.shear.found, s.shear.residual, s.shear.direction, s.shear.brought];
        let shear = shear.into_iter().flat_map(|s| s.diagonal.into_iter().chain(s.off));
        let correction = [s.shear.correction_x, s.shear.correction_y, s.shear.correction_z];
        mean(&s.mean).into_iter().chain([s.shear.compliance]).chain(correction).chain(shear).collect()
    };
    let there: Vec<StressSearch> = gpu.read(Slot::Search)?;
    let here = ids().zip(&stored).flat_map(|(p, i)| lanes(p, all(&stress_search(cpu, *i))));
    Ok(floats(here, ids().flat_map(|p| lanes(p, all(&there[p])))))
}

/// The state of the CPU's solve for the particle stored at `at`.
fn search(cpu: &CpuSolver<f32>, at: usize) -> Search {
    let s = &cpu.state.search[at];
    Search { pressure: s.pressure, residual: s.residual, direction: s.direction, compliance: s.compliance }
}

/// The same, with the deviator.
pub(super) fn stress_search(cpu: &CpuSolver<f32>, at: usize) -> StressSearch {
    let lanes =
        |s: &symmetric::Symmetric<f32>| Symmetric { diagonal: s.diagonal, padding: 0.0, off: s.off, padding_too: 0.0 };
    let s = &cpu.state.shear[at];
    let shear = Shear {
        brought: lanes(&symmetric::Symmetric::of_lanes(&cpu.state.deviator[at])),
        found: lanes(&s.found),
        residual: lanes(&s.residual),
        direction: lanes(&s.direction),
        compliance: s.compliance,
        correction_x: s.correction[0],
        correction_y: s.correction[1],
        correction_z: s.correction[2],
    };
    StressSearch { mean: search(cpu, at), shear }
}

/// Where and how bodies hold the nodes with mass.
pub(super) fn held(cpu: &CpuSolver<f32>, gpu: &Headless) -> Result<Compared> {
    let s = &cpu.state;
    let there: Vec<[Held; NODES]> = gpu.read(Slot::Held)?;
    let lanes = |key: u32, n: usize, [count, body]: [u32; 2], [a, b, c]: [f32; 3], [x, y, z]: [f32; 3], braked: f32| {
        let body = if count > 0 { body } else { 0 };
        let all = [count as f32, body as f32, a, b, c, x, y, z, braked];
        (0..9).map(move |lane| ((key, 9 * n + lane), all[lane]))
    };
    let mut massive = BTreeSet::new();
    let mut here = Vec::new();
    for ((block, grid), held) in s.blocks.iter().zip(&s.grid).zip(&s.held) {
        for (n, held) in held.iter().enumerate().filter(|(n, _)| f32::loaded(grid[*n][3]) > 0.0) {
            massive.insert((block.key, n));
            here.extend(lanes(block.key, n, [held.count, held.body], held.axis, held.motion, held.braked));
        }
    }
    let there = active(gpu)?.into_iter().zip(&there).flat_map(|(block, held)| {
        let massive = &massive;
        let held = held.iter().enumerate().filter(move |(n, _)| massive.contains(&(block.key, *n)));
        held.flat_map(move |(n, held)| {
            let by = [held.count_and_body & 3, held.count_and_body >> 2];
            lanes(block.key, n, by, held.axis, held.motion, held.braked)
        })
        .collect::<Vec<_>>()
    });
    Ok(floats(here.into_iter(), there))
}

/// The solve's global state after a step length was found.
pub(super) fn solve(cpu: &CpuSolver<f32>, gpu: &Headless) -> Result<Compared> {
    let here = &cpu.state.solve;
    let there = gpu.read::<Solve>(Slot::Solve)?[0];
    let here = [
        here.motion,
        here.first_bound,
        here.bound,
        here.last_bound,
        here.direction_bound,
        here.pressure_bound,
        here.last_square,
        here.first_square,
        here.step,
        here.mix,
        here.change,
        here.count as f32,
        f32::from(u8::from(here.active)),
    ];
    let there = [
        there.motion,
        there.first_bound,
        there.bound,
        there.last_bound,
        there.direction_bound,
        there.pressure_bound,
        there.last_square,
        there.first_square,
        there.step,
        there.mix,
        there.change,
        there.count as f32,
        there.going_on as f32,
    ];
    Ok(floats(here.into_iter().enumerate(), there.into_iter().enumerate()))
}
