// Compensates for the part of a strain that a particle does not see. Twin: src/stages/correction.rs. Needs linear.

// The columns of v mᵀ.
fn outer_product(v: vec3f, m: vec3f) -> mat3x3f {
    return mat3x3f(v * m.x, v * m.y, v * m.z);
}

// The matrix times C − 1.
fn missed(d: mat3x3f, m: vec3f) -> mat3x3f {
    return outer_product(transform(d, m), m);
}

// The matrix times C.
fn corrected(d: mat3x3f, m: vec3f) -> mat3x3f {
    return d + missed(d, m);
}

// The m of a particle: stored in the fourth lanes of its deformation gradient.
fn kept_correction(f: Deformation) -> vec3f {
    return vec3f(f.x.w, f.y.w, f.z.w);
}

#if STICKS
// The contribution of the body's rotation to a liquid's D m, stored in the step before, which may have had another
// length.
fn turned_correction(f: Deformation) -> vec3f {
    return f.x.xyz * constants.rescale;
}
#endif
