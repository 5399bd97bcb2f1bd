// Gathers from the 27 nodes of a cell. Twin: `gather` in src/stages/g2p.rs. Needs kernel, bins.

var<workgroup> gather_tile: array<vec4f, TILE_NODES>;

// What the 27 nodes of one cell hold.
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

// What there is at a particle, and how it changes per cell along the axes.
struct Gathered {
    sum: vec4f,
    x: vec4f,
    y: vec4f,
    z: vec4f,
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

fn gathered(nodes: ptr<function, Nodes>, x: vec3f) -> Gathered {
    let s = stencil(x - vec3f(base(x)));
    let a = plane(nodes, 0u, s);
    let b = plane(nodes, 9u, s);
    let c = plane(nodes, 18u, s);
    return Gathered(
        a.sum * s.w0.z + b.sum * s.w1.z + c.sum * s.w2.z,
        4.0 * (a.x * s.w0.z + b.x * s.w1.z + c.x * s.w2.z),
        4.0 * (a.y * s.w0.z + b.y * s.w1.z + c.y * s.w2.z),
        4.0 * (a.sum * (s.w0.z * s.r0.z) + b.sum * (s.w1.z * s.r1.z) + c.sum * (s.w2.z * s.r2.z)),
    );
}

// The nodes of a cell of the tile.
fn cell_nodes(cell: u32) -> Nodes {
    const PLANE = TILE_EDGE * TILE_EDGE;
    let n = tile_index(block_at(cell));
    let m = n + TILE_EDGE;
    let o = m + TILE_EDGE;
    return Nodes(
        gather_tile[n], gather_tile[n + 1u], gather_tile[n + 2u],
        gather_tile[m], gather_tile[m + 1u], gather_tile[m + 2u],
        gather_tile[o], gather_tile[o + 1u], gather_tile[o + 2u],
        gather_tile[n + PLANE], gather_tile[n + PLANE + 1u], gather_tile[n + PLANE + 2u],
        gather_tile[m + PLANE], gather_tile[m + PLANE + 1u], gather_tile[m + PLANE + 2u],
        gather_tile[o + PLANE], gather_tile[o + PLANE + 1u], gather_tile[o + PLANE + 2u],
        gather_tile[n + 2u * PLANE], gather_tile[n + 2u * PLANE + 1u], gather_tile[n + 2u * PLANE + 2u],
        gather_tile[m + 2u * PLANE], gather_tile[m + 2u * PLANE + 1u], gather_tile[m + 2u * PLANE + 2u],
        gather_tile[o + 2u * PLANE], gather_tile[o + 2u * PLANE + 1u], gather_tile[o + 2u * PLANE + 2u],
    );
}
