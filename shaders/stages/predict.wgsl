// Turns sums into the displacements due to the motion and the pressures at the beginning of the step, applies
// boundaries, and records where they hold nodes. Twin: src/stages/predict.rs.
//
// In place: a node's four integers become its displacement, without boundaries, and mass as floats.
#import layout
#import active
#import idle
#import stretch
#import linear
#import bins
#import bound
#import momentum_scale
#import force_scale
#import motion_scale
#import sum64
#import totals
#import node
#if SLEEP
#import still
#endif
#if COLLIDERS
#import kernel
#import sdf
#import contact
#import kept_out
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
#if COLLIDERS
@group(0) @binding(1) var<colliders> colliders: Colliders;
#endif
@group(0) @binding(2) var<storage, read> blocks: array<Block>;
#if COLLIDERS
@group(0) @binding(3) var<storage, read> cull: array<u32>;
#endif
@group(0) @binding(4) var<storage, read_write> grid: array<vec4u>;
@group(0) @binding(5) var<storage, read_write> field: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> held: array<Held>;
@group(0) @binding(7) var<storage, read_write> solve: Solve;
@group(0) @binding(8) var<storage, read_write> counters: Counters;
#if MESHES
@group(0) @binding(9) var<uniform> distance_grids: array<DistanceGrid, MESHES>;
@group(0) @binding(10) var distances: texture_2d<f32>;
#endif
#if TOOLS
@group(0) @binding(11) var<uniform> tools: array<Tool, TOOLS>;
#endif
#if STICKS
@group(0) @binding(12) var<uniform> materials: array<Material, MATERIALS>;
#endif

// The next of an invocation's nodes in a block that holds mass; zeroes those on the way there.
fn next_node(block: u32, from_node: u32) -> u32 {
    var node = from_node;
    while node < NODES && grid[block * NODES + node].w == 0u {
        let i = block * NODES + node;
        grid[i] = vec4u(0u);
        field[i] = vec4f(0.0);
        held[i] = Held(vec3f(0.0), 0u, vec3f(0.0), 0.0);
        node += LANES;
    }
    return node;
}

// An invocation's largest square of the scaled motion of a node, and its sums over nodes: see `counted_motion` in
// stages/line.wgsl.
var<private> largest: f32;
var<private> motion: array<vec2u, 5>;
var<private> counted_scale: f32;
// The scale of the momentum sums.
var<private> scale: f32;

// Notes the motion of a node of this mass; along each axis moved by one, so that none is negative.
fn note_node(mass: f32, u: vec3f) {
    let scaled = u * counted_scale;
    let square = dot3(scaled, scaled);
    largest = max(largest, square);
    let along = scaled + vec3f(1.0);
    motion[0] = plus(motion[0], mass * square * MOTION_SCALE);
    motion[1] = plus(motion[1], mass * MOTION_SCALE);
    motion[2] = plus(motion[2], mass * along.x * MOTION_SCALE);
    motion[3] = plus(motion[3], mass * along.y * MOTION_SCALE);
    motion[4] = plus(motion[4], mass * along.z * MOTION_SCALE);
}

// Predicts a node's motion.
fn predict(block: u32, node: u32, i: u32, pressure: f32) {
    var free = free_node(grid[i], block, node, scale, true);
    if pressure <= 0.0 {
        free = vec4f(slowed(free.xyz), free.w);
    }
    grid[i] = bitcast<vec4u>(free);
#if SLEEP
    if stands_still(blocks[block].tiles, node) {
        field[i] = vec4f(0.0);
        held[i] = Held(vec3f(0.0), 3u | (NO_BODY << 2u), vec3f(0.0), 0.0);
        return;
    }
#endif
    var u = free.xyz;
#if COLLIDERS
    held_axis = vec3f(0.0);
    held_count = 0u;
    held_body = NO_BODY;
#if STICKS
    held_braked = 0.0;
#endif
    u = kept_out(block, node, free.w, u, FRICTION_STICKING);
    held[i] = held_with(u);
#else
    held[i] = Held(vec3f(0.0), 0u, u, 0.0);
#endif
    field[i] = vec4f(u, 0.0);
    note_node(free.w, u);
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_totals(lane);
    scale = momentum_scale();
    counted_scale = motion_scale();
#if STICKS
    begin_drag();
#endif
#if RESUMES
    let pressure = 0.0;
#else
    let pressure = bitcast<f32>(atomicLoad(&solve.largest[PRESSURE]));
#endif
    let count = active_blocks(constants.max_blocks);
    let mine = stretch(group.x, groups.x, count);
    for (var b = busy_from(mine.first, mine.end); b < mine.end; b = busy_from(b + 1u, mine.end)) {
        var node = next_node(b, lane);
        loop {
            if node < NODES {
                predict(b, node, b * NODES + node, pressure);
            }
            node = next_node(b, node + LANES);
            if node >= NODES {
                break;
            }
        }
    }
    note_sum(MOTION, motion[0]);
    note_sum(NODE_MASS, motion[1]);
    note_sum(MOTION_X, motion[2]);
    note_sum(MOTION_Y, motion[3]);
    note_sum(MOTION_Z, motion[4]);
    note_largest(ANSWER, sqrt(largest) * (1.0 / counted_scale));
    end_totals(lane);
}
