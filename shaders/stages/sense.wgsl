// Sums the particles in each sensor. Twin: src/stages/sense.rs.
//
// Steps alternate between two sets of sums: one is added to while the other is zeroed for the next step. A workgroup
// sums in its own memory first, so that few add to the same words at a time, and for several sensors at once, so that a
// particle is read once for all of them.
#import layout
#import linear
#import halt
#import sum64
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

// Sensors for which a particle is read at once.
const AT_ONCE = 16u;

var<workgroup> group_sums: array<atomic<u32>, AT_ONCE * SENSED_WORDS>;

fn add(word: u32, value: f32) {
    let whole = wide(value);
    let high = carried(atomicAdd(&group_sums[word], whole.x), whole);
    if high != 0u {
        atomicAdd(&group_sums[word + 1u], high);
    }
}

// Adds a particle at `x` to the workgroup's sums of a sensor, which begin at `first`, if it is inside.
fn sense(p: u32, x: vec3f, sensor: u32, first: u32) {
    let r = constants.drain_count + sensor;
    let local = transform_transposed(regions[r].axes, x - regions[r].position);
    if surface(regions[r].kind, regions[r].size, local).distance >= 0.0 {
        return;
    }
    let u = displacement[p].xyz;
    let mass = gradient[p].mass;
    let weight = mass * constants.load_scale;
    atomicAdd(&group_sums[first], 1u);
    add(first + 2u, mass * SENSED_MASS);
    add(first + 4u, u.x * weight);
    add(first + 6u, u.y * weight);
    add(first + 8u, u.z * weight);
}

// Adds two words of the workgroup's sums to the global ones, which begin at `first`, and zeroes them.
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
    for (var word = lane; word < AT_ONCE * SENSED_WORDS; word += GROUP) {
        atomicStore(&group_sums[word], 0u);
    }
    workgroupBarrier();
    let goes_on = !halted();
    let count = select(0u, constants.particle_count, goes_on);
    let words = sensor_count() * SENSED_WORDS;
    let turn = atomicLoad(&counters.steps) & 1u;
    for (var word = id.x; goes_on && word < words; word += groups.x * GROUP) {
        atomicStore(&sensed[(1u - turn) * words + word], 0u);
    }
    for (var first = 0u; first < sensor_count(); first += AT_ONCE) {
        let some = min(sensor_count() - first, AT_ONCE);
        for (var p = id.x; p < count; p += groups.x * GROUP) {
            let x = position[p];
            for (var n = 0u; x.w > 0.0 && n < some; n++) {
                sense(p, x.xyz, first + n, n * SENSED_WORDS);
            }
        }
        workgroupBarrier();
        for (var word = 2u * lane; word < some * SENSED_WORDS; word += 2u * GROUP) {
            give(word, turn * words + first * SENSED_WORDS);
        }
        workgroupBarrier();
    }
}
