// Sums up the particles that are in each sensor. Twin: src/stages/sense.rs.
//
// Steps take turns between two sets of sums: one is added to while the other is zeroed for the next step.
#import layout
#import linear
#import halt
#import wide
#import sdf

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> regions: array<Collider>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> displacement: array<vec4f>;
@group(0) @binding(4) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(5) var<storage, read_write> sensed: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> counters: Counters;
#if MESHES
@group(0) @binding(7) var<uniform> distance_grids: array<DistanceGrid, MESHES>;
@group(0) @binding(8) var distances: texture_2d<f32>;
#endif

fn sensor_count() -> u32 {
    return arrayLength(&sensed) / (2u * SENSED_WORDS);
}

fn add(word: u32, value: f32) {
    let whole = wide(value);
    let high = carried(atomicAdd(&sensed[word], whole.x), whole);
    if high != 0u {
        atomicAdd(&sensed[word + 1u], high);
    }
}

fn sense(p: u32, x: vec3f, first: u32) {
    for (var s = 0u; s < sensor_count(); s++) {
        let r = constants.drain_count + s;
        let local = transform_transposed(regions[r].axes, x - regions[r].position);
        if surface(regions[r].kind, regions[r].size, local).distance >= 0.0 {
            continue;
        }
        let u = displacement[p].xyz;
        let mass = gradient[p].mass;
        let weight = mass * constants.load_scale;
        let word = first + s * SENSED_WORDS;
        atomicAdd(&sensed[word], 1u);
        add(word + 2u, mass * SENSED_MASS);
        add(word + 4u, u.x * weight);
        add(word + 6u, u.y * weight);
        add(word + 8u, u.z * weight);
    }
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    let words = sensor_count() * SENSED_WORDS;
    let turn = atomicLoad(&counters.steps) & 1u;
    for (var word = id.x; word < words; word += groups.x * GROUP) {
        atomicStore(&sensed[(1u - turn) * words + word], 0u);
    }
    for (var p = id.x; p < constants.particle_count; p += groups.x * GROUP) {
        let x = position[p];
        if x.w > 0.0 {
            sense(p, x.xyz, turn * words);
        }
    }
}
