// Gathers displacement and gradient for each particle. Twin: src/stages/g2p.rs.
#import layout
#import kernel
#import bins
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(7) var<storage, read> links: array<u32>;
@group(0) @binding(8) var<storage, read> grid: array<vec4f>;
@group(0) @binding(9) var<storage, read_write> counters: Counters;

var<workgroup> tile: array<vec4f, TILE_NODES>;
var<workgroup> chunk_count: u32;

// Sums over a row of three nodes: the values, and the values times their distance in x.
struct Row {
    sum: vec4f,
    x: vec4f,
}

// Sums over a plane of nine nodes.
struct Plane {
    sum: vec4f,
    x: vec4f,
    y: vec4f,
}

fn row(node: u32, s: Stencil) -> Row {
    let a = tile[node];
    let b = tile[node + 1u];
    let c = tile[node + 2u];
    return Row(
        a * s.w0.x + b * s.w1.x + c * s.w2.x,
        a * (s.w0.x * s.r0.x) + b * (s.w1.x * s.r1.x) + c * (s.w2.x * s.r2.x),
    );
}

fn plane(node: u32, s: Stencil) -> Plane {
    let a = row(node, s);
    let b = row(node + TILE_EDGE, s);
    let c = row(node + 2u * TILE_EDGE, s);
    return Plane(
        a.sum * s.w0.y + b.sum * s.w1.y + c.sum * s.w2.y,
        a.x * s.w0.y + b.x * s.w1.y + c.x * s.w2.y,
        a.sum * (s.w0.y * s.r0.y) + b.sum * (s.w1.y * s.r1.y) + c.sum * (s.w2.y * s.r2.y),
    );
}

fn gather(p: u32, origin: vec3u) {
    let x = position[p].xyz;
    let first = base(x);
    let s = stencil(x - vec3f(first));
    let node = tile_index(first - origin);
    let a = plane(node, s);
    let b = plane(node + TILE_EDGE * TILE_EDGE, s);
    let c = plane(node + 2u * TILE_EDGE * TILE_EDGE, s);
    let sum = a.sum * s.w0.z + b.sum * s.w1.z + c.sum * s.w2.z;
    let sum_x = a.x * s.w0.z + b.x * s.w1.z + c.x * s.w2.z;
    let sum_y = a.y * s.w0.z + b.y * s.w1.z + c.y * s.w2.z;
    let sum_z = a.sum * (s.w0.z * s.r0.z) + b.sum * (s.w1.z * s.r1.z) + c.sum * (s.w2.z * s.r2.z);
    let mass = gradient[p].x.w;
    let material = gradient[p].y.w;
    let rest = gradient[p].z.w;
    gradient[p] = Gradient(vec4f(4.0 * sum_x.xyz, mass), vec4f(4.0 * sum_y.xyz, material), vec4f(4.0 * sum_z.xyz, rest));
    displacement[p] = vec4f(sum.xyz, sum.w * materials[u32(material)].inverse_density);
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        chunk_count = select(atomicLoad(&counters.chunks), 0u, halted());
    }
    let count = workgroupUniformLoad(&chunk_count);
    for (var c = group.x; c < count; c += groups.x) {
        let chunk = chunks[c];
        for (var t = lane; t < TILE_NODES; t += GROUP) {
            let at = tile_at(t);
            tile[t] = grid[links[chunk.block * 8u + tile_block(at)] * NODES + block_node(at)];
        }
        workgroupBarrier();
        let origin = block_coordinates(chunk.key) * EDGE;
        for (var i = lane; i < chunk.count; i += GROUP) {
            gather(order[chunk.start + i], origin);
        }
        workgroupBarrier();
    }
}
