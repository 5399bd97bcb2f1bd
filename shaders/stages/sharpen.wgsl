// Restores the motion that transfers smooth away. Twin: src/stages/sharpen.rs.
#import layout
#import takes_part
#import stretch
#import kernel
#import bins
#import chunk
#import cells
#import shares
#import momentum_scale
#import halt
#import gather
#import meet
#if TILES
#import gather_tile
#else
#import rows
#import gather_grid
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(6) var<storage, read> grid: array<vec4u>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;

// Units of mass over those of momentum.
var<private> scale: f32;

// The motion of a node; 0 for one without mass. Without a branch: SwiftShader's compiler does not cope with 27 of them.
fn stored_node(i: u32) -> vec4f {
    let sum = grid[i];
    let mass = f32(sum.w);
    return vec4f(vec3f(bitcast<vec3i>(sum.xyz)), mass) * select(scale / mass, 0.0, sum.w == 0u);
}

fn sharpen_particle(nodes: ptr<function, Nodes>, p: u32) {
    let left = gathered(nodes, position[p].xyz);
    let u = displacement[p];
    displacement[p] = vec4f(u.xyz + (u.xyz - left.sum.xyz), u.w);
    let d = gradient[p];
    gradient[p].x = d.x + (d.x - left.x.xyz);
    gradient[p].y = d.y + (d.y - left.y.xyz);
    gradient[p].z = d.z + (d.z - left.z.xyz);
}

// The particles of a share are all of one cell.
fn sharpen(c: u32, cell: Cell) {
    var nodes = cell_nodes(c, cell.at);
    var i = cell.first;
    loop {
        sharpen_particle(&nodes, order[i]);
        i++;
        if i == cell.end {
            break;
        }
    }
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    scale = constants.mass_scale / momentum_scale();
    let mine = stretch(group.x, groups.x, count);
    for (var c = awake_from(mine.first, mine.end); c < mine.end; c = awake_from(c + 1u, mine.end)) {
        begin_gather(c, lane);
        meet();
        let all = shares(c);
        var k = lane;
        loop {
            if k < all {
                sharpen(c, share_of(c, k));
            }
            k += LANES;
            if k >= all {
                break;
            }
        }
        meet();
    }
}
