//! Finds the step length along the next direction of search, and bounds of the result.

use super::Kernel;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[read(Slot::Constants), write(Slot::Solve), write(Slot::Counters), write(Slot::Dispatch)],
    over: Over::One,
    source: include_str!("../../shaders/stages/line.wgsl"),
};

/// Multiple of the machine precision, times the first squared residual, below which rounding determines the step.
pub(crate) const LEADING: f64 = 8.0;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool) {
    let tolerance = s.constants.tolerance;
    let solve = &mut s.solve;
    let (zero, one) = (R::of(0.0), R::of(1.0));
    if first {
        solve.active = true;
        solve.first_bound = solve.bound_of_first();
        solve.bound = solve.first_bound;
        if solve.resumes {
            solve.bound = solve.bound.max(solve.pressure);
        }
        return;
    }
    if !solve.active {
        return;
    }
    let resuming = solve.resuming();
    if solve.count == u32::from(solve.resumes) {
        solve.first_square = solve.square;
    }
    // The compliant part for an answer plus `mix` directions. It is summed, not updated: a recurrence subtracts nearly
    // equal numbers.
    let [answers, directions, both] = solve.compliant;
    let crossed = both - answers - directions;
    let compliant = answers + solve.mix * (crossed + solve.mix * directions);
    let curvature = R::of(4.0) * solve.energy + compliant;
    let leads = curvature > zero && solve.square > R::of(LEADING) * R::EPSILON * solve.first_square;
    solve.step = if leads { solve.square * (one / curvature) } else { zero };
    solve.change = solve.step * solve.step * solve.energy;
    // The stress that is carried over may give no descent, and may be zero.
    if !resuming && (!leads || solve.change <= tolerance * tolerance * solve.motion) {
        solve.active = false;
        return;
    }
    solve.direction_bound = solve.ahead();
    solve.last_square = solve.square;
    solve.count += 1;
    solve.last_bound = solve.bound;
    solve.bound = if resuming { solve.first_bound } else { R::of(4.0) * solve.largest_answer };
    solve.pressure_bound = solve.largest_found + solve.step * solve.direction_bound;
}
