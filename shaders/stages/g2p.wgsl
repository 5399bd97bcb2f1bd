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

fn gather(p: u32, origin: vec3u) {
    let x = position[p].xyz;
    let first = base(x);
    let f = x - vec3f(first);
    let w = weights(f);
    let corner = tile_index(first - origin);
    var sum = vec4f(0.0);
    var sum_x = vec4f(0.0);
    var sum_y = vec4f(0.0);
    var sum_z = vec4f(0.0);
    for (var k = 0u; k < 3u; k++) {
        var plane = vec4f(0.0);
        var plane_x = vec4f(0.0);
        var plane_y = vec4f(0.0);
        for (var j = 0u; j < 3u; j++) {
            let row_at = corner + (k * TILE_EDGE + j) * TILE_EDGE;
            let a = tile[row_at];
            let b = tile[row_at + 1u];
            let c = tile[row_at + 2u];
            let row = a * w[0].x + b * w[1].x + c * w[2].x;
            let row_x = a * (w[0].x * -f.x) + b * (w[1].x * (1.0 - f.x)) + c * (w[2].x * (2.0 - f.x));
            plane += row * w[j].y;
            plane_x += row_x * w[j].y;
            plane_y += row * (w[j].y * (f32(j) - f.y));
        }
        sum += plane * w[k].z;
        sum_x += plane_x * w[k].z;
        sum_y += plane_y * w[k].z;
        sum_z += plane * (w[k].z * (f32(k) - f.z));
    }
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
