// Prepares the solve of the implicit scheme: viscosity, and the pressure that each particle brings from the step before.
// Twin: src/stages/press.rs.
#import layout
#import linear
#import bound_gradient
#import halt
#import wide
#import totals
#import viscosity
#import compliance

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read_write> search: array<Search>;
@group(0) @binding(5) var<storage, read_write> solve: Solve;
@group(0) @binding(6) var<storage, read_write> counters: Counters;

// The pressure that a particle brings along, and its compliance: neither where it has come apart and does not close up.
fn brought(m: Material, d: mat3x3f, ratio: f32, pressure: f32) -> vec2f {
    let trace = d[0][0] + d[1][1] + d[2][2];
    if ratio + ratio * trace > constants.tension_limit {
        return vec2f(0.0);
    }
    let compliance = compliance(m);
    let most = min(MAX_DIVERGENCE * (1.0 / compliance), MAX_PRESSURE);
    return vec2f(min(max(pressure, -most), most), compliance);
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_totals(lane);
    let count = select(constants.particle_count, 0u, halted());
    for (var p = id.x; p < count; p += groups.x * GROUP) {
        let ratio = position[p].w;
        if ratio > 0.0 {
            let g = gradient[p];
            let m = materials[u32(g.y.w)];
            let kept = bounded_gradient(mat3x3f(g.x.xyz, g.y.xyz, g.z.xyz));
            let d = take_shear(viscous_share(m), kept.d);
            let part = brought(m, d, ratio, g.z.w);
            let q = part.x;
            search[p] = Search(0.0, 0.0, 0.0, part.y);
            let moved = d + mat3x3f(q, 0.0, 0.0, 0.0, q, 0.0, 0.0, 0.0, q);
            gradient[p] = Gradient(vec4f(moved[0], g.x.w), vec4f(moved[1], g.y.w), vec4f(moved[2], q));
            note_largest(PRESSURE, abs(q));
            note_largest(RATE, kept.square);
            note_largest(COMPLIANCE, part.y);
        }
    }
    end_totals(lane);
}
