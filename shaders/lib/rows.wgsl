// Where the nodes of a tile lie in the grid. Needs bins and the binding chunks.

// Indices in the grid of three nodes in a row along x. The first has these coordinates in the tile of a chunk.
fn row_in_grid(chunk: u32, at: vec3u) -> vec3u {
    let beside = vec3u(0u, at.yz);
    let block = tile_block(beside);
    let node = block_node(beside);
    let low = chunks[chunk].links[block] * NODES + node;
    let high = chunks[chunk].links[block + 1u] * NODES + node - EDGE;
    let x = at.x + vec3u(0u, 1u, 2u);
    return select(vec3u(low), vec3u(high), x >= vec3u(EDGE)) + x;
}
