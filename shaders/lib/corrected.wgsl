// What makes up for what particles beside clamps see too little of strains. Twin: `missed` and `corrected` in src/stages/correction.rs.
// Needs linear.

// Times C − 1.
fn missed(d: mat3x3f, m: vec3f) -> mat3x3f {
    let along = transform(d, m);
    return mat3x3f(along * m.x, along * m.y, along * m.z);
}

// Times C.
fn corrected(d: mat3x3f, m: vec3f) -> mat3x3f {
    return d + missed(d, m);
}
