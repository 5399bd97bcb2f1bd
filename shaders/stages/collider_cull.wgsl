// Notes for each block which colliders can be touched from it, and makes room for gap to note how far. Twin: src/stages/collider_cull.rs.
#import layout
#import linear
#import bins
#import kernel
#import sdf
#import contact

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<colliders> colliders: Colliders;
@group(0) @binding(2) var<storage, read> blocks: array<Block>;
@group(0) @binding(3) var<storage, read_write> cull: array<u32>;
@group(0) @binding(4) var<storage, read_write> counters: Counters;
#if MESHES
@group(0) @binding(5) var<uniform> distance_grids: array<DistanceGrid, MESHES>;
@group(0) @binding(6) var distances: texture_2d<f32>;
#endif

// From a block's first node to the middle of its nodes and particles, cells along each axis.
const TO_MIDDLE = 2.25;
// Distance from that middle to the farthest node or particle.
const BLOCK_RADIUS = 3.8972;

// Whether a body at rest and bounded is out of reach for sure, by its size: most are where there are many.
fn is_beyond(c: u32, middle: vec3f) -> bool {
    let t = colliders[c].turn;
    let moves = any(colliders[c].shift != vec3f(0.0)) || any(t[0] != vec3f(0.0)) || any(t[1] != vec3f(0.0))
        || any(t[2] != vec3f(0.0));
    let kind = colliders[c].kind;
    let size = colliders[c].size;
    let most = size.x + size.y + size.z + (BLOCK_RADIUS + max(constants.max_displacement, LEAST_REACH) + ROUNDING);
    let way = middle - colliders[c].position;
    return !moves && kind < SHAPE_GRID && kind != SHAPE_HALF_SPACE && dot3(way, way) > most * most;
}

fn in_reach(c: u32, middle: vec3f) -> bool {
    let body = body_motion(c, middle);
    let t = colliders[c].turn;
    let turn = sqrt(dot3(t[0], t[0]) + dot3(t[1], t[1]) + dot3(t[2], t[2]));
    let reach = max(constants.max_displacement, LEAST_REACH) + sqrt(dot3(body, body)) + turn * BLOCK_RADIUS;
    var way = surface_at(c, frame(c, middle)).distance;
#if MESHES
    if is_grid(colliders[c].kind) {
        way *= REACH;
    }
#endif
    return way <= BLOCK_RADIUS + reach;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let count = min(atomicLoad(&counters.occupied) + atomicLoad(&counters.halo), constants.max_blocks);
    for (var b = id.x; b < count; b += groups.x * GROUP) {
        let middle = vec3f(block_coordinates(blocks[b].key) * EDGE) + TO_MIDDLE;
        for (var word = 0u; word < constants.cull_words; word++) {
            var mask = 0u;
            let first = word * 32u;
            for (var c = first; c < min(first + 32u, constants.collider_count); c++) {
                if !is_beyond(c, middle) {
                    mask |= select(0u, 1u, in_reach(c, middle)) << (c - first);
                }
            }
            cull[b * constants.cull_words + word] = mask;
        }
#if GAPS
        let gaps = constants.max_blocks * constants.cull_words + b * NODES;
        for (var node = 0u; node < NODES; node++) {
            cull[gaps + node] = NONE_NEAR;
        }
#endif
    }
}
