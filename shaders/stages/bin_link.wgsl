// Makes the blocks that the tiles of occupied ones also reach; gives each occupied block its range and its chunks.
// Twin: src/stages/bin_link.rs.
//
// Blocks get ranges and numbers in the order in which invocations come; nothing that follows depends on that order.
#import layout
#import bins
#import neighbours
#import table
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> table: array<TableEntry>;
@group(0) @binding(2) var<storage, read_write> blocks: array<Block>;
@group(0) @binding(3) var<storage, read_write> links: array<u32>;
@group(0) @binding(4) var<storage, read_write> chunks: array<Chunk>;
@group(0) @binding(5) var<storage, read_write> counters: Counters;
@group(0) @binding(6) var<storage, read_write> dispatch: Dispatch;

fn count_block(block: u32) {
    atomicMax(&dispatch.blocks.x, min(block / GROUP + 1u, MAX_GROUPS));
    atomicMax(&dispatch.nodes.x, min(block / SHARE + 1u, MAX_GROUPS));
}

// A link is a table entry, since the blocks that other invocations make are known only after this stage.
fn link(key: u32, occupied: u32) -> u32 {
    let found = find_or_insert(key);
    if found.entry == NONE {
        halt();
        return 0u;
    }
    if found.made {
        let block = occupied + atomicAdd(&counters.halo, 1u);
        if block >= constants.max_blocks {
            halt();
            return 0u;
        }
        table[found.entry].block = block;
        blocks[block] = Block(key, found.entry, 0u, 0u, 0u);
        count_block(block);
    }
    return found.entry;
}

// Gives an occupied block its range, its chunks and the link to itself.
fn lay_out(b: u32) {
    let key = blocks[b].key;
    let count = atomicLoad(&table[blocks[b].entry].count);
    let start = atomicAdd(&counters.ordered, count);
    blocks[b].start = start;
    blocks[b].count = count;
    count_block(b);

    let parts = (count + CHUNK - 1u) / CHUNK;
    let first = atomicAdd(&counters.chunks, parts);
    for (var i = 0u; i < parts; i++) {
        let c = first + i;
        chunks[c].block = b;
        chunks[c].start = start + i * CHUNK;
        chunks[c].count = min(count - i * CHUNK, CHUNK);
        chunks[c].key = key;
        chunks[c].sleep = AWAKE;
    }
    atomicMax(&dispatch.chunks.x, min((first + parts + SHARE - 1u) / SHARE, MAX_GROUPS));
    links[b * 8u] = blocks[b].entry;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    let occupied = atomicLoad(&counters.occupied);
    for (var i = id.x; i < occupied * LINKERS; i += groups.x * GROUP) {
        let b = i % occupied;
        var k = i / occupied;
        if k == 0u {
            lay_out(b);
            k += LINKERS;
        }
        for (; k < 8u; k += LINKERS) {
            links[b * 8u + k] = link(neighbour(blocks[b].key, k), occupied);
        }
    }
}
