// Notes for each block the colliders that can be touched from it, and resets the gaps that the stage gap records. Twin:
// src/stages/collider_cull.rs.
#import layout
#import active
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

// Whether a bounded body at rest is, by its size, certainly out of reach of all blocks whose middles are no farther than
// `half` from this one along each axis. Where there are many bodies, most are.
fn is_beyond(c: u32, middle: vec3f, half: vec3f) -> bool {
    let t = turn_of(c);
    let moves = any(colliders[c].shift != vec3f(0.0)) || any(t[0] != vec3f(0.0)) || any(t[1] != vec3f(0.0))
        || any(t[2] != vec3f(0.0));
    let kind = colliders[c].kind;
    let size = colliders[c].size;
    let most = size.x + size.y + size.z + (BLOCK_RADIUS + max(constants.max_displacement, LEAST_REACH) + ROUNDING);
    let way = max(abs(middle - colliders[c].position) - half, vec3f(0.0));
    return !moves && kind < SHAPE_GRID && kind != SHAPE_HALF_SPACE && dot3(way, way) > most * most;
}

fn in_reach(c: u32, middle: vec3f) -> bool {
    let body = body_motion(c, middle);
    let t = turn_of(c);
    let turn = sqrt(dot3(t[0], t[0]) + dot3(t[1], t[1]) + dot3(t[2], t[2]));
    let reach = max(constants.max_displacement, LEAST_REACH) + sqrt(dot3(body, body)) + turn * BLOCK_RADIUS;
    var way = surface_at(c, frame(c, middle)).distance;
#if MESHES
    if is_grid(colliders[c].kind) {
        // Also from the shifted place where a mesh beside other bodies is queried.
        way = way * REACH - MOVED * distance_grids[u32(colliders[c].size.x)].spacing;
    }
#endif
    return way <= BLOCK_RADIUS + reach;
}

var<workgroup> block_count: u32;

#if CROWD
// The least and the greatest coordinates of the workgroup's blocks.
var<workgroup> lowest: array<atomic<u32>, 3>;
var<workgroup> highest: array<atomic<u32>, 3>;
// The bodies that may be in reach of any of them, in the format of a block's words.
var<workgroup> near: array<atomic<u32>, MOST_WORDS>;

// Finds these, each invocation some, before each examines them for its own block.
fn look_around(lane: u32, place: vec3u) {
    workgroupBarrier();
    for (var word = lane; word < constants.cull_words; word += GROUP) {
        atomicStore(&near[word], 0u);
    }
    if lane < 3u {
        atomicStore(&lowest[lane], 0xffffffffu);
        atomicStore(&highest[lane], 0u);
    }
    workgroupBarrier();
    for (var a = 0u; a < 3u; a++) {
        atomicMin(&lowest[a], place[a]);
        atomicMax(&highest[a], place[a]);
    }
    workgroupBarrier();
    let low = vec3f(vec3u(atomicLoad(&lowest[0]), atomicLoad(&lowest[1]), atomicLoad(&lowest[2])) * EDGE);
    let high = vec3f(vec3u(atomicLoad(&highest[0]), atomicLoad(&highest[1]), atomicLoad(&highest[2])) * EDGE);
    let half = (high - low) * 0.5;
    let middle = low + half + TO_MIDDLE;
    for (var c = lane; c < constants.collider_count; c += GROUP) {
        if !is_beyond(c, middle, half) {
            atomicOr(&near[c / BODIES_PER_WORD], 1u << (c % BODIES_PER_WORD));
        }
    }
    workgroupBarrier();
}
#endif

// The bodies of a word that a block has to examine.
fn to_look_at(word: u32) -> u32 {
#if CROWD
    return atomicLoad(&near[word]);
#else
    return (1u << constants.collider_count) - 1u;
#endif
}

// Notes the colliders that can be touched from a block.
fn note_bodies(b: u32, place: vec3u) {
    let middle = vec3f(place * EDGE) + TO_MIDDLE;
    var more = 0u;
    for (var word = constants.cull_words; word > 0u; word--) {
        var mask = 0u;
        var rest = to_look_at(word - 1u);
        while rest != 0u {
            let at = firstTrailingBit(rest);
            rest &= rest - 1u;
            let c = (word - 1u) * BODIES_PER_WORD + at;
            if !is_beyond(c, middle, vec3f(0.0)) {
                mask |= select(0u, 1u, in_reach(c, middle)) << at;
            }
        }
        cull[b * constants.cull_words + (word - 1u)] = mask | more;
        more = select(more, MORE, mask != 0u);
    }
}

#if GAPS
// Sets the gaps at the nodes of some blocks to NONE_NEAR, and forgets the faces before them. Invocations write
// neighbouring words; one block for each would put their words far apart.
fn clear_gaps(lane: u32, first: u32, end: u32) {
    for (var node = first * NODES + lane; node < end * NODES; node += GROUP) {
        cull[gap_word(node)] = NONE_NEAR;
    }
#if BOXES
    for (var word = faces_word(first * NODES) + lane; word < faces_word(end * NODES); word += GROUP) {
        cull[word] = 0u;
    }
#endif
}
#endif

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
    @builtin(num_workgroups) groups: vec3u,
) {
    if lane == 0u {
        block_count = active_blocks(constants.max_blocks);
    }
    let count = workgroupUniformLoad(&block_count);
    for (var first = group.x * GROUP; first < count; first += groups.x * GROUP) {
        let b = min(first + lane, count - 1u);
        let place = block_coordinates(blocks[b].key);
#if CROWD
        look_around(lane, place);
#endif
        // The others only take part in the barriers.
        if first + lane < count {
            note_bodies(b, place);
        }
#if GAPS
        clear_gaps(lane, first, min(first + GROUP, count));
#endif
    }
}
