// Turns the effect of the answers on the nodes into velocities along the direction of search, where bodies do not hold
// the nodes. Twin: src/stages/project.rs.
#import layout
#import active
#import idle
#import stretch
#import linear
#import force_scale
#import scales
#import sum64
#import totals
#import hold

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> grid: array<vec4f>;
@group(0) @binding(2) var<storage, read> held: array<Held>;
@group(0) @binding(3) var<storage, read_write> force: array<vec4i>;
@group(0) @binding(4) var<storage, read_write> field: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> solve: Solve;
@group(0) @binding(6) var<storage, read_write> counters: Counters;
#if SLEEP
@group(0) @binding(7) var<storage, read> blocks: array<Block>;
#endif

// Share of the last direction of search in the next. None in the first; none where an answer was cut, since the last
// direction does not match it; and none in the first after the stress carried over, which is no answer.
fn mixing(square: f32, largest_answer: f32) -> f32 {
    if solve.count > RESUMED && largest_answer <= solve.bound {
        return square * (1.0 / solve.last_square);
    }
    return 0.0;
}

// A bound for the next directions of search.
fn ahead(mix: f32, largest_answer: f32, largest_direction: f32) -> f32 {
    return min(largest_answer, solve.bound) + mix * largest_direction;
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_totals(lane);
    let compliance = bitcast<f32>(atomicLoad(&solve.largest[COMPLIANCE]));
    let largest_answer = bitcast<f32>(atomicLoad(&solve.largest[ANSWER]));
    let largest_direction = bitcast<f32>(atomicLoad(&solve.largest[DIRECTION]));
    let sum = unscaled(atomicLoad(&solve.sums[SQUARE]), atomicLoad(&solve.sums[SQUARE + 1u]));
    let mix = mixing(sum * (1.0 / square_scale(compliance)), largest_answer);
    let unit = 1.0 / force_scale(solve.bound);
    let bound = ahead(mix, largest_answer, largest_direction);
    let scale = energy_scale(bound);
    // For line, whose pipeline may round differently.
    if group.x == 0u && lane == 0u {
        solve.mix = mix;
        solve.ahead = bound;
    }
    let first = solve.count == 0u;
    let count = active_blocks(constants.max_blocks);
    var energy = vec2u(0u);
    let mine = stretch(group.x, groups.x, count);
    for (var b = busy_from(mine.first, mine.end); b < mine.end; b = busy_from(b + 1u, mine.end)) {
        for (var node = lane; node < NODES; node += LANES) {
            let i = b * NODES + node;
            let mass = grid[i].w;
            let sum = vec3f(force[i].xyz);
            force[i] = vec4i(0);
            if mass > 0.0 {
                var u = reply(held[i], sum * (unit * (1.0 / mass)));
                if !first {
                    u = u + mix * field[i].xyz;
                }
                field[i] = vec4f(u, 0.0);
                energy = plus(energy, mass * work(held[i], u) * scale);
            }
        }
    }
    note_sum(ENERGY, energy);
    end_totals(lane);
}
