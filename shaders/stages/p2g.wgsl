// Sums the particles' mass and momentum on the nodes. Twin: src/stages/p2g.rs.
//
// A workgroup takes a chunk of one block's particles, an invocation one cell of it; they sum in registers, then in the
// workgroup's tile, and the tile is added to the grid. All sums are of integers, so that they do not depend on the order of
// particles, invocations or workgroups.
#import layout
#import linear
#import kernel
#import bins
#import chunk
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(6) var<storage, read_write> grid: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;

var<workgroup> tile: array<atomic<u32>, TILE_WORDS>;

const TILE_WORDS = 4u * TILE_NODES;

// Displacement and gradient within the bounds that the fixed-point scale is made for.
fn bounded(u: vec3f) -> vec3f {
    let length = dot3(u, u);
    let bound = constants.max_displacement;
    if length > bound * bound {
        atomicAdd(&counters.speed_clamped, 1u);
        return u * (bound / sqrt(length));
    }
    return u;
}

fn bounded_gradient(d: mat3x3f) -> mat3x3f {
    let norm = dot3(d[0], d[0]) + dot3(d[1], d[1]) + dot3(d[2], d[2]);
    let bound = constants.max_gradient;
    if norm > bound * bound {
        atomicAdd(&counters.gradient_clamped, 1u);
        return d * (bound / sqrt(norm));
    }
    return d;
}

// What the particles of one cell bring to its 27 nodes.
alias Sums = array<vec4i, 27>;

fn rounded(value: vec4f) -> vec4i {
    return vec4i(round(value));
}

// The three nodes of a row; gives what was added.
fn add_row(sums: ptr<function, Sums>, n: u32, row: vec4f, dx: vec4f, weight: f32, s: Stencil) -> vec4i {
    let a = rounded((row + dx * s.r0.x) * (weight * s.w0.x));
    let b = rounded((row + dx * s.r1.x) * (weight * s.w1.x));
    let c = rounded((row + dx * s.r2.x) * (weight * s.w2.x));
    (*sums)[n] += a;
    (*sums)[n + 1u] += b;
    (*sums)[n + 2u] += c;
    return a + b + c;
}

// The three rows of a plane; gives what was added.
fn add_plane(sums: ptr<function, Sums>, n: u32, plane: vec4f, dx: vec4f, dy: vec4f, weight: f32, s: Stencil) -> vec4i {
    return add_row(sums, n, plane + dy * s.r0.y, dx, weight * s.w0.y, s)
        + add_row(sums, n + 3u, plane + dy * s.r1.y, dx, weight * s.w1.y, s)
        + add_row(sums, n + 6u, plane + dy * s.r2.y, dx, weight * s.w2.y, s);
}

fn add_particle(sums: ptr<function, Sums>, p: u32) {
    let x = position[p].xyz;
    let g = gradient[p];
    let s = stencil(x - vec3f(base(x)));
    let u = bounded(displacement[p].xyz);
    let d = bounded_gradient(mat3x3f(g.x.xyz, g.y.xyz, g.z.xyz));

    let mass = g.x.w;
    let unit = vec4f(vec3f(mass * constants.momentum_scale), mass * constants.mass_scale);
    let value = vec4f(u, 1.0) * unit;
    let dx = vec4f(d[0], 0.0) * unit;
    let dy = vec4f(d[1], 0.0) * unit;
    let dz = vec4f(d[2], 0.0) * unit;
    let total = add_plane(sums, 0u, value + dz * s.r0.z, dx, dy, s.w0.z, s)
        + add_plane(sums, 9u, value + dz * s.r1.z, dx, dy, s.w1.z, s)
        + add_plane(sums, 18u, value + dz * s.r2.z, dx, dy, s.w2.z, s);
    // What rounding node by node took from the particle's whole goes to the middle node: many small parts that all round
    // to nothing would otherwise slow it.
    (*sums)[13] += rounded(value) - total;
}

fn add_node(node: u32, sum: vec4i) {
    atomicAdd(&tile[node], u32(sum.x));
    atomicAdd(&tile[node + 1u], u32(sum.y));
    atomicAdd(&tile[node + 2u], u32(sum.z));
    atomicAdd(&tile[node + 3u], u32(sum.w));
}

fn add_nodes(node: u32, a: vec4i, b: vec4i, c: vec4i) {
    add_node(node, a);
    add_node(node + 4u, b);
    add_node(node + 8u, c);
}

// One invocation takes the particles of one cell: neighbouring invocations add to different nodes at a time.
fn scatter(first: u32, end: u32, cell: u32) {
    if first >= end {
        return;
    }
    var sums = Sums();
    for (var i = first; i < end; i++) {
        add_particle(&sums, order[i]);
    }
    const ROW = 4u * TILE_EDGE;
    const PLANE = ROW * TILE_EDGE;
    let node = 4u * tile_index(block_at(cell));
    add_nodes(node, sums[0], sums[1], sums[2]);
    add_nodes(node + ROW, sums[3], sums[4], sums[5]);
    add_nodes(node + 2u * ROW, sums[6], sums[7], sums[8]);
    add_nodes(node + PLANE, sums[9], sums[10], sums[11]);
    add_nodes(node + PLANE + ROW, sums[12], sums[13], sums[14]);
    add_nodes(node + PLANE + 2u * ROW, sums[15], sums[16], sums[17]);
    add_nodes(node + 2u * PLANE, sums[18], sums[19], sums[20]);
    add_nodes(node + 2u * PLANE + ROW, sums[21], sums[22], sums[23]);
    add_nodes(node + 2u * PLANE + 2u * ROW, sums[24], sums[25], sums[26]);
}

fn add_to_grid(t: u32, c: u32) {
    let mass = atomicLoad(&tile[4u * t + 3u]);
    if mass == 0u {
        return;
    }
    let at = tile_at(t);
    let node = 4u * (chunks[c].links[tile_block(at)] * NODES + block_node(at));
    atomicAdd(&grid[node], atomicLoad(&tile[4u * t]));
    atomicAdd(&grid[node + 1u], atomicLoad(&tile[4u * t + 1u]));
    atomicAdd(&grid[node + 2u], atomicLoad(&tile[4u * t + 2u]));
    let before = atomicAdd(&grid[node + 3u], mass);
    if before + mass < before {
        atomicAdd(&counters.saturated_nodes, 1u);
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
        for (var i = lane; i < TILE_WORDS; i += GROUP) {
            atomicStore(&tile[i], 0u);
        }
        workgroupBarrier();
        let end = chunks[c].start + chunks[c].count;
        scatter(chunks[c].cells[lane], cell_end(c, lane, end), lane);
        workgroupBarrier();
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            add_to_grid(t, c);
        }
        workgroupBarrier();
    }
}
