// The nodes of a chunk's cells, straight from the grid, for devices that gain nothing from a tile (see gather_tile).
// Needs gather, bins, rows, the binding chunks, and `stored_node`, which reads a node of the grid.

// The values of one cell's 27 nodes.
alias Nodes = array<vec4f, 27>;

fn node_of(nodes: ptr<function, Nodes>, n: u32) -> vec4f {
    return (*nodes)[n];
}

fn begin_gather(chunk: u32, lane: u32) {}

// The nodes of a cell of a chunk.
fn cell_nodes(chunk: u32, cell: u32) -> Nodes {
    let at = block_at(cell);
    let a = row_in_grid(chunk, at);
    let b = row_in_grid(chunk, at + vec3u(0u, 1u, 0u));
    let c = row_in_grid(chunk, at + vec3u(0u, 2u, 0u));
    let d = row_in_grid(chunk, at + vec3u(0u, 0u, 1u));
    let e = row_in_grid(chunk, at + vec3u(0u, 1u, 1u));
    let f = row_in_grid(chunk, at + vec3u(0u, 2u, 1u));
    let g = row_in_grid(chunk, at + vec3u(0u, 0u, 2u));
    let h = row_in_grid(chunk, at + vec3u(0u, 1u, 2u));
    let i = row_in_grid(chunk, at + vec3u(0u, 2u, 2u));
    return Nodes(
        stored_node(a.x), stored_node(a.y), stored_node(a.z),
        stored_node(b.x), stored_node(b.y), stored_node(b.z),
        stored_node(c.x), stored_node(c.y), stored_node(c.z),
        stored_node(d.x), stored_node(d.y), stored_node(d.z),
        stored_node(e.x), stored_node(e.y), stored_node(e.z),
        stored_node(f.x), stored_node(f.y), stored_node(f.z),
        stored_node(g.x), stored_node(g.y), stored_node(g.z),
        stored_node(h.x), stored_node(h.y), stored_node(h.z),
        stored_node(i.x), stored_node(i.y), stored_node(i.z),
    );
}
