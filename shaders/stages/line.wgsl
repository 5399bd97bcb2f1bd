// Finds the step length along the next direction of search, and bounds of the result. Twin: src/stages/line.rs.
#import layout
#import linear
#import halt
#import force_scale
#import motion_scale
#import scales

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> solve: Solve;
@group(0) @binding(2) var<storage, read_write> counters: Counters;
@group(0) @binding(3) var<storage, read_write> dispatch: Dispatch;

// Whether this is the first pass of a step, before any search.
override FIRST: bool = false;

fn taken_sum(which: u32) -> f32 {
    let low = atomicExchange(&solve.sums[which], 0u);
    return unscaled(low, atomicExchange(&solve.sums[which + 1u], 0u));
}

fn taken_largest(which: u32) -> f32 {
    return bitcast<f32>(atomicExchange(&solve.largest[which], 0u));
}

// A bound for the first answers, from what they are known to be made of before they are found.
fn bound_of_first() -> f32 {
    let known = min(max(taken_largest(ANSWER), LEAST_FIRST), MOST_FIRST);
    let rate = sqrt(bitcast<f32>(atomicLoad(&solve.largest[RATE])));
    return 2.0 * (known + rate) * bitcast<f32>(atomicLoad(&solve.largest[RESPONSE]));
}

fn taken_motion(which: u32) -> f32 {
    return taken_sum(which) * (1.0 / MOTION_SCALE);
}

// The nodes' motion that a change is compared with. Twin: `counted_motion` in src/cpu/solve.rs.
fn counted_motion() -> f32 {
    let squares = taken_motion(MOTION);
    let mass = taken_motion(NODE_MASS);
    let x = taken_motion(MOTION_X) - mass;
    let y = taken_motion(MOTION_Y) - mass;
    let momentum = vec3f(x, y, taken_motion(MOTION_Z) - mass);
    let in_common = dot3(momentum, momentum) * (1.0 / max(mass, LEAST_COUNTED));
    let unit = 1.0 / motion_scale();
    let counted = max(squares - in_common, squares * IN_COMMON);
    return counted * unit * unit + 2.0 * mass * dot3(constants.kick, constants.kick);
}

fn begin() -> bool {
    solve.motion = counted_motion();
    solve.first_bound = bound_of_first();
    solve.bound = solve.first_bound;
#if RESUMES
    solve.bound = max(solve.bound, bitcast<f32>(atomicLoad(&solve.largest[PRESSURE])));
#endif
    solve.chunks = select(atomicLoad(&counters.chunks), 0u, halted());
    return !halted();
}

// Finds the step length; returns whether there is something left to do.
fn go_on() -> bool {
    let compliance = bitcast<f32>(atomicLoad(&solve.largest[COMPLIANCE]));
    // Along the stress carried over, the last of the sums is that of what goes up.
    let resuming = solve.count < RESUMED;
    let last = taken_sum(BOTH);
    let square = (taken_sum(SQUARE) - select(0.0, last, resuming)) * (1.0 / square_scale(compliance));
    let unit = 1.0 / compliant_scale(compliance);
    let answers = taken_sum(ANSWERS) * unit;
    let directions = taken_sum(DIRECTIONS) * unit;
    let both = last * unit;
    let largest_answer = taken_largest(ANSWER);
    let largest_found = taken_largest(FOUND);
    atomicStore(&solve.largest[DIRECTION], 0u);
    let energy = taken_sum(ENERGY) * (1.0 / energy_scale(solve.ahead));
    if solve.count == RESUMED {
        solve.first_square = square;
    }
    // The compliant part for an answer plus `mix` directions. It is summed, not updated: a recurrence subtracts nearly
    // equal numbers.
    let crossed = both - answers - directions;
    let compliant = answers + solve.mix * (crossed + solve.mix * directions);
    let curvature = 4.0 * energy + compliant;
    let leads = curvature > 0.0 && square > LEADING * solve.first_square;
    solve.step = select(0.0, square * (1.0 / curvature), leads);
    solve.change = solve.step * solve.step * energy;
    let ends = !leads || solve.change <= constants.tolerance * constants.tolerance * solve.motion;
    // The stress that is carried over may give no descent, and may be zero.
    if ends && !resuming {
        return false;
    }
    solve.last_square = square;
    solve.direction_bound = solve.ahead;
    solve.count += 1u;
    solve.last_bound = solve.bound;
    solve.bound = select(4.0 * largest_answer, solve.first_bound, resuming);
    solve.pressure_bound = largest_found + solve.step * solve.direction_bound;
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
