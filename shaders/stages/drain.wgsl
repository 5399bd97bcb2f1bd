// Deletes the particles that are in a drain, and frees the slots of quarantined ones where a host has asked for that.
// Twin: src/stages/drain.rs.
#import layout
#import linear
#import halt
#import sdf

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> regions: array<Collider>;
@group(0) @binding(2) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> counters: Counters;
#if MESHES
@group(0) @binding(4) var<uniform> distance_grids: array<DistanceGrid, MESHES>;
@group(0) @binding(5) var distances: texture_2d<f32>;
#endif

fn drained(x: vec3f) -> bool {
    for (var d = 0u; d < constants.drain_count; d++) {
        let local = transform_transposed(regions[d].axes, x - regions[d].position);
        if surface(regions[d].kind, regions[d].size, local).distance < 0.0 {
            return true;
        }
    }
    return false;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    for (var p = id.x; p < constants.particle_count; p += groups.x * GROUP) {
        let x = position[p];
        if x.w > 0.0 && drained(x.xyz) {
            position[p].w = DRAINED;
            atomicAdd(&counters.drained, 1u);
        } else if constants.release != 0u && x.w == QUARANTINED {
            position[p].w = VACANT;
        }
    }
}
