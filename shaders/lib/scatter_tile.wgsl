// Adds what a chunk's particles bring to a tile in workgroup memory, and the tile's nodes to the grid. Needs scatter,
// bins, the binding chunks, CHANNELS (three where the fourth would be empty), and `add_to_node`, which adds to a node
// of the grid.

// Rows and planes are so far apart that the nodes of 4 × 4 × 2 neighbouring cells are in 32 different banks.
const TILE_ROW = 8u;
const TILE_PLANE = 52u;
// Channel after channel: otherwise those of a node would be in four banks next to those of its neighbours.
const TILE_CHANNEL = (TILE_EDGE - 1u) * (TILE_PLANE + TILE_ROW + 1u) + 1u;
const TILE_WORDS = CHANNELS * TILE_CHANNEL;

var<workgroup> scatter_tile: array<atomic<u32>, TILE_WORDS>;

// Place of a cell's first node in the tile, to which particles add directly.
alias Sums = u32;

fn tile_word(at: vec3u) -> u32 {
    return at.x + at.y * TILE_ROW + at.z * TILE_PLANE;
}

fn no_sums(cell: u32) -> Sums {
    return tile_word(block_at(cell));
}

fn add_to_sums(sums: ptr<function, Sums>, n: u32, value: vec4i) {
    let word = *sums + tile_word(vec3u(n % 3u, n / 3u % 3u, n / 9u));
    atomicAdd(&scatter_tile[word], u32(value.x));
    atomicAdd(&scatter_tile[word + TILE_CHANNEL], u32(value.y));
    atomicAdd(&scatter_tile[word + 2u * TILE_CHANNEL], u32(value.z));
    if CHANNELS == 4u {
        atomicAdd(&scatter_tile[word + 3u * TILE_CHANNEL], u32(value.w));
    }
}

fn begin_scatter(lane: u32) {
    for (var i = lane; i < TILE_WORDS; i += LANES) {
        atomicStore(&scatter_tile[i], 0u);
    }
}

fn add_cell(sums: ptr<function, Sums>, chunk: u32, cell: u32) {}

fn end_scatter(chunk: u32, lane: u32) {
    for (var t = lane; t < TILE_NODES; t += LANES) {
        let at = tile_at(t);
        let word = tile_word(at);
        var sum = vec4i(0);
        for (var channel = 0u; channel < CHANNELS; channel++) {
            sum[channel] = i32(atomicLoad(&scatter_tile[word + channel * TILE_CHANNEL]));
        }
        if any(sum != vec4i(0)) {
#if BLOCK_TILES
            add_to_node(chunks[chunk].block * TILE_NODES + t, sum);
#else
            add_to_node(chunks[chunk].links[tile_block(at)] * NODES + block_node(at), sum);
#endif
        }
    }
}
