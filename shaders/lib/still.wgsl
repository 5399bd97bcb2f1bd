// The effect of sleep on nodes. Twin: `Block` in src/stages/bin_sleep.rs.

// Whether a node stands still: a tile of sleeping particles reaches it. Tiles of the blocks below reach two nodes far
// into the block.
fn stands_still(tiles: u32, node: u32) -> bool {
    let reached = block_at(node) < vec3u(TILE_EDGE - EDGE);
    var mask = 1u;
    mask |= select(0u, mask << 1u, reached.x);
    mask |= select(0u, mask << 2u, reached.y);
    mask |= select(0u, mask << 4u, reached.z);
    return (tiles & mask) != 0u;
}
