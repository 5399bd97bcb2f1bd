// What makes up for what particles see too little of strains. Twins: functions of the same names in src/stages/correction.rs.
// Needs linear.

// What makes m mᵀ of this square of m C − 1.
fn correction_weight(square: f32) -> f32 {
    return select((TOO_MUCH - square) * (1.0 / square), 1.0, square < NOT_ALL);
}

// By how many times more than seen a strain along the normal is.
fn times_seen(m: vec3f) -> f32 {
    let square = dot3(m, m);
    return 1.0 + correction_weight(square) * square;
}

// v mᵀ by the weight of m.
fn weighted_outer(v: vec3f, m: vec3f) -> mat3x3f {
    let w = m * correction_weight(dot3(m, m));
    return mat3x3f(v * w.x, v * w.y, v * w.z);
}

// Times C − 1.
fn missed(d: mat3x3f, m: vec3f) -> mat3x3f {
    return weighted_outer(transform(d, m), m);
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

// What a liquid misses of the gradient `d`: (D m − what the body's turning brings) mᵀ.
fn missed_by_liquid(d: mat3x3f, f: Deformation) -> mat3x3f {
    let m = kept_correction(f);
    return weighted_outer(transform(d, m) - turned_correction(f), m);
}
#endif
