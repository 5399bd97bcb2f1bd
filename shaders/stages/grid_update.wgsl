// Turns sums into displacements, adds gravity and the effect of tools, applies boundaries. Twin:
// src/stages/grid_update.rs.
//
// In place: a node's four integers become its displacement and mass as floats. After g2p2g the integers of its momentum
// lie apart.
#import layout
#import active
#import idle
#import stretch
#import linear
#import bins
#import bound
#import momentum_scale
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
@group(0) @binding(5) var<storage, read_write> counters: Counters;
#if MESHES
@group(0) @binding(6) var<uniform> distance_grids: array<DistanceGrid, MESHES>;
@group(0) @binding(7) var distances: texture_2d<f32>;
#endif
#if TOOLS
@group(0) @binding(8) var<uniform> tools: array<Tool, TOOLS>;
#endif
#if STICKS
@group(0) @binding(9) var<uniform> materials: array<Material, MATERIALS>;
#endif
#if REPEATS
@group(0) @binding(10) var<storage, read_write> force: array<vec4i>;
#endif

// Whether this is the first iteration of a step, in which gravity enters.
override FIRST: bool = false;

fn is_empty(i: u32) -> bool {
#if REPEATS
    // Momentum may be left where the mass rounds to nothing.
    if !FIRST && any(force[i] != vec4i(0)) {
        return false;
    }
#endif
    return all(grid[i] == vec4u(0u));
}

// Takes the sums of a node. Later iterations of g2p2g sum momentum alone; mass is what the first has left.
fn take_sums(i: u32) -> vec4u {
#if REPEATS
    if !FIRST {
        let momentum = force[i].xyz;
        force[i] = vec4i(0);
        return vec4u(bitcast<vec3u>(momentum), u32(bitcast<f32>(grid[i].w) * constants.mass_scale));
    }
#endif
    return grid[i];
}

// The next of an invocation's nodes in a block that holds anything.
fn next_node(block: u32, from_node: u32) -> u32 {
    var node = from_node;
    while node < NODES && is_empty(block * NODES + node) {
        node += LANES;
    }
    return node;
}

// The scale of the momentum sums.
var<private> scale: f32;

fn solve_node(sum: vec4u, block: u32, node: u32) -> vec4f {
    if sum.w == 0u {
        return vec4f(0.0);
    }
    let free = free_node(sum, block, node, scale, FIRST);
#if SLEEP
    if stands_still(blocks[block].tiles, node) {
        return vec4f(vec3f(0.0), free.w);
    }
#endif
    var u = slowed(free.xyz);
#if LOADS
    load_weight = free.w * constants.load_scale;
#endif
#if COLLIDERS
    u = kept_out(block, node, free.w, u, FRICTION_FULL);
#endif
    return vec4f(u, free.w);
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    scale = momentum_scale();
#if STICKS
    begin_drag();
#endif
    let count = active_blocks(constants.max_blocks);
    let mine = stretch(group.x, groups.x, count);
    for (var b = busy_from(mine.first, mine.end); b < mine.end; b = busy_from(b + 1u, mine.end)) {
        var node = next_node(b, lane);
        loop {
            if node < NODES {
                let i = b * NODES + node;
                grid[i] = bitcast<vec4u>(solve_node(take_sums(i), b, node));
            }
            node = next_node(b, node + LANES);
            if node >= NODES {
                break;
            }
        }
    }
}
