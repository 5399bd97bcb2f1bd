// Decides which blocks' particles sleep: those that have been at rest for long enough, and all around them as well, where nothing
// disturbs them. Twin: src/stages/bin_sleep.rs.
//
// A workgroup takes a chunk. What it decides is the same for all chunks of a block.
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

const LAST_BLOCK = 1023;

// Whether there are restless particles in the block and in those up to two away.
var<workgroup> restless: array<u32, 125>;
// Whether the block and those around it hold particles that are awake.
var<workgroup> awake: array<u32, 27>;

// The table entry of the block at a distance from another, or NONE.
fn entry_at(at: vec3u, distance: vec3i) -> u32 {
    let there = vec3i(at) + distance;
    if any(there < vec3i(0)) || any(there > vec3i(LAST_BLOCK)) {
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

// Coordinates of the n-th of a cube of so many along each axis, from its middle.
fn from_middle(n: u32, along: u32) -> vec3i {
    return vec3i(vec3u(n % along, n / along % along, n / (along * along))) - i32(along / 2u);
}

fn is_awake(at: vec3u, distance: vec3i) -> bool {
    let entry = entry_at(at, distance);
    if entry == NONE || table[entry].count == 0u {
        return false;
    }
    if disturbed(at, distance) {
        return true;
    }
    var found = 0u;
    for (var n = 0u; n < 27u; n++) {
        let there = vec3u(distance + from_middle(n, 3u) + 2);
        found |= restless[(there.z * 5u + there.y) * 5u + there.x];
    }
    return found != 0u;
}

// What sleeps does not move.
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
        for (var n = lane; n < 125u; n += LANES) {
            let entry = entry_at(at, from_middle(n, 5u));
            restless[n] = 0u;
            if entry != NONE {
                restless[n] = table[entry].restless;
            }
        }
        workgroupBarrier();
        for (var n = lane; n < 27u; n += LANES) {
            awake[n] = u32(is_awake(at, from_middle(n, 3u)));
        }
        workgroupBarrier();
        var sleep = AWAKE;
        if awake[13] == 0u {
            sleep = DEEP;
            for (var n = 0u; n < 27u; n++) {
                sleep = select(sleep, BORDER, awake[n] != 0u);
            }
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
            bin[p].rest = select(rested(bin[p].rest, displacement[p]), 0u, disturbs);
            if sleep != AWAKE {
                bin[p].entry = NONE;
                stop(p);
            }
        }
        workgroupBarrier();
    }
}
