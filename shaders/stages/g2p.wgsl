// Gathers displacement and gradient for each particle. Twin: src/stages/g2p.rs.
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
#import gather
#import meet
#if TILES
#import gather_tile
#else
#import rows
#import gather_grid
#endif
#if VOLUMES
#else
#import believed
#endif
#if EVENNESS
#import even

alias CellNodes = Nodes;

fn cell_row(nodes: ptr<function, Nodes>, n: u32) -> vec3f {
    return vec3f(node_of(nodes, n).w, node_of(nodes, n + 1u).w, node_of(nodes, n + 2u).w);
}
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> displacement: array<vec4f>;
#if TILES
// Whole columns, which devices write fastest.
@group(0) @binding(4) var<storage, read_write> gradient: array<GradientRows>;
#else
@group(0) @binding(4) var<storage, read_write> gradient: array<Gradient>;
#endif
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(7) var<storage, read> grid: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;

fn stored_node(i: u32) -> vec4f {
    return grid[i];
}

#if TILES
fn stored_material(p: u32) -> f32 {
    return gradient[p].y.w;
}

fn store_gradient(p: u32, found: Gathered, pressure: f32) {
    gradient[p].x = vec4f(found.x.xyz, gradient[p].x.w);
    gradient[p].y = vec4f(found.y.xyz, gradient[p].y.w);
#if FIRM
    gradient[p].z = vec4f(found.z.xyz, pressure);
#else
    gradient[p].z = vec4f(found.z.xyz, gradient[p].z.w);
#endif
}
#else
fn stored_material(p: u32) -> f32 {
    return gradient[p].material;
}

fn store_gradient(p: u32, found: Gathered, pressure: f32) {
    gradient[p].x = found.x.xyz;
    gradient[p].y = found.y.xyz;
    gradient[p].z = found.z.xyz;
#if FIRM
    gradient[p].pressure = pressure;
#endif
}
#endif

// How evenly matter lies around the particles of a cell.
struct Around {
    extremes: vec2f,
    difference: f32,
}

#if EVENNESS
fn look_around(nodes: ptr<function, Nodes>, x: vec3f) -> Around {
    let counts = counting(vec3f(base(x)));
#if VOLUMES
    return Around(cell_extremes(nodes, counts), 0.0);
#else
    return Around(cell_extremes(nodes, counts), cell_difference(nodes, counts));
#endif
}
#endif

fn gather_particle(nodes: ptr<function, Nodes>, known: Around, p: u32) {
    let x = position[p];
    let found = gathered(nodes, x.xyz);
    var around = known;
#if VOLUMES
#else
    let m = materials[material_of(stored_material(p))];
    let fraction = found.sum.w * m.inverse_density;
#if LOOKS_AROUND
#else
    // The only particle of its share. Few need this, which takes as long as all else.
    if is_too_little(fraction, x.w) {
        around = look_around(nodes, x.xyz);
    }
#endif
    let loose = m.model == MODEL_LIQUID
        && is_loose(around.extremes, around.difference * m.inverse_density, 1.0 - fraction * x.w);
#endif
#if FIRM
    store_gradient(p, found, evenness(around.extremes));
#else
    store_gradient(p, found, 0.0);
#endif
#if VOLUMES
    // The fraction that volume_g2p measured holds for the whole step.
    displacement[p] = vec4f(found.sum.xyz, displacement[p].w);
#else
    displacement[p] = vec4f(found.sum.xyz, believed(fraction, x.w, is_even(around.extremes, m.even), loose));
#endif
}

// The particles of a share are all of one cell.
fn gather(c: u32, cell: Cell) {
    var nodes = cell_nodes(c, cell.at);
    var i = cell.first;
    var around = Around();
#if LOOKS_AROUND
    around = look_around(&nodes, position[order[i]].xyz);
#endif
    loop {
        gather_particle(&nodes, around, order[i]);
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
        begin_gather(c, lane);
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
