// Sorts the particles of each chunk by cell, and notes the blocks of its tile. Twin: src/stages/bin_sort.rs.
//
// A cell is the place of a particle's first node in its block. Particles of one cell share their 27 nodes, so that the
// transfers can let one invocation own a cell and touch each node once.
#import layout
#import kernel
#import bins
#import chunk
#import halt

@group(0) @binding(0) var<storage, read> position: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> order: array<u32>;
@group(0) @binding(2) var<storage, read_write> chunks: array<Chunk>;
@group(0) @binding(3) var<storage, read> links: array<u32>;
@group(0) @binding(4) var<storage, read> table: array<TableEntryView>;
@group(0) @binding(5) var<storage, read_write> counters: Counters;

var<workgroup> counts: array<atomic<u32>, NODES>;
var<workgroup> particles: array<u32, CHUNK>;
var<workgroup> places: array<vec2u, CHUNK>;
var<workgroup> starts: array<u32, NODES>;
#if SLEEP
var<workgroup> chunk_sleep: u32;
#endif

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    for (var c = group.x; c < count; c += groups.x) {
#if SLEEP
        if lane == 0u {
            chunk_sleep = chunks[c].sleep;
        }
        if workgroupUniformLoad(&chunk_sleep) == DEEP {
            continue;
        }
#endif
        let first = chunks[c].start;
        let particle_count = chunks[c].count;
        if lane < 8u {
            chunks[c].links[lane] = table[links[chunks[c].block * 8u + lane]].block;
        }
        atomicStore(&counts[lane], 0u);
        workgroupBarrier();
        let origin = block_coordinates(chunks[c].key) * EDGE;
        for (var i = lane; i < particle_count; i += GROUP) {
            let p = order[first + i];
            let cell = block_node(base(position[p].xyz) - origin);
            particles[i] = p;
            places[i] = vec2u(cell, atomicAdd(&counts[cell], 1u));
        }
        workgroupBarrier();
        // Inclusive sums by doubling steps, then exclusive ones.
        let own = atomicLoad(&counts[lane]);
        starts[lane] = own;
        workgroupBarrier();
        for (var back = 1u; back < NODES; back *= 2u) {
            let before = select(0u, starts[max(lane, back) - back], lane >= back);
            workgroupBarrier();
            starts[lane] += before;
            workgroupBarrier();
        }
        starts[lane] -= own;
        chunks[c].cells[lane] = first + starts[lane];
        workgroupBarrier();
        for (var i = lane; i < particle_count; i += GROUP) {
            order[first + starts[places[i].x] + places[i].y] = particles[i];
        }
        workgroupBarrier();
    }
}
