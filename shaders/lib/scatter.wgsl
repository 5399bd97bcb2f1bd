// Sums what the particles of a cell bring to its 27 nodes, in integers. Twin: `scatter_affine` in src/stages/p2g.rs. Needs kernel,
// bins, and FOURTH, which says whether there is anything in the fourth channel.

const TILE_WORDS = 4u * TILE_NODES;

var<workgroup> scatter_tile: array<atomic<u32>, TILE_WORDS>;

fn clear_scatter_tile(lane: u32) {
    for (var i = lane; i < TILE_WORDS; i += GROUP) {
        atomicStore(&scatter_tile[i], 0u);
    }
}

// What the particles of one cell bring to its 27 nodes.
alias Sums = array<vec4i, 27>;

fn rounded(value: vec4f) -> vec4i {
    return vec4i(round(value));
}

// The three nodes of a row; gives what was added.
fn add_row(sums: ptr<function, Sums>, n: u32, row: vec4f, dx: vec4f, weight: f32, s: Stencil) -> vec4i {
    let a = rounded((row - dx) * (weight * s.w0.x));
    let b = rounded(row * (weight * s.w1.x));
    let c = rounded((row + dx) * (weight * s.w2.x));
    (*sums)[n] += a;
    (*sums)[n + 1u] += b;
    (*sums)[n + 2u] += c;
    return a + b + c;
}

// The three rows of a plane; gives what was added.
fn add_plane(sums: ptr<function, Sums>, n: u32, plane: vec4f, dx: vec4f, dy: vec4f, weight: f32, s: Stencil) -> vec4i {
    return add_row(sums, n, plane - dy, dx, weight * s.w0.y, s)
        + add_row(sums, n + 3u, plane, dx, weight * s.w1.y, s)
        + add_row(sums, n + 6u, plane + dy, dx, weight * s.w2.y, s);
}

// Adds the `value` of a particle at `x`, which changes by `dx`, `dy`, `dz` per cell along the axes.
fn add_affine(sums: ptr<function, Sums>, x: vec3f, value: vec4f, dx: vec4f, dy: vec4f, dz: vec4f) {
    let s = stencil(x - vec3f(base(x)));
    let middle = value + dx * s.r1.x + dy * s.r1.y + dz * s.r1.z;
    let total = add_plane(sums, 0u, middle - dz, dx, dy, s.w0.z, s)
        + add_plane(sums, 9u, middle, dx, dy, s.w1.z, s)
        + add_plane(sums, 18u, middle + dz, dx, dy, s.w2.z, s);
    // What rounding node by node took from the particle's whole goes to the middle node: many small parts that all round
    // to nothing would otherwise slow it.
    (*sums)[13] += rounded(value) - total;
}

fn add_node(node: u32, sum: vec4i) {
    atomicAdd(&scatter_tile[node], u32(sum.x));
    atomicAdd(&scatter_tile[node + 1u], u32(sum.y));
    atomicAdd(&scatter_tile[node + 2u], u32(sum.z));
    if FOURTH {
        atomicAdd(&scatter_tile[node + 3u], u32(sum.w));
    }
}

fn add_nodes(node: u32, a: vec4i, b: vec4i, c: vec4i) {
    add_node(node, a);
    add_node(node + 4u, b);
    add_node(node + 8u, c);
}

// Adds the sums of a cell to the tile.
fn add_cell(sums: ptr<function, Sums>, cell: u32) {
    const ROW = 4u * TILE_EDGE;
    const PLANE = ROW * TILE_EDGE;
    let node = 4u * tile_index(block_at(cell));
    add_nodes(node, (*sums)[0], (*sums)[1], (*sums)[2]);
    add_nodes(node + ROW, (*sums)[3], (*sums)[4], (*sums)[5]);
    add_nodes(node + 2u * ROW, (*sums)[6], (*sums)[7], (*sums)[8]);
    add_nodes(node + PLANE, (*sums)[9], (*sums)[10], (*sums)[11]);
    add_nodes(node + PLANE + ROW, (*sums)[12], (*sums)[13], (*sums)[14]);
    add_nodes(node + PLANE + 2u * ROW, (*sums)[15], (*sums)[16], (*sums)[17]);
    add_nodes(node + 2u * PLANE, (*sums)[18], (*sums)[19], (*sums)[20]);
    add_nodes(node + 2u * PLANE + ROW, (*sums)[21], (*sums)[22], (*sums)[23]);
    add_nodes(node + 2u * PLANE + 2u * ROW, (*sums)[24], (*sums)[25], (*sums)[26]);
}
