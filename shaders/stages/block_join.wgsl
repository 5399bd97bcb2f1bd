// Finds for each block of nodes what the pressures of the blocks whose tiles reach it do to each other there, and what the predicted motion
// does to these blocks. Twin: src/stages/block_join.rs.
#import layout
#import stretch
#import linear
#import bins
#import lookup
#import force_scale
#import hold
#import pressures

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> table: array<TableEntryView>;
@group(0) @binding(2) var<storage, read> blocks: array<Block>;
@group(0) @binding(3) var<storage, read> grid: array<vec4f>;
@group(0) @binding(4) var<storage, read> field: array<vec4f>;
@group(0) @binding(5) var<storage, read> held: array<Held>;
@group(0) @binding(6) var<storage, read> block_tiles: array<i32>;
@group(0) @binding(7) var<storage, read_write> couplings: array<Coupling>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;

var<workgroup> sources: array<u32, 8>;
// Of occupied blocks, and of all.
var<workgroup> counts: array<u32, 2>;

fn push(place: u32, unit: f32) -> vec3f {
    let word = 3u * place;
    return vec3f(vec3i(block_tiles[word], block_tiles[word + 1u], block_tiles[word + 2u])) * unit;
}

// The occupied block whose tile has the nodes with this key as its k-th block, or NONE.
fn source(key: u32, k: u32, occupied: u32) -> u32 {
    let at = block_coordinates(key);
    if any(at < offset(k)) {
        return NONE;
    }
    let found = find(block_key(at - offset(k)));
    return select(NONE, found, found < occupied);
}

fn motion(block: u32, k: u32, unit: f32) -> f32 {
    let most = shared_edge(k);
    var sum = 0.0;
    for (var z = 0u; z < most.z; z++) {
        for (var y = 0u; y < most.y; y++) {
            for (var x = 0u; x < most.x; x++) {
                let at = vec3u(x, y, z);
                let i = block * NODES + block_node(at);
                if grid[i].w > 0.0 {
                    sum += dot3(push(place(sources[k], k, at), unit), field[i].xyz);
                }
            }
        }
    }
    return sum;
}

fn product(block: u32, row: u32, column: u32, unit: f32) -> f32 {
    let most = shared_edge(row | column);
    var sum = 0.0;
    for (var z = 0u; z < most.z; z++) {
        for (var y = 0u; y < most.y; y++) {
            for (var x = 0u; x < most.x; x++) {
                let at = vec3u(x, y, z);
                let i = block * NODES + block_node(at);
                let mass = grid[i].w;
                if mass > 0.0 {
                    let moved = push(place(sources[column], column, at), unit * (1.0 / mass));
                    sum += dot3(push(place(sources[row], row, at), unit), reply(held[i], moved));
                }
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
        counts[1] = min(counts[0] + atomicLoad(&counters.halo), constants.max_blocks);
    }
    let occupied = workgroupUniformLoad(&counts[0]);
    let count = workgroupUniformLoad(&counts[1]);
    let mine = stretch(group.x, groups.x, count);
    for (var b = mine.first; b < mine.end; b++) {
        for (var k = lane; k < 8u; k += LANES) {
            sources[k] = source(blocks[b].key, k, occupied);
            couplings[b].sources[k] = sources[k];
        }
        workgroupBarrier();
        // Of two that are joined either way the first does the work for both.
        for (var pair = lane; pair < 72u; pair += LANES) {
            let row = pair / 9u;
            let column = pair % 9u;
            if column == 8u {
                couplings[b].motion[row] = 0.0;
                if sources[row] != NONE {
                    couplings[b].motion[row] = motion(b, row, unit);
                }
            } else if row <= column {
                var found = 0.0;
                if sources[row] != NONE && sources[column] != NONE {
                    found = product(b, row, column, unit);
                }
                couplings[b].matrix[8u * row + column] = found;
                couplings[b].matrix[8u * column + row] = found;
            }
        }
        workgroupBarrier();
    }
}
