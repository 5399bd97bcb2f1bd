// What makes up for what particles see too little of strains. Twins: functions of the same names in src/stages/correction.rs.
// Needs linear.

// v mᵀ.
fn outer_product(v: vec3f, m: vec3f) -> mat3x3f {
    return mat3x3f(v * m.x, v * m.y, v * m.z);
}

// Times C − 1.
fn missed(d: mat3x3f, m: vec3f) -> mat3x3f {
    return outer_product(transform(d, m), m);
}

// Times C.
fn corrected(d: mat3x3f, m: vec3f) -> mat3x3f {
    return d + missed(d, m);
}

// Where a particle keeps its m.
fn kept_correction(f: Deformation) -> vec3f {
    return vec3f(f.x.w, f.y.w, f.z.w);
}

#if STICKS
// What the body's turning brings to a liquid's D m, noted in the step before, which may have been of another length.
fn turned_correction(f: Deformation) -> vec3f {
    return f.x.xyz * constants.rescale;
}
#endif
