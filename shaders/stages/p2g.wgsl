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
#if PUBLISHED
#import bound_gradient
#endif
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
#if FUSED
#import viscosity
#import liquid
#endif

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

// A displacement within the bound that the fixed-point scale is made for.
fn bounded(u: vec3f) -> vec3f {
    if is_fast(u) {
        atomicAdd(&counters.speed_clamped, 1u);
        return slowed(u);
    }
    return u;
}

// In the other schemes, where the largest motion is known, gradients are within bounds.
fn within_bounds(d: mat3x3f) -> mat3x3f {
#if PUBLISHED
    return bounded_gradient(d).d;
#else
    return d;
#endif
}

// Units per unit of momentum.
var<private> scale: f32;

// A particle's gradient after the constraint, where that has no pass of its own.
fn constrained(ratio: f32, g: Gradient) -> mat3x3f {
    let d = mat3x3f(g.x, g.y, g.z);
#if FUSED
    let m = materials[u32(g.material)];
    return constrain_liquid(m, ratio, take_shear(m.viscous_relaxation, d));
#else
    return d;
#endif
}

fn add_particle(sums: ptr<function, Sums>, p: u32) {
    let x = position[p];
    let g = gradient[p];
    let u = bounded(displacement[p].xyz);
    let d = within_bounds(constrained(x.w, g));

    let mass = g.mass;
    let unit = vec4f(vec3f(mass * scale), mass * constants.mass_scale);
    let dx = vec4f(d[0], 0.0) * unit;
    let dy = vec4f(d[1], 0.0) * unit;
    let dz = vec4f(d[2], 0.0) * unit;
    add_affine(sums, x.xyz, vec4f(u, 1.0) * unit, dx, dy, dz);
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
