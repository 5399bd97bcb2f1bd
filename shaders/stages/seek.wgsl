// Takes a step of conjugate gradients towards the pressures, and sums on the nodes what they do. Twin: src/stages/seek.rs.
#import layout
#import kernel
#import bins
#import cells
#import gather
#import scatter
#import scales
#import wide
#import totals

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(3) var<storage, read_write> search: array<Search>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(6) var<storage, read> field: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> force: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> solve: Solve;

// Whether this is the first of a step, and whether it is the last, which sums the pressures themselves.
override FIRST: bool = false;
override LAST: bool = false;
// Pressures bring no mass.
const FOURTH = false;

// What line has found, read once by each invocation.
struct Found {
    bound: f32,
    last_bound: f32,
    step: f32,
    mix: f32,
}
var<private> line: Found;

// What an invocation notes of its particles.
var<private> square: vec2u;
var<private> answers: vec2u;
var<private> directions: vec2u;
var<private> both: vec2u;
var<private> largest_answer: f32;
var<private> largest_direction: f32;
var<private> largest_found: f32;

fn within(x: f32, bound: f32) -> f32 {
    return min(max(x, -bound), bound);
}

// About the pressure that takes the residual back.
fn answer(s: Search) -> f32 {
    return s.residual * (1.0 / (s.compliance + 1.0));
}

// The divergence that takes back the error in volume.
fn wanted(ratio: f32, compliance: f32) -> f32 {
    return within(1.0 / ratio - 1.0, MAX_ERROR + MAX_LOAD * compliance);
}

// The search of a particle after what the last direction has done.
fn sought(before: Search, p: u32, divergence: f32) -> Search {
    var s = before;
    var residual = 0.0;
    if FIRST {
        residual = wanted(position[p].w, s.compliance) - divergence - s.compliance * gradient[p].z.w;
    } else {
        s.direction = within(answer(s), line.last_bound) + s.direction * line.mix;
        s.pressure += s.direction * line.step;
        residual = s.residual - (divergence + s.compliance * s.direction) * line.step;
    }
    // Particles that take no part have no compliance.
    s.residual = select(0.0, residual, s.compliance > 0.0);
    return s;
}

fn note(s: Search, p: u32, square_scale: f32, compliant_scale: f32) {
    let next = within(answer(s), line.bound);
    let mass = gradient[p].x.w;
    square = plus(square, mass * square_scale * (s.residual * next));
    let weight = mass * (s.compliance * compliant_scale);
    answers = plus(answers, weight * (next * next));
    directions = plus(directions, weight * (s.direction * s.direction));
    both = plus(both, weight * ((next + s.direction) * (next + s.direction)));
    // The answer as it would be without the bound, so that it is known where one was cut.
    largest_answer = max(largest_answer, abs(answer(s)));
    largest_direction = max(largest_direction, abs(s.direction));
    largest_found = max(largest_found, abs(s.pressure));
}

// One invocation takes the particles of one cell.
fn step_cell(first: u32, end: u32, cell: u32) {
    if first >= end {
        return;
    }
    var nodes = cell_nodes(cell);
    let largest_compliance = bitcast<f32>(atomicLoad(&solve.largest[COMPLIANCE]));
    let scales = vec2f(square_scale(largest_compliance), compliant_scale(largest_compliance));
    for (var i = first; i < end; i++) {
        let p = order[i];
        let found = gathered(&nodes, position[p].xyz);
        let s = sought(search[p], p, found.x.x + found.y.y + found.z.z);
        search[p] = s;
        note(s, p, scales.x, scales.y);
    }
}

fn scatter_cell(first: u32, end: u32, cell: u32) {
    if first >= end {
        return;
    }
    let bound = select(line.bound, solve.pressure_bound, LAST);
    let scale = force_scale(bound);
    var sums = Sums();
    for (var i = first; i < end; i++) {
        let p = order[i];
        let s = search[p];
        let g = gradient[p];
        var pressure = s.pressure;
        if !LAST {
            pressure = within(answer(s), bound);
        }
        let q = pressure * (g.x.w * scale);
        add_affine(&sums, position[p].xyz, vec4f(0.0), vec4f(q, 0.0, 0.0, 0.0), vec4f(0.0, q, 0.0, 0.0), vec4f(0.0, 0.0, q, 0.0));
        if LAST {
            gradient[p].z.w = g.z.w + s.pressure;
        }
    }
    add_cell(&sums, cell);
}

fn add_to_force(t: u32, c: u32) {
    let word = 4u * t;
    let at = tile_at(t);
    let node = 4u * (chunks[c].links[tile_block(at)] * NODES + block_node(at));
    for (var channel = 0u; channel < 3u; channel++) {
        let sum = atomicLoad(&scatter_tile[word + channel]);
        if sum != 0u {
            atomicAdd(&force[node + channel], sum);
        }
    }
}

var<workgroup> chunk_count: u32;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_totals(lane);
    if lane == 0u {
        chunk_count = solve.chunks;
    }
    let count = workgroupUniformLoad(&chunk_count);
    let going_on = solve.going_on != 0u;
    line = Found(solve.bound, solve.last_bound, solve.step, solve.mix);
    for (var c = group.x; c < count; c += groups.x) {
        clear_scatter_tile(lane);
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            let at = tile_at(t);
            gather_tile[t] = field[chunks[c].links[tile_block(at)] * NODES + block_node(at)];
        }
        workgroupBarrier();
        let first = chunks[c].cells[lane];
        let end = cell_end(c, lane, chunks[c].start + chunks[c].count);
        if going_on {
            step_cell(first, end, lane);
        }
        scatter_cell(first, end, lane);
        workgroupBarrier();
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            add_to_force(t, c);
        }
        workgroupBarrier();
    }
    note_sum(SQUARE, square);
    note_sum(ANSWERS, answers);
    note_sum(DIRECTIONS, directions);
    note_sum(BOTH, both);
    note_largest(ANSWER, largest_answer);
    note_largest(DIRECTION, largest_direction);
    note_largest(FOUND, largest_found);
    end_totals(lane);
}
