// Adds the sums of a chunk's cells to the grid, for devices that gain nothing from a tile (see scatter_tile). Needs
// scatter, bins, rows, the binding chunks, and `add_to_node`, which adds to a node of the grid.

// What one cell's particles bring to its 27 nodes.
alias Sums = array<vec4i, 27>;

fn no_sums(cell: u32) -> Sums {
    return Sums();
}

fn add_to_sums(sums: ptr<function, Sums>, n: u32, value: vec4i) {
    (*sums)[n] += value;
}

fn begin_scatter(lane: u32) {}

fn add_nodes(chunk: u32, at: vec3u, a: vec4i, b: vec4i, c: vec4i) {
#if BLOCK_TILES
    let node = chunks[chunk].block * TILE_NODES + tile_index(at);
    let row = vec3u(node, node + 1u, node + 2u);
#else
    let row = row_in_grid(chunk, at);
#endif
    add_to_node(row.x, a);
    add_to_node(row.y, b);
    add_to_node(row.z, c);
}

// Adds the sums of a cell of a chunk.
fn add_cell(sums: ptr<function, Sums>, chunk: u32, cell: u32) {
    let at = block_at(cell);
    add_nodes(chunk, at, (*sums)[0], (*sums)[1], (*sums)[2]);
    add_nodes(chunk, at + vec3u(0u, 1u, 0u), (*sums)[3], (*sums)[4], (*sums)[5]);
    add_nodes(chunk, at + vec3u(0u, 2u, 0u), (*sums)[6], (*sums)[7], (*sums)[8]);
    add_nodes(chunk, at + vec3u(0u, 0u, 1u), (*sums)[9], (*sums)[10], (*sums)[11]);
    add_nodes(chunk, at + vec3u(0u, 1u, 1u), (*sums)[12], (*sums)[13], (*sums)[14]);
    add_nodes(chunk, at + vec3u(0u, 2u, 1u), (*sums)[15], (*sums)[16], (*sums)[17]);
    add_nodes(chunk, at + vec3u(0u, 0u, 2u), (*sums)[18], (*sums)[19], (*sums)[20]);
    add_nodes(chunk, at + vec3u(0u, 1u, 2u), (*sums)[21], (*sums)[22], (*sums)[23]);
    add_nodes(chunk, at + vec3u(0u, 2u, 2u), (*sums)[24], (*sums)[25], (*sums)[26]);
}

fn end_scatter(chunk: u32, lane: u32) {}
