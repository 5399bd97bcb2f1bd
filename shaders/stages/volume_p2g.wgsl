// Sums the particles' volumes at rest on the nodes. Twin: src/stages/volume_p2g.rs.
//
// Built like p2g, of which it is the fourth channel: there mass, here volume.
#import layout
#import takes_part
#import kernel
#import bins
#import chunk
#import cells
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(6) var<storage, read_write> grid: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;

var<workgroup> tile: array<atomic<u32>, TILE_NODES>;

// What the particles of one cell bring to its 27 nodes, by rows.
alias Sums = array<vec3i, 9>;

fn rounded(value: vec3f) -> vec3i {
    return vec3i(round(value));
}

fn add_plane(sums: ptr<function, Sums>, n: u32, row: vec3f, weight: f32, s: Stencil) -> vec3i {
    let a = rounded(row * (weight * s.w0.y));
    let b = rounded(row * (weight * s.w1.y));
    let c = rounded(row * (weight * s.w2.y));
    (*sums)[n] += a;
    (*sums)[n + 1u] += b;
    (*sums)[n + 2u] += c;
    return a + b + c;
}

fn add_particle(sums: ptr<function, Sums>, p: u32) {
    let x = position[p].xyz;
    let s = stencil(x - vec3f(base(x)));
    let g = gradient[p];
    let volume = g.x.w * materials[u32(g.y.w)].inverse_density * constants.mass_scale;
    let row = vec3f(s.w0.x, s.w1.x, s.w2.x) * volume;
    let total = add_plane(sums, 0u, row, s.w0.z, s)
        + add_plane(sums, 3u, row, s.w1.z, s)
        + add_plane(sums, 6u, row, s.w2.z, s);
    // What rounding node by node took goes to the middle node.
    (*sums)[4].y += i32(round(volume)) - (total.x + total.y + total.z);
}

fn add_row(node: u32, sum: vec3i) {
    atomicAdd(&tile[node], u32(sum.x));
    atomicAdd(&tile[node + 1u], u32(sum.y));
    atomicAdd(&tile[node + 2u], u32(sum.z));
}

fn scatter(first: u32, end: u32, cell: u32) {
    if first >= end {
        return;
    }
    var sums = Sums();
    for (var i = first; i < end; i++) {
        add_particle(&sums, order[i]);
    }
    const PLANE = TILE_EDGE * TILE_EDGE;
    let node = tile_index(block_at(cell));
    add_row(node, sums[0]);
    add_row(node + TILE_EDGE, sums[1]);
    add_row(node + 2u * TILE_EDGE, sums[2]);
    add_row(node + PLANE, sums[3]);
    add_row(node + PLANE + TILE_EDGE, sums[4]);
    add_row(node + PLANE + 2u * TILE_EDGE, sums[5]);
    add_row(node + 2u * PLANE, sums[6]);
    add_row(node + 2u * PLANE + TILE_EDGE, sums[7]);
    add_row(node + 2u * PLANE + 2u * TILE_EDGE, sums[8]);
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    for (var c = with_mass_from(group.x, groups.x, count); c < count; c = with_mass_from(c + groups.x, groups.x, count)) {
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            atomicStore(&tile[t], 0u);
        }
        workgroupBarrier();
        let end = chunks[c].start + chunks[c].count;
        scatter(chunks[c].cells[lane], cell_end(c, lane, end), lane);
        workgroupBarrier();
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            let volume = atomicLoad(&tile[t]);
            if volume != 0u {
                let at = tile_at(t);
                let node = chunks[c].links[tile_block(at)] * NODES + block_node(at);
                let before = atomicAdd(&grid[4u * node + 3u], volume);
                if before + volume < before {
                    atomicAdd(&counters.saturated_nodes, 1u);
                }
            }
        }
        workgroupBarrier();
    }
}
