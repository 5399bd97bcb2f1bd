// Sums for each block the push at the nodes of its tile of one unit of pressure of all its liquids, and their volume,
// volume ratio and pressure. Twin: src/stages/block_p2g.rs.
#import layout
#import gradient
#import takes_part
#import stretch
#import kernel
#import bins
#import cells
#import shares
#import scatter
#import meet
#if TILES
#import scatter_tile
#else
#import rows
#import scatter_grid
#endif
#import force_scale
#import sum64
#import compliance
#import search
#if WALLS
#import walls
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read> search: array<Sought>;
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(7) var<storage, read_write> block_tiles: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> block_sums: array<BlockSums>;
@group(0) @binding(9) var<storage, read> solve: SolveView;

// Pressures bring no mass.
const CHANNELS = 3u;

// An invocation's contribution to a block.
var<private> volume: vec2u;
var<private> ratio: vec2u;
var<private> raised: vec2u;
var<private> softest: f32;
var<private> firmest: f32;

// What is the same for all particles.
struct Fixed {
    // Of what a unit of pressure adds to the nodes.
    scale: f32,
    // Largest pressure.
    largest: f32,
    // Of sums of pressures.
    unit: f32,
}
var<private> fixed: Fixed;

fn scatter_cell(c: u32, cell: Cell) {
    var sums = no_sums(cell.at);
    var i = cell.first;
    loop {
        let p = order[i];
        let g = gradient[p];
        let m = materials[material_of(g.material)];
        let compliance = search[p].mean.compliance;
        if m.model == MODEL_LIQUID && compliance > 0.0 {
            let own = g.mass * m.lightness;
            volume = plus(volume, own * BLOCK_SCALE);
            ratio = plus(ratio, own * position[p].w * BLOCK_SCALE);
            raised = plus(raised, g.mass * (max(g.pressure + fixed.largest * m.lightness, 0.0) * fixed.unit) * BLOCK_SCALE);
            softest = max(softest, compliance * m.lightness);
            firmest = max(firmest, stiffness_beside(m) * (1.0 / m.lightness));
            var push = vec3f(own * fixed.scale);
#if WALLS
#if TENSORS
            if search[p].shear.compliance <= 0.0 {
                push *= wall_factors(position[p].xyz, g.material);
            }
#else
            push *= wall_factors(position[p].xyz, g.material);
#endif
#endif
            add_affine(&sums, position[p].xyz, vec4f(0.0), vec4f(push.x, 0.0, 0.0, 0.0), vec4f(0.0, push.y, 0.0, 0.0), vec4f(0.0, 0.0, push.z, 0.0));
        }
        i++;
        if i == cell.end {
            break;
        }
    }
    add_cell(&sums, c, cell.at);
}

fn add_sum(block: u32, which: u32, sum: vec2u) {
    let high = carried(atomicAdd(&block_sums[block].sums[2u * which], sum.x), sum);
    if high != 0u {
        atomicAdd(&block_sums[block].sums[2u * which + 1u], high);
    }
}

fn add_to_node(node: u32, sum: vec4i) {
    let word = 3u * node;
    atomicAdd(&block_tiles[word], u32(sum.x));
    atomicAdd(&block_tiles[word + 1u], u32(sum.y));
    atomicAdd(&block_tiles[word + 2u], u32(sum.z));
}

var<workgroup> chunk_count: u32;

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        chunk_count = solve.chunks;
    }
    let count = workgroupUniformLoad(&chunk_count);
    let largest = bitcast<f32>(solve.largest[PRESSURE]);
    fixed = Fixed(force_scale(1.0), largest, inverse(largest, LEAST_PRESSURE));
    let mine = stretch(group.x, groups.x, count);
    for (var c = awake_from(mine.first, mine.end); c < mine.end; c = awake_from(c + 1u, mine.end)) {
        begin_scatter(lane);
        meet();
        volume = vec2u(0u);
        ratio = vec2u(0u);
        raised = vec2u(0u);
        softest = 0.0;
        firmest = 0.0;
        let block = chunks[c].block;
        // The same in all chunks of a block.
        for (var i = lane; i < 8u; i += LANES) {
            block_sums[block].links[i] = chunks[c].links[i];
        }
        let all = shares(c);
        var k = lane;
        loop {
            if k < all {
                scatter_cell(c, share_apart(c, k));
            }
            k += LANES;
            if k >= all {
                break;
            }
        }
        if any(volume != vec2u(0u)) {
            add_sum(block, 0u, volume);
            add_sum(block, 1u, ratio);
            add_sum(block, 2u, raised);
            atomicMax(&block_sums[block].softest, bitcast<u32>(softest));
            atomicMax(&block_sums[block].firmest, bitcast<u32>(firmest));
        }
        meet();
        end_scatter(c, lane);
        meet();
    }
}
