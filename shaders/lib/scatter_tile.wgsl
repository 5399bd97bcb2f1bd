// Adds the sums of a chunk's cells to the grid: first to a tile in the workgroup's memory, whose nodes are then added. Needs scatter,
// bins, the binding chunks, FOURTH, which says whether there is anything in the fourth channel, and `add_to_node`, which adds to a
// node of the grid.

const TILE_WORDS = 4u * TILE_NODES;

var<workgroup> scatter_tile: array<atomic<u32>, TILE_WORDS>;

fn begin_scatter(lane: u32) {
    for (var i = lane; i < TILE_WORDS; i += LANES) {
        atomicStore(&scatter_tile[i], 0u);
    }
}

fn add_to_tile(node: u32, sum: vec4i) {
    atomicAdd(&scatter_tile[node], u32(sum.x));
    atomicAdd(&scatter_tile[node + 1u], u32(sum.y));
    atomicAdd(&scatter_tile[node + 2u], u32(sum.z));
    if FOURTH {
        atomicAdd(&scatter_tile[node + 3u], u32(sum.w));
    }
}

fn add_nodes(node: u32, a: vec4i, b: vec4i, c: vec4i) {
    add_to_tile(node, a);
    add_to_tile(node + 4u, b);
    add_to_tile(node + 8u, c);
}

// Adds the sums of a cell of a chunk.
fn add_cell(sums: ptr<function, Sums>, chunk: u32, cell: u32) {
    const ROW = 4u * TILE_EDGE;
    const PLANE = ROW * TILE_EDGE;
    let node = 4u * tile_index(block_at(cell));
    add_nodes(node, (*sums)[0], (*sums)[1], (*sums)[2]);
    add_nodes(node + ROW, (*sums)[3], (*sums)[4], (*sums)[5]);
    add_nodes(node + 2u * ROW, (*sums)[6], (*sums)[7], (*sums)[8]);
    add_nodes(node + PLANE, (*sums)[9], (*sums)[10], (*sums)[11]);
    add_nodes(node + PLANE + ROW, (*sums)[12], (*sums)[13], (*sums)[14]);
    add_nodes(node + PLANE + 2u * ROW, (*sums)[15], (*sums)[16], (*sums)[17]);
    add_nodes(node + 2u * PLANE, (*sums)[18], (*sums)[19], (*sums)[20]);
    add_nodes(node + 2u * PLANE + ROW, (*sums)[21], (*sums)[22], (*sums)[23]);
    add_nodes(node + 2u * PLANE + 2u * ROW, (*sums)[24], (*sums)[25], (*sums)[26]);
}

fn end_scatter(chunk: u32, lane: u32) {
    for (var t = lane; t < TILE_NODES; t += LANES) {
        let word = 4u * t;
        var sum = vec4i(0);
        for (var channel = 0u; channel < 4u; channel++) {
            sum[channel] = i32(atomicLoad(&scatter_tile[word + channel]));
        }
        if any(sum != vec4i(0)) {
            let at = tile_at(t);
            add_to_node(chunks[chunk].links[tile_block(at)] * NODES + block_node(at), sum);
        }
    }
}
