// Gathers displacement and gradient for each particle. Twin: src/stages/g2p.rs.
#import layout
#import kernel
#import bins
#import chunk
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(7) var<storage, read> grid: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;

var<workgroup> tile: array<vec4f, TILE_NODES>;

// Displacement and mass of the 27 nodes of one cell.
alias Nodes = array<vec4f, 27>;

// Sums over a row of three nodes: the values, and the values times their distance in x.
struct Row {
    sum: vec4f,
    x: vec4f,
}

// Sums over a plane of nine nodes.
struct Plane {
    sum: vec4f,
    x: vec4f,
    y: vec4f,
}

fn row(nodes: ptr<function, Nodes>, n: u32, s: Stencil) -> Row {
    let a = (*nodes)[n];
    let b = (*nodes)[n + 1u];
    let c = (*nodes)[n + 2u];
    return Row(
        a * s.w0.x + b * s.w1.x + c * s.w2.x,
        a * (s.w0.x * s.r0.x) + b * (s.w1.x * s.r1.x) + c * (s.w2.x * s.r2.x),
    );
}

fn plane(nodes: ptr<function, Nodes>, n: u32, s: Stencil) -> Plane {
    let a = row(nodes, n, s);
    let b = row(nodes, n + 3u, s);
    let c = row(nodes, n + 6u, s);
    return Plane(
        a.sum * s.w0.y + b.sum * s.w1.y + c.sum * s.w2.y,
        a.x * s.w0.y + b.x * s.w1.y + c.x * s.w2.y,
        a.sum * (s.w0.y * s.r0.y) + b.sum * (s.w1.y * s.r1.y) + c.sum * (s.w2.y * s.r2.y),
    );
}

fn gather_particle(nodes: ptr<function, Nodes>, p: u32) {
    let x = position[p].xyz;
    let s = stencil(x - vec3f(base(x)));
    let a = plane(nodes, 0u, s);
    let b = plane(nodes, 9u, s);
    let c = plane(nodes, 18u, s);
    let sum = a.sum * s.w0.z + b.sum * s.w1.z + c.sum * s.w2.z;
    let sum_x = a.x * s.w0.z + b.x * s.w1.z + c.x * s.w2.z;
    let sum_y = a.y * s.w0.z + b.y * s.w1.z + c.y * s.w2.z;
    let sum_z = a.sum * (s.w0.z * s.r0.z) + b.sum * (s.w1.z * s.r1.z) + c.sum * (s.w2.z * s.r2.z);
    let mass = gradient[p].x.w;
    let material = gradient[p].y.w;
    let rest = gradient[p].z.w;
    gradient[p] = Gradient(vec4f(4.0 * sum_x.xyz, mass), vec4f(4.0 * sum_y.xyz, material), vec4f(4.0 * sum_z.xyz, rest));
#if VOLUMES
    // What volume_g2p measured holds for the whole step.
    displacement[p] = vec4f(sum.xyz, displacement[p].w);
#else
    displacement[p] = vec4f(sum.xyz, sum.w * materials[u32(material)].inverse_density);
#endif
}

// One invocation takes the particles of one cell, and reads the cell's nodes once.
fn gather(first: u32, end: u32, cell: u32) {
    if first >= end {
        return;
    }
    const PLANE = TILE_EDGE * TILE_EDGE;
    let n = tile_index(block_at(cell));
    let m = n + TILE_EDGE;
    let o = m + TILE_EDGE;
    var nodes = Nodes(
        tile[n], tile[n + 1u], tile[n + 2u],
        tile[m], tile[m + 1u], tile[m + 2u],
        tile[o], tile[o + 1u], tile[o + 2u],
        tile[n + PLANE], tile[n + PLANE + 1u], tile[n + PLANE + 2u],
        tile[m + PLANE], tile[m + PLANE + 1u], tile[m + PLANE + 2u],
        tile[o + PLANE], tile[o + PLANE + 1u], tile[o + PLANE + 2u],
        tile[n + 2u * PLANE], tile[n + 2u * PLANE + 1u], tile[n + 2u * PLANE + 2u],
        tile[m + 2u * PLANE], tile[m + 2u * PLANE + 1u], tile[m + 2u * PLANE + 2u],
        tile[o + 2u * PLANE], tile[o + 2u * PLANE + 1u], tile[o + 2u * PLANE + 2u],
    );
    for (var i = first; i < end; i++) {
        gather_particle(&nodes, order[i]);
    }
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    for (var c = group.x; c < count; c += groups.x) {
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            let at = tile_at(t);
            tile[t] = grid[chunks[c].links[tile_block(at)] * NODES + block_node(at)];
        }
        workgroupBarrier();
        let end = chunks[c].start + chunks[c].count;
        gather(chunks[c].cells[lane], cell_end(c, lane, end), lane);
        workgroupBarrier();
    }
}
