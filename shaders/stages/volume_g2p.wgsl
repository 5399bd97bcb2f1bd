// Gathers the volume fraction at each particle. Twin: src/stages/volume_g2p.rs.
#import layout
#import takes_part
#import kernel
#import bins
#import chunk
#import cells
#import halt
#import believed

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read> order: array<u32>;
@group(0) @binding(4) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(5) var<storage, read> grid: array<vec4u>;
@group(0) @binding(6) var<storage, read_write> counters: Counters;

var<workgroup> tile: array<f32, TILE_NODES>;

fn tile_volume(t: u32) -> f32 {
    return tile[t];
}

fn row(n: u32, s: Stencil) -> f32 {
    return tile[n] * s.w0.x + tile[n + 1u] * s.w1.x + tile[n + 2u] * s.w2.x;
}

fn plane(n: u32, s: Stencil) -> f32 {
    return row(n, s) * s.w0.y + row(n + TILE_EDGE, s) * s.w1.y + row(n + 2u * TILE_EDGE, s) * s.w2.y;
}

fn gather(first: u32, end: u32, cell: u32) {
    const PLANE = TILE_EDGE * TILE_EDGE;
    let n = tile_index(block_at(cell));
    for (var i = first; i < end; i++) {
        let p = order[i];
        let x = position[p];
        let s = stencil(x.xyz - vec3f(base(x.xyz)));
        let fraction = plane(n, s) * s.w0.z + plane(n + PLANE, s) * s.w1.z + plane(n + 2u * PLANE, s) * s.w2.z;
        displacement[p].w = believed(fraction, x, n);
    }
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    let unit = 1.0 / constants.mass_scale;
    for (var c = awake_from(group.x, groups.x, count); c < count; c = awake_from(c + groups.x, groups.x, count)) {
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            let at = tile_at(t);
            tile[t] = f32(grid[chunks[c].links[tile_block(at)] * NODES + block_node(at)].w) * unit;
        }
        workgroupBarrier();
        let end = chunks[c].start + chunks[c].count;
        gather(chunks[c].cells[lane], cell_end(c, lane, end), lane);
        workgroupBarrier();
    }
}
