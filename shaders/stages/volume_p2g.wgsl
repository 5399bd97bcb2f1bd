// Sums the particles' volumes at rest on the nodes. Twin: src/stages/volume_p2g.rs.
//
// Built like p2g: where that sums mass in the fourth channel, this sums volume.
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
#import meet
#if TILES
#else
#import rows
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read> order: array<u32>;
@group(0) @binding(5) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(6) var<storage, read_write> grid: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;

// What one cell's particles bring to its 27 nodes, by rows.
alias Sums = array<vec3i, 9>;

fn rounded(value: vec3f) -> vec3i {
    return vec3i(round(value));
}

fn add_plane(sums: ptr<function, Sums>, n: u32, row: vec3f, weight: f32, s: Stencil) -> vec3i {
    let a = rounded(row * (weight * s.w0.y));
    let b = rounded(row * (weight * s.w1.y));
    let c = rounded(row * (weight * s.w2.y));
    (*sums)[n] += a;
    (*sums)[n + 1u] += b;
    (*sums)[n + 2u] += c;
    return a + b + c;
}

fn add_particle(sums: ptr<function, Sums>, p: u32) {
    let x = position[p].xyz;
    let s = stencil(x - vec3f(base(x)));
    let g = gradient[p];
    let m = materials[material_of(g.material)];
    let volume = g.mass * m.inverse_density * constants.mass_scale;
#if MIXES
    solids += u32(is_solid(m.model));
#endif
    let row = vec3f(s.w0.x, s.w1.x, s.w2.x) * volume;
    let total = add_plane(sums, 0u, row, s.w0.z, s)
        + add_plane(sums, 3u, row, s.w1.z, s)
        + add_plane(sums, 6u, row, s.w2.z, s);
    // The remainder of rounding node by node goes to the middle node.
    (*sums)[4].y += i32(round(volume)) - (total.x + total.y + total.z);
}

// How many sums an invocation has seen leave their range.
var<private> saturated: u32;

#if MIXES
// How many of a share's particles are solid.
var<private> solids: u32;

fn is_solid(model: u32) -> bool {
    return model == MODEL_ELASTIC || model == MODEL_VISCOPLASTIC;
}
#endif

fn add_to_node(node: u32, volume: u32) {
    let before = atomicAdd(&grid[4u * node + 3u], volume);
    saturated += u32(before + volume < before);
}

#if TILES
var<workgroup> tile: array<atomic<u32>, TILE_NODES>;
#if MIXES
var<workgroup> tile_solids: array<atomic<u32>, TILE_NODES>;
#endif

fn begin(lane: u32) {
    for (var t = lane; t < TILE_NODES; t += LANES) {
        atomicStore(&tile[t], 0u);
#if MIXES
        atomicStore(&tile_solids[t], 0u);
#endif
    }
}

fn add_row(chunk: u32, at: vec3u, sum: vec3i) {
    let node = tile_index(at);
    atomicAdd(&tile[node], u32(sum.x));
    atomicAdd(&tile[node + 1u], u32(sum.y));
    atomicAdd(&tile[node + 2u], u32(sum.z));
#if MIXES
    if solids != 0u {
        atomicAdd(&tile_solids[node], solids);
        atomicAdd(&tile_solids[node + 1u], solids);
        atomicAdd(&tile_solids[node + 2u], solids);
    }
#endif
}

fn end(chunk: u32, lane: u32) {
    for (var t = lane; t < TILE_NODES; t += LANES) {
        let volume = atomicLoad(&tile[t]);
#if MIXES
        let count = atomicLoad(&tile_solids[t]);
#else
        let count = 0u;
#endif
        if (volume | count) != 0u {
            let at = tile_at(t);
            let node = chunks[chunk].links[tile_block(at)] * NODES + block_node(at);
            add_to_node(node, volume);
#if MIXES
            if count != 0u {
                atomicAdd(&grid[4u * node], count);
            }
#endif
        }
    }
}
#else
fn begin(lane: u32) {}

fn add_row(chunk: u32, at: vec3u, sum: vec3i) {
    let row = row_in_grid(chunk, at);
    add_to_node(row.x, u32(sum.x));
    add_to_node(row.y, u32(sum.y));
    add_to_node(row.z, u32(sum.z));
#if MIXES
    if solids != 0u {
        atomicAdd(&grid[4u * row.x], solids);
        atomicAdd(&grid[4u * row.y], solids);
        atomicAdd(&grid[4u * row.z], solids);
    }
#endif
}

fn end(chunk: u32, lane: u32) {}
#endif

fn scatter(c: u32, cell: Cell) {
    var sums = Sums();
#if MIXES
    solids = 0u;
#endif
    var i = cell.first;
    loop {
        add_particle(&sums, order[i]);
        i++;
        if i == cell.end {
            break;
        }
    }
    let at = block_at(cell.at);
    add_row(c, at, sums[0]);
    add_row(c, at + vec3u(0u, 1u, 0u), sums[1]);
    add_row(c, at + vec3u(0u, 2u, 0u), sums[2]);
    add_row(c, at + vec3u(0u, 0u, 1u), sums[3]);
    add_row(c, at + vec3u(0u, 1u, 1u), sums[4]);
    add_row(c, at + vec3u(0u, 2u, 1u), sums[5]);
    add_row(c, at + vec3u(0u, 0u, 2u), sums[6]);
    add_row(c, at + vec3u(0u, 1u, 2u), sums[7]);
    add_row(c, at + vec3u(0u, 2u, 2u), sums[8]);
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = chunks_to_do(lane);
    let mine = stretch(group.x, groups.x, count);
    for (var c = with_mass_from(mine.first, mine.end); c < mine.end; c = with_mass_from(c + 1u, mine.end)) {
        begin(lane);
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
        end(c, lane);
        meet();
    }
    if saturated != 0u {
        atomicAdd(&counters.saturated_nodes, saturated);
    }
}
