// Corrects the displacement gradient of each particle towards its material's constraint.
// Twin: src/stages/constraint.rs.
#import layout
#import gradient
#if SLEEP
#import bins
#endif
#import halt
#import linear
#import viscosity
#if LIQUID
#import liquid
#endif
#if SOLIDS
#import exponential
#import svd
#import solid
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
#if SOLIDS
@group(0) @binding(4) var<storage, read> deformation: array<Deformation>;
#endif
@group(0) @binding(5) var<storage, read_write> counters: Counters;
#if SLEEP
@group(0) @binding(6) var<storage, read> bin: array<Place>;
#endif

fn constrain(m: Material, p: u32, ratio: f32, d: mat3x3f) -> mat3x3f {
#if SOLIDS
    if m.model != MODEL_LIQUID {
        return constrain_solid(m, deformation[p], d);
    }
#endif
#if LIQUID
    return constrain_liquid(m, ratio, d);
#else
    return d;
#endif
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    for (var p = id.x; p < constants.particle_count; p += groups.x * GROUP) {
#if SLEEP
        if (bin[p].rest & ASLEEP) != 0u {
            continue;
        }
#endif
        let ratio = position[p].w;
        if ratio > 0.0 {
            let g = gradient[p];
            let m = materials[material_of(g.material)];
            let d = constrain(m, p, ratio, take_shear(m.viscous_relaxation, mat3x3f(g.x, g.y, g.z)));
            gradient[p].x = d[0];
            gradient[p].y = d[1];
            gradient[p].z = d[2];
        }
    }
}
