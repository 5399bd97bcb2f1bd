// The nodes of a chunk's cells, by way of a tile in the workgroup's memory. Needs gather, bins, the binding chunks, and `stored_node`,
// which reads a node of the grid.

var<workgroup> gather_tile: array<vec4f, TILE_NODES>;

fn begin_gather(chunk: u32, lane: u32) {
    for (var t = lane; t < TILE_NODES; t += LANES) {
        let at = tile_at(t);
        gather_tile[t] = stored_node(chunks[chunk].links[tile_block(at)] * NODES + block_node(at));
    }
}

// The nodes of a cell of a chunk.
fn cell_nodes(chunk: u32, cell: u32) -> Nodes {
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
