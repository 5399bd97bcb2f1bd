// Scales of the fixed-point sums of the implicit scheme. Twin: src/cpu/solve.rs. Needs force_scale and the bindings
// constants and solve.

// The least that scales of squares count a number as.
const LEAST = 1e-8;

// Scale of squares of residuals.
fn square_scale(compliance: f32) -> f32 {
    let one = inverse(solve.bound, LEAST);
    return 0x1p31f * one * one * inverse(1.0 + compliance, LEAST);
}

// Scale of squares weighted by compliance, of sums of an answer and a direction.
fn compliant_scale(compliance: f32) -> f32 {
    let one = inverse(solve.bound + solve.direction_bound, LEAST);
    return 0x1p31f * one * one * inverse(compliance, LEAST);
}

#if RESUMES
// Number of directions of search before those made of answers: the stress that particles carry over.
const RESUMED = 1u;
#else
const RESUMED = 0u;
#endif

// Scale of squares of velocities along directions of search up to `bound`.
fn energy_scale(bound: f32) -> f32 {
    let one = inverse(bound, LEAST);
    return 0x1p28f * one * one;
}
