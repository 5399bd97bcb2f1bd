// Sums up the particles that are in each sensor. Twin: src/stages/sense.rs.
//
// Steps take turns between two sets of sums: one is added to while the other is zeroed for the next step. Sensor by sensor a workgroup adds
// up in its own memory first, so that few add to the same words at a time.
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

var<workgroup> group_sums: array<atomic<u32>, SENSED_WORDS>;

fn add(word: u32, value: f32) {
    let whole = wide(value);
    let high = carried(atomicAdd(&group_sums[word], whole.x), whole);
    if high != 0u {
        atomicAdd(&group_sums[word + 1u], high);
    }
}

fn sense(p: u32, sensor: u32) {
    let x = position[p];
    if x.w <= 0.0 {
        return;
    }
    let r = constants.drain_count + sensor;
    let local = transform_transposed(regions[r].axes, x.xyz - regions[r].position);
    if surface(regions[r].kind, regions[r].size, local).distance >= 0.0 {
        return;
    }
    let u = displacement[p].xyz;
    let mass = gradient[p].mass;
    let weight = mass * constants.load_scale;
    atomicAdd(&group_sums[0], 1u);
    add(2u, mass * SENSED_MASS);
    add(4u, u.x * weight);
    add(6u, u.y * weight);
    add(8u, u.z * weight);
}

// Adds two words of the workgroup's to those from `first` on, and leaves them at nothing.
fn give(word: u32, first: u32) {
    let sum = vec2u(atomicExchange(&group_sums[word], 0u), atomicExchange(&group_sums[word + 1u], 0u));
    if any(sum != vec2u(0u)) {
        let high = carried(atomicAdd(&sensed[first + word], sum.x), sum);
        if high != 0u {
            atomicAdd(&sensed[first + word + 1u], high);
        }
    }
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane < SENSED_WORDS {
        atomicStore(&group_sums[lane], 0u);
    }
    workgroupBarrier();
    let goes_on = !halted();
    let count = select(0u, constants.particle_count, goes_on);
    let words = sensor_count() * SENSED_WORDS;
    let turn = atomicLoad(&counters.steps) & 1u;
    for (var word = id.x; goes_on && word < words; word += groups.x * GROUP) {
        atomicStore(&sensed[(1u - turn) * words + word], 0u);
    }
    for (var sensor = 0u; sensor < sensor_count(); sensor++) {
        for (var p = id.x; p < count; p += groups.x * GROUP) {
            sense(p, sensor);
        }
        workgroupBarrier();
        if 2u * lane < SENSED_WORDS {
            give(2u * lane, turn * words + sensor * SENSED_WORDS);
        }
        workgroupBarrier();
    }
}
