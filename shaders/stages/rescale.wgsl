// Scales displacements, pressures and stresses when the step length has changed. Twin: src/stages/rescale.rs.
#import layout
#import halt
#if TENSORS
#import linear
#import symmetric
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(3) var<storage, read_write> counters: Counters;
#if TENSORS
@group(0) @binding(4) var<storage, read_write> search: array<StressSearch>;
#endif

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    let factor = constants.rescale;
    for (var p = id.x; p < constants.particle_count; p += groups.x * GROUP) {
        let u = displacement[p];
        displacement[p] = vec4f(u.xyz * factor, u.w);
        let d = gradient[p];
        gradient[p].x = d.x * factor;
        gradient[p].y = d.y * factor;
        gradient[p].z = d.z * factor;
        gradient[p].pressure = d.pressure * constants.pressure_rescale;
#if TENSORS
        search[p].shear.brought = times(search[p].shear.brought, constants.pressure_rescale);
#endif
    }
}
