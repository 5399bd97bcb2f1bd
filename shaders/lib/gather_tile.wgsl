// The nodes of a chunk's cells, through a tile in workgroup memory. Needs gather, bins, the binding chunks, and
// `stored_node`, which reads a node of the grid.

// Rows are so far apart that the nodes of 4 × 2 neighbouring cells, four words each, are in 32 different banks.
const GATHER_ROW = 12u;
const GATHER_PLANE = TILE_EDGE * GATHER_ROW;

var<workgroup> gather_tile: array<vec4f, TILE_EDGE * GATHER_PLANE>;

// Place of a cell's first node in the tile.
alias Nodes = u32;

fn gather_place(at: vec3u) -> u32 {
    return at.x + at.y * GATHER_ROW + at.z * GATHER_PLANE;
}

fn node_of(nodes: ptr<function, Nodes>, n: u32) -> vec4f {
    return gather_tile[*nodes + gather_place(vec3u(n % 3u, n / 3u % 3u, n / 9u))];
}

fn begin_gather(chunk: u32, lane: u32) {
    for (var t = lane; t < TILE_NODES; t += LANES) {
        let at = tile_at(t);
        gather_tile[gather_place(at)] = stored_node(chunks[chunk].links[tile_block(at)] * NODES + block_node(at));
    }
}

// The nodes of a cell of a chunk.
fn cell_nodes(chunk: u32, cell: u32) -> Nodes {
    return gather_place(block_at(cell));
}
