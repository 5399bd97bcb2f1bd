// Where tiles share nodes. Twins: `reach` and `place` in src/stages/block_join.rs. Needs bins.

// How many nodes along each axis of a block are common to the tiles of some of the eight blocks: `which` is the bitwise
// OR of these blocks' numbers.
fn shared_edge(which: u32) -> vec3u {
    return select(vec3u(EDGE), vec3u(TILE_EDGE - EDGE), offset(which) == vec3u(1u));
}

// Index of a node in the tile of one of the eight.
fn place(source: u32, k: u32, at: vec3u) -> u32 {
    return source * TILE_NODES + tile_index(at + EDGE * offset(k));
}
