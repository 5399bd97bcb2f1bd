// Where tiles share nodes. Twin: `shared` in src/stages/block_join.rs. Needs bins.

// By how many blocks the first of those that one of the eight reaches lies before the k-th.
fn offset(k: u32) -> vec3u {
    return vec3u(k, k >> 1u, k >> 2u) & vec3u(1u);
}

// How far the nodes reach along each axis that the tiles of these of the eight blocks share in a block of nodes.
fn shared_edge(which: u32) -> vec3u {
    return select(vec3u(EDGE), vec3u(TILE_EDGE - EDGE), offset(which) == vec3u(1u));
}

// The place of a node in the tile of one of the eight.
fn place(source: u32, k: u32, at: vec3u) -> u32 {
    return source * TILE_NODES + tile_index(at + EDGE * offset(k));
}
