// Adds the effect of the stresses found to the nodes' displacements, and applies boundaries to them. Twin:
// src/stages/settle.rs.
#import layout
#import active
#import idle
#import stretch
#import linear
#import bins
#import bound
#import force_scale
#import scales
#import hold
#if COLLIDERS
#import node_position
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
@group(0) @binding(4) var<storage, read_write> grid: array<vec4f>;
@group(0) @binding(5) var<storage, read> held: array<Held>;
@group(0) @binding(6) var<storage, read_write> force: array<vec4i>;
@group(0) @binding(7) var<storage, read> solve: SolveView;
@group(0) @binding(8) var<storage, read_write> counters: Counters;
#if MESHES
@group(0) @binding(9) var<uniform> distance_grids: array<DistanceGrid, MESHES>;
@group(0) @binding(10) var distances: texture_2d<f32>;
#endif
#if STICKS
@group(0) @binding(11) var<uniform> materials: array<Material, MATERIALS>;
#endif

// The next of an invocation's nodes in a block that holds mass. Those on the way there, which predict has zeroed, are
// skipped.
fn next_node(block: u32, from_node: u32) -> u32 {
    var node = from_node;
    while node < NODES && grid[block * NODES + node].w <= 0.0 {
        force[block * NODES + node] = vec4i(0);
        node += LANES;
    }
    return node;
}

// The displacement `u`, of which the part in the directions in which the node is free is shortened to the bound. The rest
// is for the body that holds the node to take, however fast stresses would make it.
fn slowed_where_free(at: Held, u: vec3f) -> vec3f {
    if !is_fast(u) {
        return u;
    }
    let moved = free(at, u);
    return select(u, (u - moved) + slowed(moved), is_fast(moved));
}

fn settle(i: u32, block: u32, node: u32, unit: f32) -> vec4f {
    let before = grid[i];
    let sum = vec3f(force[i].xyz);
    force[i] = vec4i(0);
    let at = held[i];
    var u = slowed_where_free(at, before.xyz + sum * (unit * (1.0 / before.w)));
#if LOADS
    load_weight = before.w * constants.load_scale;
#endif
#if COLLIDERS
    u = kept_out(block, node, before.w, u, FRICTION_FULL);
#endif
    // The pressures were found with these nodes held; contact may release them in the next step.
    if directions(at) > 0u {
        let touched = u;
        u = free(at, u) + (at.motion - free(at, at.motion));
#if LOADS
        let body = at.count_and_body >> 2u;
        if body != NO_BODY && colliders[body].load != NO_LOAD {
            note_load(body, block, node_position(block, node), touched - u);
        }
#endif
    }
    return vec4f(u, before.w);
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let unit = 1.0 / force_scale(solve.pressure_bound);
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
                grid[i] = settle(i, b, node, unit);
            }
            node = next_node(b, node + LANES);
            if node >= NODES {
                break;
            }
        }
    }
}
