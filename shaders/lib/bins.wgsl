// Blocks of the sparse grid. Twin: src/bins.rs.

fn block_key(block: vec3u) -> u32 {
    return block.x | (block.y << KEY_BITS) | (block.z << (2u * KEY_BITS));
}

fn block_coordinates(key: u32) -> vec3u {
    return vec3u(key, key >> KEY_BITS, key >> (2u * KEY_BITS)) & vec3u(LAST_BLOCK);
}

// Offset of a tile's k-th block from its first, in blocks.
fn offset(k: u32) -> vec3u {
    return vec3u(k, k >> 1u, k >> 2u) & vec3u(1u);
}

fn hash(key: u32) -> u32 {
    let h = key * 0x9E3779B1u;
    return h ^ (h >> 15u);
}

fn tile_index(at: vec3u) -> u32 {
    return (at.z * TILE_EDGE + at.y) * TILE_EDGE + at.x;
}

fn tile_at(index: u32) -> vec3u {
    return vec3u(index % TILE_EDGE, index / TILE_EDGE % TILE_EDGE, index / (TILE_EDGE * TILE_EDGE));
}

// Which of a tile's eight blocks the node at these tile coordinates lies in.
fn tile_block(at: vec3u) -> u32 {
    return (at.x / EDGE) | ((at.y / EDGE) << 1u) | ((at.z / EDGE) << 2u);
}

// Index in its block of the node at these tile coordinates.
fn block_node(at: vec3u) -> u32 {
    let n = at % EDGE;
    return (n.z * EDGE + n.y) * EDGE + n.x;
}

// Block coordinates of the node or cell with this index.
fn block_at(index: u32) -> vec3u {
    return vec3u(index % EDGE, index / EDGE % EDGE, index / (EDGE * EDGE));
}
