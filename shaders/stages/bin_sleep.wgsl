// Puts the particles of blocks that are not awake to sleep, and notes which nodes they hold. Twin:
// src/stages/bin_sleep.rs.
//
// A workgroup takes a chunk. Its decision is the same for all chunks of a block.
#import layout
#import linear
#import bins
#import neighbours
#import lookup
#import around
#import chunk
#import stretch
#import halt
#import rest

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(3) var<storage, read_write> bin: array<Place>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> table: array<TableEntryView>;
@group(0) @binding(6) var<storage, read_write> blocks: array<SharedBlock>;
@group(0) @binding(7) var<storage, read_write> chunks: array<Chunk>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;

// Which of the block and those around it are awake, by bits.
var<workgroup> awake: atomic<u32>;

// Stops a particle that has not slept before.
fn fall_asleep(p: u32) {
    if (bin[p].rest & ASLEEP) != 0u {
        return;
    }
    bin[p].rest = constants.rest_needed | ASLEEP;
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
        if lane == 0u {
            atomicStore(&awake, 0u);
        }
        workgroupBarrier();
        for (var n = lane; n < AROUND; n += LANES) {
            let entry = entry_around(at, n);
            if entry != NONE && (table[entry].unrest & WOKEN) != 0u {
                atomicOr(&awake, 1u << n);
            }
        }
        workgroupBarrier();
        let near = atomicLoad(&awake);
        var sleep = AWAKE;
        if ((near >> MIDDLE) & 1u) == 0u {
            sleep = select(DEEP, BORDER, near != 0u);
        }
        if lane == 0u {
            chunks[c].sleep = sleep;
            atomicAdd(&counters.asleep, select(0u, chunks[c].count, sleep != AWAKE));
        }
        if lane < 8u && sleep != DEEP {
            let tile = REACHED | select(0u, 1u << lane, sleep == BORDER);
            atomicOr(&blocks[find(neighbour(chunks[c].key, lane))].tiles, tile);
        }
        let unrest = table[blocks[chunks[c].block].entry].unrest;
        let disturbs = (unrest & DISTURBED) != 0u;
        let falls = sleep != AWAKE && (unrest & DROWSY) != 0u;
        let first = chunks[c].start;
        let end = first + chunks[c].count;
        for (var i = first + lane; falls && i < end; i += LANES) {
            fall_asleep(order[i]);
        }
        for (var i = first + lane; sleep == AWAKE && i < end; i += LANES) {
            let p = order[i];
            bin[p].rest = select(rested(bin[p].rest, displacement[p]), 0u, disturbs);
        }
        workgroupBarrier();
    }
}
