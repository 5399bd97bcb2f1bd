// Gathers the volume fraction at each particle. Twin: src/stages/volume_g2p.rs.
#import layout
#import gradient
#import takes_part
#import stretch
#import kernel
#import bins
#import chunk
#import cells
#import shares
#import halt
#import even
#import believed
#import meet
#if TILES
#else
#import rows
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read> order: array<u32>;
@group(0) @binding(4) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(5) var<storage, read> grid: array<vec4u>;
@group(0) @binding(6) var<storage, read_write> counters: Counters;
@group(0) @binding(7) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(8) var<uniform> materials: array<Material, MATERIALS>;

// Volumes on the 27 nodes of a cell, by rows; negated where there are solids.
alias CellNodes = array<vec3f, 9>;

fn cell_row(cell: ptr<function, CellNodes>, n: u32) -> vec3f {
    return (*cell)[n / 3u];
}

fn stored(node: u32) -> f32 {
    let volume = f32(grid[node].w) * (1.0 / constants.mass_scale);
#if MIXES
    return select(volume, -volume, grid[node].x != 0u);
#else
    return volume;
#endif
}

#if TILES
var<workgroup> tile: array<f32, TILE_NODES>;

fn begin(chunk: u32, lane: u32) {
    for (var t = lane; t < TILE_NODES; t += LANES) {
        let at = tile_at(t);
        tile[t] = stored(chunks[chunk].links[tile_block(at)] * NODES + block_node(at));
    }
}

fn row_at(chunk: u32, at: vec3u) -> vec3f {
    let t = tile_index(at);
    return vec3f(tile[t], tile[t + 1u], tile[t + 2u]);
}
#else
fn begin(chunk: u32, lane: u32) {}

fn row_at(chunk: u32, at: vec3u) -> vec3f {
    let row = row_in_grid(chunk, at);
    return vec3f(stored(row.x), stored(row.y), stored(row.z));
}
#endif

#if MIXES
// What lies beside solids at nodes of a cell.
struct Beside {
    any: bool, // whether there are solids
    extremes: vec2f, // of the nodes, with those of solids counted as the fullest of the others
}

fn beside_solids(signed: CellNodes, first: vec3f) -> Beside {
    var open = vec3f(0.0);
    var least = vec3f(0.0);
    for (var n = 0u; n < 9u; n++) {
        open = max(open, signed[n]);
        least = min(least, signed[n]);
    }
    if min(min(least.x, least.y), least.z) >= 0.0 {
        return Beside(false, vec2f());
    }
    let most = max(max(open.x, open.y), open.z);
    // Nodes of solids count as the fullest of the others.
    var nodes = signed;
    for (var n = 0u; n < 9u; n++) {
        nodes[n] = select(signed[n], vec3f(most), signed[n] < vec3f(0.0));
    }
    return Beside(true, cell_extremes(&nodes, counting(first)));
}
#endif

fn row(v: vec3f, s: Stencil) -> f32 {
    return v.x * s.w0.x + v.y * s.w1.x + v.z * s.w2.x;
}

fn plane(cell: ptr<function, CellNodes>, n: u32, s: Stencil) -> f32 {
    return row((*cell)[n], s) * s.w0.y + row((*cell)[n + 1u], s) * s.w1.y + row((*cell)[n + 2u], s) * s.w2.y;
}

fn gather(c: u32, cell: Cell) {
    let at = block_at(cell.at);
    var nodes = CellNodes(
        row_at(c, at),
        row_at(c, at + vec3u(0u, 1u, 0u)),
        row_at(c, at + vec3u(0u, 2u, 0u)),
        row_at(c, at + vec3u(0u, 0u, 1u)),
        row_at(c, at + vec3u(0u, 1u, 1u)),
        row_at(c, at + vec3u(0u, 2u, 1u)),
        row_at(c, at + vec3u(0u, 0u, 2u)),
        row_at(c, at + vec3u(0u, 1u, 2u)),
        row_at(c, at + vec3u(0u, 2u, 2u)),
    );
    var i = cell.first;
    let first = vec3f(base(position[order[i]].xyz));
#if MIXES
    let signed = nodes;
    for (var n = 0u; n < 9u; n++) {
        nodes[n] = abs(nodes[n]);
    }
#endif
    let counts = counting(first);
    let extremes = cell_extremes(&nodes, counts);
    let difference = cell_difference(&nodes, counts);
#if MIXES
    let beside = beside_solids(signed, first);
#endif
    loop {
        let p = order[i];
        let x = position[p];
        let s = stencil(x.xyz - first);
        let fraction = plane(&nodes, 0u, s) * s.w0.z + plane(&nodes, 3u, s) * s.w1.z + plane(&nodes, 6u, s) * s.w2.z;
        let m = materials[material_of(gradient[p].material)];
        let even = is_even(extremes, m.even);
        let loose = m.model == MODEL_LIQUID && is_loose(extremes, difference, 1.0 - fraction * x.w);
#if MIXES
        let even_beside = beside.any && (even || (beside.extremes.y > 0.0 && is_even(beside.extremes, m.even)));
        displacement[p].w = believed_beside(fraction, x.w, even, loose, even_beside);
#else
        displacement[p].w = believed(fraction, x.w, even, loose);
#endif
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
    let mine = stretch(group.x, groups.x, count);
    for (var c = awake_from(mine.first, mine.end); c < mine.end; c = awake_from(c + 1u, mine.end)) {
        begin(c, lane);
        meet();
        let all = shares(c);
        var k = lane;
        loop {
            if k < all {
                gather(c, share_of(c, k));
            }
            k += LANES;
            if k >= all {
                break;
            }
        }
        meet();
    }
}
