// Sorts the particles of each chunk by cell, and notes its cells and the blocks of its tile. Twin:
// src/stages/bin_sort.rs.
//
// A particle's cell is the place of its first node in its block. Particles of one cell share their 27 nodes, so that in
// the transfers one invocation can own a cell and access each node once. Cells that hold particles are noted, the
// fullest first, so that neighbouring invocations have about equally many particles, and those without a cell are
// neighbours too.
#import layout
#import kernel
#import bins
#import chunk
#import stretch
#import cells
#import halt

@group(0) @binding(0) var<storage, read> position: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> order: array<u32>;
@group(0) @binding(2) var<storage, read_write> chunks: array<Chunk>;
@group(0) @binding(3) var<storage, read> links: array<u32>;
@group(0) @binding(4) var<storage, read> table: array<TableEntryView>;
@group(0) @binding(5) var<storage, read_write> counters: Counters;

var<workgroup> particles: array<u32, CHUNK>;
var<workgroup> places: array<vec2u, CHUNK>;
// Two counts in each word: the particles of each cell, and how many cells have a number of particles, the largest number
// first.
var<workgroup> counts: array<atomic<u32>, NODES>;
// The sums of all counts before.
var<workgroup> before: array<u32, NODES>;
var<workgroup> scanned: array<u32, LANES>;
#if SLEEP
var<workgroup> chunk_sleep: u32;
#endif

// Cells per invocation.
const CELLS = NODES / LANES;

// In the words of both counts and in their sums: one cell, the cells, and the particles.
const ONE_CELL = 1u << 16u;

fn cells_of(word: u32) -> u32 {
    return word >> 16u;
}

fn particles_of(word: u32) -> u32 {
    return word & 0xffffu;
}

// The first chunk from `c` on that brings mass to the nodes; `end` if there is none before that. The whole workgroup must
// call this.
fn sorted_from(c: u32, end: u32, lane: u32) -> u32 {
#if SLEEP
    var next = c;
    while next < end {
        if lane == 0u {
            chunk_sleep = chunks[next].sleep;
        }
        if workgroupUniformLoad(&chunk_sleep) != DEEP {
            break;
        }
        next++;
    }
    return next;
#else
    return c;
#endif
}

// Where the cells with this number of particles are counted, the fullest first.
fn standing(count: u32) -> u32 {
    return NODES - min(count, NODES);
}

// The sum over the invocations before this one. The whole workgroup must call this.
fn sum_before(lane: u32, value: u32) -> u32 {
    scanned[lane] = value;
    workgroupBarrier();
    for (var back = 1u; back < LANES; back *= 2u) {
        let further = select(0u, scanned[max(lane, back) - back], lane >= back);
        workgroupBarrier();
        scanned[lane] += further;
        workgroupBarrier();
    }
    return scanned[lane] - value;
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    let first_cell = lane * CELLS;
    let mine = stretch(group.x, groups.x, count);
    for (var c = sorted_from(mine.first, mine.end, lane); c < mine.end; c = sorted_from(c + 1u, mine.end, lane)) {
        let first = chunks[c].start;
        let particle_count = chunks[c].count;
        if lane < 8u {
            chunks[c].links[lane] = table[links[chunks[c].block * 8u + lane]].block;
        }
        for (var i = 0u; i < CELLS; i++) {
            atomicStore(&counts[first_cell + i], 0u);
        }
        workgroupBarrier();
        let origin = block_coordinates(chunks[c].key) * EDGE;
        for (var i = lane; i < particle_count; i += LANES) {
            let p = order[first + i];
            let cell = block_node(base(position[p].xyz) - origin);
            particles[i] = p;
            places[i] = vec2u(cell, atomicAdd(&counts[cell], 1u));
        }
        workgroupBarrier();
        var own: array<u32, CELLS>;
        for (var i = 0u; i < CELLS; i++) {
            own[i] = atomicLoad(&counts[first_cell + i]);
        }
        workgroupBarrier();
        // The rank of each cell among those with equally many particles.
        var ranks: array<u32, CELLS>;
        for (var i = 0u; i < CELLS; i++) {
            if own[i] != 0u {
                ranks[i] = cells_of(atomicAdd(&counts[standing(own[i])], ONE_CELL));
            }
        }
        workgroupBarrier();
        var sums: array<u32, CELLS>;
        var sum = 0u;
        for (var i = 0u; i < CELLS; i++) {
            sums[i] = sum;
            sum += atomicLoad(&counts[first_cell + i]);
        }
        let further = sum_before(lane, sum);
        for (var i = 0u; i < CELLS; i++) {
            sums[i] += further;
            before[first_cell + i] = sums[i];
        }
        if lane == LANES - 1u {
            chunks[c].cell_count = cells_of(further + sum);
        }
        workgroupBarrier();
        for (var i = 0u; i < CELLS; i++) {
            if own[i] != 0u {
                let place = cells_of(before[standing(own[i])]) + ranks[i];
                chunks[c].cells[place] = packed_cell(first_cell + i, particles_of(sums[i]), own[i]);
            }
        }
        for (var i = lane; i < particle_count; i += LANES) {
            order[first + particles_of(before[places[i].x]) + places[i].y] = particles[i];
        }
        workgroupBarrier();
    }
}
