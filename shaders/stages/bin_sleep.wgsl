// Decides which blocks' particles sleep: those that have been at rest for long enough, as has all matter around them,
// and that nothing disturbs. Twin: src/stages/bin_sleep.rs.
//
// A workgroup takes a chunk. Its decision is the same for all chunks of a block.
#import layout
#import linear
#import bins
#import lookup
#import chunk
#import stretch
#import halt
#import rest

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> disturbances: array<Disturbance, DISTURBANCES>;
@group(0) @binding(2) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read_write> bin: array<Place>;
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> table: array<TableEntryView>;
@group(0) @binding(7) var<storage, read_write> blocks: array<SharedBlock>;
@group(0) @binding(8) var<storage, read_write> chunks: array<Chunk>;
@group(0) @binding(9) var<storage, read_write> counters: Counters;

// The block and those up to two away, by planes along z, with a bit for each along x, then y: which have restless
// particles (not at rest for long enough), which have any particles, and which are disturbed.
var<workgroup> restless: array<atomic<u32>, 5>;
var<workgroup> occupied: array<atomic<u32>, 5>;
var<workgroup> stirred: array<atomic<u32>, 5>;

// Bits in a plane: the block's, and those of the block and its neighbours.
const MIDDLE = 1u << 12u;
const INNER = 0xeu << 5u | 0xeu << 10u | 0xeu << 15u;

// The table entry of the block at this distance from another, or NONE.
fn entry_at(at: vec3u, distance: vec3i) -> u32 {
    let there = vec3i(at) + distance;
    if any(there < vec3i(0)) || any(there > vec3i(i32(LAST_BLOCK))) {
        return NONE;
    }
    return find_entry(block_key(vec3u(there)));
}

fn disturbed(at: vec3u, distance: vec3i) -> bool {
    let there = vec3u(vec3i(at) + distance);
    var found = false;
    for (var i = 0u; i < disturbances[0].count; i++) {
        found |= all(disturbances[i].lo <= there) && all(there <= disturbances[i].hi);
    }
    return found;
}

// From the block to the n-th of those up to two away.
fn way_to(n: u32) -> vec3i {
    return vec3i(vec3u(n % 5u, n / 5u % 5u, n / 25u)) - 2;
}

fn note_block(at: vec3u, n: u32) {
    let distance = way_to(n);
    let entry = entry_at(at, distance);
    if entry == NONE {
        return;
    }
    let plane = n / 25u;
    let bit = 1u << (n % 25u);
    if table[entry].restless != 0u {
        atomicOr(&restless[plane], bit);
    }
    if all(abs(distance) <= vec3i(1)) && table[entry].count != 0u {
        atomicOr(&occupied[plane], bit);
        if disturbed(at, distance) {
            atomicOr(&stirred[plane], bit);
        }
    }
}

// In a plane, the blocks that are restless or next to a restless one along x and y. Not valid on the plane's rim.
fn spread(plane: u32) -> u32 {
    let blocks = atomicLoad(&restless[plane]);
    let rows = blocks | blocks << 1u | blocks >> 1u;
    return rows | rows << 5u | rows >> 5u;
}

// In a plane, which of the block and its neighbours hold particles that are awake; `near` are the blocks with restless
// ones around them.
fn awake(plane: u32, near: u32) -> u32 {
    return atomicLoad(&occupied[plane]) & (atomicLoad(&stirred[plane]) | near) & INNER;
}

// Stops a particle that sleeps.
fn stop(p: u32) {
    let u = displacement[p];
    if any(u.xyz != vec3f(0.0)) {
        displacement[p] = vec4f(0.0, 0.0, 0.0, u.w);
        gradient[p].x = vec3f(0.0);
        gradient[p].y = vec3f(0.0);
        gradient[p].z = vec3f(0.0);
    }
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    let mine = stretch(group.x, groups.x, count);
    for (var c = mine.first; c < mine.end; c++) {
        let at = block_coordinates(chunks[c].key);
        if lane < 5u {
            atomicStore(&restless[lane], 0u);
            atomicStore(&occupied[lane], 0u);
            atomicStore(&stirred[lane], 0u);
        }
        workgroupBarrier();
        for (var n = lane; n < 125u; n += LANES) {
            note_block(at, n);
        }
        workgroupBarrier();
        let inner = spread(1u) | spread(2u) | spread(3u);
        let middle = awake(2u, inner);
        let beside = awake(1u, spread(0u) | spread(1u) | spread(2u)) | awake(3u, spread(2u) | spread(3u) | spread(4u));
        var sleep = AWAKE;
        if (middle & MIDDLE) == 0u {
            sleep = select(DEEP, BORDER, (middle | beside) != 0u);
        }
        if lane == 0u {
            chunks[c].sleep = sleep;
            atomicAdd(&counters.asleep, select(0u, chunks[c].count, sleep != AWAKE));
        }
        if lane < 8u && sleep != DEEP {
            let tile = REACHED | select(0u, 1u << lane, sleep == BORDER);
            atomicOr(&blocks[find(neighbour(chunks[c].key, lane))].tiles, tile);
        }
        let disturbs = disturbed(at, vec3i(0));
        let first = chunks[c].start;
        for (var i = first + lane; i < first + chunks[c].count; i += LANES) {
            let p = order[i];
            if sleep != AWAKE {
                bin[p].rest = constants.rest_needed;
                bin[p].entry = NONE;
                stop(p);
            } else {
                bin[p].rest = select(rested(bin[p].rest, displacement[p]), 0u, disturbs);
            }
        }
        workgroupBarrier();
    }
}
