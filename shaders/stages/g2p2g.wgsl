// Gathers the motion of each particle and, after the constraint, sums it on the nodes again, in iterations that need
// none of it stored. Twins: src/stages/g2p.rs, src/stages/constraint.rs, src/stages/p2g.rs.
//
// Mass is summed in the first iteration only: particles stay where they are, so that it does not change.
#import layout
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
#import gather
#import scatter
#import meet
#if TILES
#import gather_tile
#import scatter_tile
#else
#import rows
#import gather_grid
#import scatter_grid
#endif
#import add_force
#import motion

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(6) var<storage, read> grid: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> force: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;

// Momentum.
const CHANNELS = 3u;

fn stored_node(i: u32) -> vec4f {
    return grid[i];
}

// The particles of a share are all of one cell.
fn take_cell(c: u32, cell: Cell) {
    var nodes = cell_nodes(c, cell.at);
    var sums = no_sums(cell.at);
    var i = cell.first;
    loop {
        let p = order[i];
        let x = position[p];
        let found = gathered(&nodes, x.xyz);
        let motion = Gradient(found.x.xyz, gradient[p].mass, found.y.xyz, gradient[p].material, found.z.xyz, 0.0);
        add_motion(&sums, x, found.sum.xyz, motion);
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
    for (var c = mine.first; c < mine.end; c++) {
        begin_scatter(lane);
        begin_gather(c, lane);
        meet();
        let all = shares(c);
        var k = lane;
        loop {
            if k < all {
                take_cell(c, share_apart(c, k));
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
}
