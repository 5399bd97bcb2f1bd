// Adds the effect of the pressures of blocks to the predicted motion of the nodes. Twin: src/stages/block_spread.rs.
#import layout
#import active
#import idle
#import stretch
#import linear
#import bins
#import force_scale
#import hold
#import pressures
#import couplings

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> couplings: array<u32>;
@group(0) @binding(2) var<storage, read> block_pressures: array<BlockPressure>;
@group(0) @binding(3) var<storage, read_write> block_tiles: array<i32>;
@group(0) @binding(4) var<storage, read> grid: array<vec4f>;
@group(0) @binding(5) var<storage, read> held: array<Held>;
@group(0) @binding(6) var<storage, read_write> field: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;
#if SLEEP
@group(0) @binding(8) var<storage, read> blocks: array<Block>;
#endif

// The push of a tile at this place, which is zeroed for the next step.
fn taken(place: u32, unit: f32) -> vec3f {
    let word = 3u * place;
    let sum = vec3i(block_tiles[word], block_tiles[word + 1u], block_tiles[word + 2u]);
    block_tiles[word] = 0;
    block_tiles[word + 1u] = 0;
    block_tiles[word + 2u] = 0;
    return vec3f(sum) * unit;
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let unit = 1.0 / force_scale(1.0);
    let count = active_blocks(constants.max_blocks);
    let mine = stretch(group.x, groups.x, count);
    for (var b = busy_from(mine.first, mine.end); b < mine.end; b = busy_from(b + 1u, mine.end)) {
        for (var node = lane; node < NODES; node += LANES) {
            let at = block_at(node);
            var pushed = vec3f(0.0);
            for (var k = 0u; k < 8u; k++) {
                let source = couplings[coupling_word(b, SOURCES, k)];
                if source != NONE && all(at < shared_edge(k)) {
                    pushed = pushed + taken(place(source, k, at), unit) * block_pressures[source].found;
                }
            }
            let i = b * NODES + node;
            let mass = grid[i].w;
            if mass > 0.0 {
                field[i] = vec4f(field[i].xyz + reply(held[i], pushed * (1.0 / mass)), 0.0);
            }
        }
    }
}
