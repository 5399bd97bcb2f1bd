// The position of a node, in cells. Needs bins and the binding blocks.

fn node_position(block: u32, node: u32) -> vec3f {
    return vec3f(block_coordinates(blocks[block].key) * EDGE + block_at(node));
}
