// Computes for each block of nodes the couplings, through its free nodes, between the pressures of the blocks whose
// tiles reach it, and the effect of the predicted motion on these blocks. Twin: src/stages/block_join.rs.
#import layout
#import active
#if SLEEP
#import idle
#endif
#import stretch
#import linear
#import bins
#import neighbours
#import lookup
#import force_scale
#import hold
#import pressures
#import couplings

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> table: array<TableEntryView>;
@group(0) @binding(2) var<storage, read> blocks: array<Block>;
@group(0) @binding(3) var<storage, read> grid: array<vec4f>;
@group(0) @binding(4) var<storage, read> field: array<vec4f>;
@group(0) @binding(5) var<storage, read> held: array<Held>;
@group(0) @binding(6) var<storage, read> block_tiles: array<i32>;
@group(0) @binding(7) var<storage, read_write> couplings: array<u32>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;

var<workgroup> sources: array<u32, 8>;
// Number of occupied blocks, and of all.
var<workgroup> counts: array<u32, 2>;
// For each node of the block, at its place in a tile that reaches it (the eight tiles do so with different places): the
// push of the tile, with its product with the predicted motion; and the motion that the push gives the node.
var<workgroup> pushed: array<vec4f, TILE_NODES>;
var<workgroup> moved: array<vec3f, TILE_NODES>;

fn push(place: u32, unit: f32) -> vec3f {
    let word = 3u * place;
    return vec3f(vec3i(block_tiles[word], block_tiles[word + 1u], block_tiles[word + 2u])) * unit;
}

// The first block from `b` on whose nodes have mass; `end` if there is none before that. Those passed over get no
// couplings, and block_solve leaves them as they are.
fn joined_from(b: u32, end: u32, lane: u32) -> u32 {
#if SLEEP
    var next = b;
    while next < end && is_idle(next) {
        for (var i = lane; i < 4u * VECTORS; i += LANES) {
            couplings[coupling_word(next, SOURCES, i)] = select(0u, NONE, i < 8u);
        }
        next++;
    }
    return next;
#else
    return b;
#endif
}

// The occupied block whose tile has a block of nodes as its k-th, or NONE.
fn source(block: u32, k: u32, occupied: u32) -> u32 {
    let at = block_coordinates(blocks[block].key);
    if any(at < offset(k)) {
        return NONE;
    }
    let found = find(block_key(wrapped(at - offset(k))));
    return select(NONE, found, found < occupied);
}

// Computes these for the node at the place `t` in the tile that reaches it there.
fn look_at(block: u32, t: u32, unit: f32) {
    let at = tile_at(t);
    let source = sources[tile_block(at)];
    let i = block * NODES + block_node(at);
    let mass = grid[i].w;
    if source == NONE || mass <= 0.0 {
        pushed[t] = vec4f(0.0);
        moved[t] = vec3f(0.0);
        return;
    }
    let there = source * TILE_NODES + t;
    let pushes = push(there, unit);
    pushed[t] = vec4f(pushes, dot3(pushes, field[i].xyz));
    moved[t] = reply(held[i], push(there, unit * (1.0 / mass)));
}

// The place of the block's first node in the tile that has it as its k-th block.
fn first_in_tile(k: u32) -> u32 {
    return tile_index(EDGE * offset(k));
}

// The coupling of two blocks; for a block with itself also the effect of the predicted motion, which is summed over the
// same nodes.
fn joined(row: u32, column: u32) -> vec2f {
    let of_row = first_in_tile(row);
    let of_column = first_in_tile(column);
    let most = shared_edge(row | column);
    var sum = vec2f(0.0);
    for (var z = 0u; z < most.z; z++) {
        for (var y = 0u; y < most.y; y++) {
            for (var x = 0u; x < most.x; x++) {
                let n = tile_index(vec3u(x, y, z));
                let pushes = pushed[of_row + n];
                sum += vec2f(dot3(pushes.xyz, moved[of_column + n]), pushes.w);
            }
        }
    }
    return sum;
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let unit = 1.0 / force_scale(1.0);
    if lane == 0u {
        counts[0] = atomicLoad(&counters.occupied);
        counts[1] = active_blocks(constants.max_blocks);
    }
    let occupied = workgroupUniformLoad(&counts[0]);
    let count = workgroupUniformLoad(&counts[1]);
    let mine = stretch(group.x, groups.x, count);
    for (var b = joined_from(mine.first, mine.end, lane); b < mine.end; b = joined_from(b + 1u, mine.end, lane)) {
        for (var k = lane; k < 8u; k += LANES) {
            sources[k] = source(b, k, occupied);
            couplings[coupling_word(b, SOURCES, k)] = sources[k];
        }
        workgroupBarrier();
        for (var t = lane; t < TILE_NODES; t += LANES) {
            look_at(b, t, unit);
        }
        workgroupBarrier();
        // The coupling is symmetric.
        for (var pair = lane; pair < 64u; pair += LANES) {
            let row = pair / 8u;
            let column = pair % 8u;
            if row <= column {
                var found = vec2f(0.0);
                if sources[row] != NONE && sources[column] != NONE {
                    found = joined(row, column);
                }
                let entry = row * (15u - row) / 2u + column;
                couplings[coupling_word(b, MATRIX, entry)] = bitcast<u32>(found.x);
                if row == column {
                    couplings[coupling_word(b, MOTIONS, row)] = bitcast<u32>(found.y);
                }
            }
        }
        workgroupBarrier();
    }
}
