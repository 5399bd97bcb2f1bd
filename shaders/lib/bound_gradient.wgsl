// Bounds displacement gradients to what the fixed-point scale is made for. Twin: `bound_gradient` in
// src/stages/motion.rs. Needs linear and the bindings constants and counters.

struct BoundedGradient {
    d: mat3x3f,
    square: f32, // of its norm
}

fn bounded_gradient(d: mat3x3f) -> BoundedGradient {
    let norm = dot3(d[0], d[0]) + dot3(d[1], d[1]) + dot3(d[2], d[2]);
    let bound = constants.max_gradient;
    if norm > bound * bound {
        atomicAdd(&counters.gradient_clamped, 1u);
        return BoundedGradient(d * (bound / sqrt(norm)), bound * bound);
    }
    return BoundedGradient(d, norm);
}
