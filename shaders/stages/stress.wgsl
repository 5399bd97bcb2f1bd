// Adds each particle's stress to its displacement gradient. Twin: src/stages/stress.rs.
#import layout
#import gradient
#if SLEEP
#import bins
#endif
#import halt
#import linear
#import bound_gradient
#import largest_motion
#if CORRECTS
#import corrected
#endif
#import viscosity
#if WALLS
#import walls
#endif
#if SOLIDS
#import exponential
#import svd
#import solid
#import stress
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
@group(0) @binding(7) var<storage, read> displacement: array<vec4f>;

#if LIQUID
// Largest stiffness of a liquid relative to that of an isolated particle, where matter lies this evenly and a step
// removes this share of the shear.
fn firmness(evenness: f32, share: f32, factors: vec3f) -> f32 {
    let firmest = FIRMEST - share * SOFTENED;
    let beside = 3.0 / (factors.x + factors.y + factors.z);
    let softest = select(1.0, beside * beside, evenness < 0.0);
    return min(max(evenness * FIRMING - SOFT, softest), firmest);
}

// The effect of the stress −K (1 − J) of a liquid at `x`; none where it has come apart.
fn liquid_stress(m: Material, x: vec3f, material: f32, ratio: f32, unit: f32, evenness: f32) -> mat3x3f {
#if WALLS
    let factors = wall_factors(x, material);
#else
    let factors = vec3f(1.0);
#endif
    var pressure = 0.0;
    if ratio <= constants.tension_limit {
        pressure = min(unit * m.bulk, 4.0 * constants.stiffness_limit * firmness(evenness, viscous_share(m), factors))
            * (1.0 - ratio);
    }
    return diagonal_of(pressure * factors);
}
#endif

fn stress(m: Material, p: u32, x: vec3f, ratio: f32, evenness: f32) -> mat3x3f {
    let unit = 4.0 * m.inverse_density * constants.seconds * constants.seconds * constants.impulse;
#if SOLIDS
    if m.model != MODEL_LIQUID {
        let f = deformation[p];
        let all = solid_stress(m, f, unit);
#if CORRECTS
        if m.model != MODEL_SAND {
            return corrected(all, kept_correction(f));
        }
#endif
        return all;
    }
#endif
#if LIQUID
    return liquid_stress(m, x, gradient[p].material, ratio, unit, evenness);
#else
    return mat3x3f();
#endif
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_motion(lane);
    let count = select(constants.particle_count, 0u, halted());
    for (var p = id.x; p < count; p += groups.x * GROUP) {
#if SLEEP
        if (bin[p].rest & ASLEEP) != 0u {
            continue;
        }
#endif
        let x = position[p];
        if x.w > 0.0 {
            let g = gradient[p];
            let m = materials[material_of(g.material)];
            let moved = take_shear(viscous_share(m), mat3x3f(g.x, g.y, g.z));
            let d = bounded_gradient(moved + stress(m, p, x.xyz, x.w, g.pressure)).d;
            gradient[p].x = d[0];
            gradient[p].y = d[1];
            gradient[p].z = d[2];
            note_motion(displacement[p].xyz, d);
        }
    }
    end_motion(lane);
}
