// Gathers displacement and gradient for each particle. Twin: src/stages/g2p.rs.
#import layout
#import takes_part
#import kernel
#import bins
#import chunk
#import cells
#import halt
#import gather
#if VOLUMES
#else
#import believed

fn tile_volume(t: u32) -> f32 {
    return gather_tile[t].w;
}
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(7) var<storage, read> grid: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;

fn gather_particle(nodes: ptr<function, Nodes>, first_of_tile: u32, p: u32) {
    let x = position[p];
    let found = gathered(nodes, x.xyz);
    let mass = gradient[p].x.w;
    let material = gradient[p].y.w;
    let rest = gradient[p].z.w;
    gradient[p] = Gradient(vec4f(found.x.xyz, mass), vec4f(found.y.xyz, material), vec4f(found.z.xyz, rest));
#if VOLUMES
    // What volume_g2p measured holds for the whole step.
    displacement[p] = vec4f(found.sum.xyz, displacement[p].w);
#else
    let unit = materials[u32(material)].inverse_density;
    displacement[p] = vec4f(found.sum.xyz, believed(found.sum.w * unit, x, first_of_tile));
#endif
}

// One invocation takes the particles of one cell, and reads the cell's nodes once.
fn gather(first: u32, end: u32, cell: u32) {
    if first >= end {
        return;
    }
    var nodes = cell_nodes(cell);
    let first_of_tile = tile_index(block_at(cell));
    for (var i = first; i < end; i++) {
        gather_particle(&nodes, first_of_tile, order[i]);
    }
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    for (var c = awake_from(group.x, groups.x, count); c < count; c = awake_from(c + groups.x, groups.x, count)) {
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            let at = tile_at(t);
            gather_tile[t] = grid[chunks[c].links[tile_block(at)] * NODES + block_node(at)];
        }
        workgroupBarrier();
        let end = chunks[c].start + chunks[c].count;
        gather(chunks[c].cells[lane], cell_end(c, lane, end), lane);
        workgroupBarrier();
    }
}
