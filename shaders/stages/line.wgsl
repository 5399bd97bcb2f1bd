// Finds how far to go along the next direction of search, how much of the last there is in it, and bounds for what comes of
// it. Twin: src/stages/line.rs.
#import layout
#import halt
#import scales

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> solve: Solve;
@group(0) @binding(2) var<storage, read_write> counters: Counters;
@group(0) @binding(3) var<storage, read_write> dispatch: Dispatch;

// Whether this is the first of a step, before any search.
override FIRST: bool = false;

// Takes a sum, before scaling. Both words are rounded to nearest, and so is their sum.
fn taken_sum(which: u32) -> f32 {
    let low = atomicExchange(&solve.sums[which], 0u);
    let high = atomicExchange(&solve.sums[which + 1u], 0u);
    return f32(high) * 0x1p32f + f32(low);
}

fn taken_largest(which: u32) -> f32 {
    return bitcast<f32>(atomicExchange(&solve.largest[which], 0u));
}

fn begin() -> bool {
    solve.motion = taken_sum(MOTION) * (1.0 / MOTION_SCALE);
    solve.bound = 0.0625 + 2.0 * sqrt(taken_largest(RATE));
    solve.chunks = atomicLoad(&counters.chunks);
    return !halted();
}

// Whether there is something left to do.
fn go_on() -> bool {
    let square = taken_sum(SQUARE) * (1.0 / square_scale(solve.bound));
    let compliant = taken_sum(COMPLIANT) * (1.0 / square_scale(solve.bound));
    let energy = 4.0 * (taken_sum(ENERGY) * (1.0 / energy_scale(solve.bound)));
    let answer = taken_largest(ANSWER);
    let direction = taken_largest(DIRECTION);
    let found = taken_largest(FOUND);
    // Where an answer was cut, it is not what the last direction is made for: the search begins anew along it.
    let begun = solve.count > 0u && answer <= solve.bound;
    var curvature = compliant + energy;
    solve.mix = 0.0;
    if begun {
        solve.mix = square * (1.0 / solve.last_square);
        curvature = curvature - solve.mix * (square * (1.0 / solve.step));
    }
    if solve.count == 0u {
        solve.first_square = square;
    }
    // Below that, rounding leads on.
    if !(curvature > 0.0 && square > 0x1p-20f * solve.first_square) {
        return false;
    }
    solve.step = square * (1.0 / curvature);
    // A quarter of the step times the square is how the nodes' velocities change, as the square by mass.
    solve.change = 0.25 * (solve.step * square);
    if solve.change <= constants.tolerance * constants.tolerance * solve.motion {
        return false;
    }
    solve.last_square = square;
    solve.count += 1u;
    solve.last_bound = solve.bound;
    solve.bound = 4.0 * answer;
    solve.pressure_bound = found + solve.step * (answer + solve.mix * direction);
    return true;
}

@compute @workgroup_size(1)
fn main() {
    if FIRST {
        solve.going_on = u32(begin());
        atomicStore(&dispatch.solve_nodes.x, solve.going_on * atomicLoad(&dispatch.nodes.x));
        atomicStore(&dispatch.solve_chunks.x, solve.going_on * atomicLoad(&dispatch.chunks.x));
    } else if solve.going_on != 0u {
        if !go_on() {
            solve.going_on = 0u;
            atomicStore(&dispatch.solve_nodes.x, 0u);
            atomicStore(&dispatch.solve_chunks.x, 0u);
        }
    }
}
