// Corrects the displacement gradient of each particle towards its material's constraint.
// Twin: src/stages/constraint.rs.
#import layout
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read_write> counters: Counters;

fn liquid(material: Material, ratio: f32, start: mat3x3f) -> mat3x3f {
    var d = start;
    let trace = d[0][0] + d[1][1] + d[2][2];
    let share = material.viscous_relaxation;
    if share > 0.0 {
        let mean = trace * (1.0 / 3.0);
        let shear = share * 0.5 * (d + transpose(d));
        d -= shear;
        d += mat3x3f(share * mean, 0.0, 0.0, 0.0, share * mean, 0.0, 0.0, 0.0, share * mean);
    }
    var error = 1.0 / ratio - 1.0 - trace;
    if ratio > constants.tension_limit {
        error = max(error, 0.0);
    }
    let c = material.relaxation_third * error;
    return d + mat3x3f(c, 0.0, 0.0, 0.0, c, 0.0, 0.0, 0.0, c);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    for (var p = id.x; p < constants.particle_count; p += groups.x * GROUP) {
        let ratio = position[p].w;
        if ratio > 0.0 {
            let g = gradient[p];
            let d = liquid(materials[u32(g.y.w)], ratio, mat3x3f(g.x.xyz, g.y.xyz, g.z.xyz));
            gradient[p] = Gradient(vec4f(d[0], g.x.w), vec4f(d[1], g.y.w), vec4f(d[2], g.z.w));
        }
    }
}
