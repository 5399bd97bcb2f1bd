// Sums the particles' mass and momentum on the nodes. Twin: src/stages/p2g.rs.
//
// A workgroup takes a chunk of one block's particles. An invocation takes the particles of one cell, sums them in
// registers and adds the sums to the grid; where the workgroup has a tile, it takes one particle at a time and adds it
// there. All sums are of integers, so that they do not depend on the order of particles, invocations or workgroups.
#import layout
#import takes_part
#import stretch
#import linear
#import kernel
#import bins
#import chunk
#import cells
#import shares
#import bound
#import momentum_scale
#import halt
#import scatter
#import meet
#if TILES
#import scatter_tile
#else
#import rows
#import scatter_grid
#endif
#import motion

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(6) var<storage, read_write> grid: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;
#if FUSED
@group(0) @binding(8) var<uniform> materials: array<Material, MATERIALS>;
#endif

// Momentum and mass.
const CHANNELS = 4u;

fn add_particle(sums: ptr<function, Sums>, p: u32) {
    add_motion(sums, position[p], displacement[p].xyz, gradient[p]);
}

// How many sums of mass an invocation has seen leave their range.
var<private> saturated: u32;

fn add_to_node(node: u32, sum: vec4i) {
    let word = 4u * node;
    atomicAdd(&grid[word], u32(sum.x));
    atomicAdd(&grid[word + 1u], u32(sum.y));
    atomicAdd(&grid[word + 2u], u32(sum.z));
    let mass = u32(sum.w);
    let before = atomicAdd(&grid[word + 3u], mass);
    saturated += u32(before + mass < before);
}

fn scatter(c: u32, cell: Cell) {
    var sums = no_sums(cell.at);
    var i = cell.first;
    loop {
        add_particle(&sums, order[i]);
        i++;
        if i == cell.end {
            break;
        }
    }
    add_cell(&sums, c, cell.at);
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    scale = momentum_scale();
    let mine = stretch(group.x, groups.x, count);
    for (var c = with_mass_from(mine.first, mine.end); c < mine.end; c = with_mass_from(c + 1u, mine.end)) {
        begin_scatter(lane);
        meet();
        let all = shares(c);
        var k = lane;
        loop {
            if k < all {
                scatter(c, share_apart(c, k));
            }
            k += LANES;
            if k >= all {
                break;
            }
        }
        meet();
        end_scatter(c, lane);
        meet();
    }
    if saturated != 0u {
        atomicAdd(&counters.saturated_nodes, saturated);
    }
}
