// Scales displacements and pressures when the step length changed. Twin: src/stages/rescale.rs.
#import layout
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(3) var<storage, read_write> counters: Counters;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    let factor = vec4f(vec3f(constants.rescale), 1.0);
    for (var p = id.x; p < constants.particle_count; p += groups.x * GROUP) {
        displacement[p] *= factor;
        let d = gradient[p];
        // The fourth lane: the pressure of the implicit scheme; elsewhere there is nothing.
        gradient[p] = Gradient(d.x * factor, d.y * factor, d.z * vec4f(factor.xyz, constants.pressure_rescale));
    }
}
