// Records how far from bodies the solids at each node are, and before which faces of boxes. Twin: src/stages/gap.rs.
//
// The gaps are stored behind the bits of the bodies in reach: stages that need both have no other storage buffer left.
#import layout
#import gradient
#import linear
#import takes_part
#import stretch
#import exponential
#import kernel
#import bins
#import chunk
#import cells
#import halt
#import rows
#import sdf
#import contact

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(4) var<colliders> colliders: Colliders;
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(7) var<storage, read_write> cull: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;
#if MESHES
@group(0) @binding(9) var<uniform> distance_grids: array<DistanceGrid, MESHES>;
@group(0) @binding(10) var distances: texture_2d<f32>;
#endif

// What the particles of one cell record on its 27 nodes, by rows.
alias Noted = array<vec3u, 9>;

// Half the edge of a cube of this volume: how far the matter of a particle extends.
fn half_edge(volume: f32) -> f32 {
    return 0.5 * exponential(ln(volume) * (1.0 / 3.0));
}

#if BOXES
// The axes of the world along which solids in the cell that touch boxes lie squarely before their faces.
var<private> faces: u32;

// Those along which a normal lies.
fn axes_along(normal: vec3f) -> u32 {
    return dot(select(vec3u(0u), vec3u(1u, 2u, 4u), vec3f(FACE_ON) <= abs(normal)), vec3u(1u));
}
#endif

// The gap between the matter of a particle at `x` and the nearest body, and the body's normal there; at least WIDEST if
// the particle is that far away.
fn gap_of(block: u32, x: vec3f, volume: f32) -> Surface {
    let half = half_edge(volume);
    var nearest = Surface(vec3f(0.0), FAR);
    var reach = reach_from(block, 0u);
    while reach.bits != 0u {
        let c = first_in(reach);
        let at = surface_at(c, frame(c, x));
        if at.distance < nearest.distance {
            nearest = at;
        }
#if BOXES
        if colliders[c].kind == SHAPE_BOX && at.distance < half + TOUCHING {
            faces |= axes_along(at.normal);
        }
#endif
        reach = without_first(block, reach);
    }
    if nearest.distance < WIDEST {
        let gap = nearest.distance - half;
        nearest.distance = select(0.0, gap, gap > 0.0);
    }
    return nearest;
}

// What a solid that would record `least` without a gap records at a node that is this `way` from the particle.
fn gap_at(way: vec3f, surface: Surface, least: u32) -> u32 {
    let along = dot3(way, surface.normal);
    let beside = dot3(way, way) - along * along - OPPOSITE;
    let gap = surface.distance + select(0.0, beside * BESIDE, beside > 0.0);
    return 2u * u32(min(gap, WIDEST) * PARTS) + least;
}

fn note_row(noted: ptr<function, Noted>, n: u32, x: vec3f, y: f32, z: f32, surface: Surface, least: u32) {
    let gaps = vec3u(
        gap_at(vec3f(x.x, y, z), surface, least),
        gap_at(vec3f(x.y, y, z), surface, least),
        gap_at(vec3f(x.z, y, z), surface, least),
    );
    (*noted)[n] = min((*noted)[n], gaps);
}

// The way from `x` to a node. Nodes behind the domain's sides count as if they were on them, so that matter in corners
// has nodes opposite it.
fn way_to(node: vec3f, x: vec3f) -> vec3f {
    return min(max(node, constants.lo), constants.hi) - x;
}

fn note_particle(noted: ptr<function, Noted>, block: u32, p: u32) {
    let g = gradient[p];
    let material = material_of(g.material);
    // No gap: nodes hold liquids, and sand, whose single grains would slip between them.
    let model = materials[material].model;
    if model == MODEL_LIQUID {
        *noted = Noted();
        return;
    }
    if model == MODEL_SAND {
        for (var n = 0u; n < 9u; n++) {
            (*noted)[n] = min((*noted)[n], vec3u(SAND_NEAR));
        }
        return;
    }
    let x = position[p].xyz;
    let surface = gap_of(block, x, g.mass * materials[material].inverse_density);
    if surface.distance >= WIDEST {
        return;
    }
    let least = select(ELASTIC_NEAR, VISCOPLASTIC_NEAR, model == MODEL_VISCOPLASTIC);
    let first = vec3f(base(x));
    let a = way_to(first, x);
    let b = way_to(first + 1.0, x);
    let c = way_to(first + 2.0, x);
    let along = vec3f(a.x, b.x, c.x);
    note_row(noted, 0u, along, a.y, a.z, surface, least);
    note_row(noted, 1u, along, b.y, a.z, surface, least);
    note_row(noted, 2u, along, c.y, a.z, surface, least);
    note_row(noted, 3u, along, a.y, b.z, surface, least);
    note_row(noted, 4u, along, b.y, b.z, surface, least);
    note_row(noted, 5u, along, c.y, b.z, surface, least);
    note_row(noted, 6u, along, a.y, c.z, surface, least);
    note_row(noted, 7u, along, b.y, c.z, surface, least);
    note_row(noted, 8u, along, c.y, c.z, surface, least);
}

fn add_to_node(node: u32, gap: u32) {
    if gap < NONE_NEAR {
        atomicMin(&cull[gap_word(node)], gap);
    }
#if BOXES
    if faces != 0u {
        let bits = faces << (node % NODES_PER_WORD * FACE_BITS);
        atomicOr(&cull[faces_word(node)], bits);
    }
#endif
}

fn add_row(chunk: u32, at: vec3u, noted: vec3u) {
    let row = row_in_grid(chunk, at);
    add_to_node(row.x, noted.x);
    add_to_node(row.y, noted.y);
    add_to_node(row.z, noted.z);
}

fn note_cell(c: u32, cell: Cell) {
    let block = chunks[c].block;
    var noted = Noted();
    for (var n = 0u; n < 9u; n++) {
        noted[n] = vec3u(NONE_NEAR);
    }
#if BOXES
    faces = 0u;
#endif
    var i = cell.first;
    loop {
        note_particle(&noted, block, order[i]);
        i++;
        if i == cell.end {
            break;
        }
    }
    let at = block_at(cell.at);
    for (var n = 0u; n < 9u; n++) {
        add_row(c, at + vec3u(0u, n % 3u, n / 3u), noted[n]);
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
        if reach_from(chunks[c].block, 0u).bits == 0u {
            continue;
        }
        let cells = chunks[c].cell_count;
        var k = lane;
        loop {
            if k < cells {
                note_cell(c, cell_of(c, k));
            }
            k += LANES;
            if k >= cells {
                break;
            }
        }
    }
}
