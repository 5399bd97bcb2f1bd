// What a particle's motion brings to nodes. Needs scatter, linear, bound, momentum_scale, and the bindings constants,
// counters and, where the constraint has no pass of its own, materials.
#if PUBLISHED
#import bound_gradient
#endif
#if FUSED
#import gradient
#import viscosity
#import liquid
#endif

// A displacement within the bound that the fixed-point scale is made for.
fn bounded_displacement(u: vec3f) -> vec3f {
    if is_fast(u) {
        atomicAdd(&counters.speed_clamped, 1u);
        return slowed(u);
    }
    return u;
}

// In the other schemes, where the largest motion is known, gradients are within bounds.
fn within_bounds(d: mat3x3f) -> mat3x3f {
#if PUBLISHED
    return bounded_gradient(d).d;
#else
    return d;
#endif
}

// Units per unit of momentum.
var<private> scale: f32;

// A particle's gradient after the constraint, where that has no pass of its own.
fn constrained(ratio: f32, g: Gradient) -> mat3x3f {
    let d = mat3x3f(g.x, g.y, g.z);
#if FUSED
    let m = materials[material_of(g.material)];
    return constrain_liquid(m, ratio, take_shear(m.viscous_relaxation, d));
#else
    return d;
#endif
}

// Adds a particle at `x` (fourth lane: its volume ratio) with this displacement and gradient to the sums.
fn add_motion(sums: ptr<function, Sums>, x: vec4f, moved: vec3f, g: Gradient) {
    let u = bounded_displacement(moved);
    let d = within_bounds(constrained(x.w, g));

    let mass = g.mass;
    let unit = vec4f(vec3f(mass * scale), mass * constants.mass_scale);
    let dx = vec4f(d[0], 0.0) * unit;
    let dy = vec4f(d[1], 0.0) * unit;
    let dz = vec4f(d[2], 0.0) * unit;
    add_affine(sums, x.xyz, vec4f(u, 1.0) * unit, dx, dy, dz);
}
