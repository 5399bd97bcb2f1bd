//! Finds how far to go along the next direction of search, how much of the last there is in it, and bounds for what comes of
//! it.

use super::Kernel;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[read(Slot::Constants), write(Slot::Solve), write(Slot::Counters), write(Slot::Dispatch)],
    over: Over::One,
    source: include_str!("../../shaders/stages/line.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool) {
    let tolerance = s.constants.tolerance;
    let solve = &mut s.solve;
    let (zero, one) = (R::of(0.0), R::of(1.0));
    if first {
        solve.active = true;
        solve.bound = R::of(0.0625) + R::of(2.0) * solve.rate;
        return;
    }
    if !solve.active {
        return;
    }
    solve.mix = solve.mixing();
    if solve.count == 0 {
        solve.first_square = solve.square;
    }
    // Of an answer and `mix` directions together. Summed, not carried on: a recurrence subtracts what is nearly equal.
    let [answers, directions, both] = solve.compliant;
    let crossed = both - answers - directions;
    let compliant = answers + solve.mix * (crossed + solve.mix * directions);
    let curvature = R::of(4.0) * solve.energy + compliant;
    // Below that, rounding leads on.
    if !(curvature > zero && solve.square > R::of(8.0) * R::EPSILON * solve.first_square) {
        solve.active = false;
        return;
    }
    solve.step = solve.square * (one / curvature);
    solve.change = solve.step * solve.step * solve.energy;
    if solve.change <= tolerance * tolerance * solve.motion {
        solve.active = false;
        return;
    }
    solve.direction_bound = solve.ahead();
    solve.last_square = solve.square;
    solve.count += 1;
    solve.last_bound = solve.bound;
    solve.bound = R::of(4.0) * solve.answer;
    solve.pressure_bound = solve.found + solve.step * solve.direction_bound;
}
