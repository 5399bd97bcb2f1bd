// What a gradient holds as the material of its particle. Twin: src/cpu/gradient.rs.

// Its index.
fn material_of(stored: f32) -> u32 {
    return u32(stored);
}

// What is noted beside that index: the faces that the particle lies before (see faces.wgsl).
fn beside_of(stored: f32) -> f32 {
    return stored - floor(stored);
}

// The same index with this beside it.
fn with_beside(stored: f32, beside: f32) -> f32 {
    return floor(stored) + beside;
}
