// Scales of the fixed-point sums of the implicit scheme. Twin: src/cpu/solve.rs. Needs force_scale and the bindings
// constants and solve.

// Scale of squares of residuals.
fn square_scale(compliance: f32) -> f32 {
    let one = inverse(solve.bound, LEAST_COUNTED);
    return PRECISION * one * one * inverse(1.0 + compliance, LEAST_COUNTED);
}

// Scale of squares weighted by compliance, of sums of an answer and a direction.
fn compliant_scale(compliance: f32) -> f32 {
    let one = inverse(solve.bound + solve.direction_bound, LEAST_COUNTED);
    return PRECISION * one * one * inverse(compliance, LEAST_COUNTED);
}

#if RESUMES
// Number of directions of search before those made of answers: the stress that particles carry over.
const RESUMED = 1u;
#else
const RESUMED = 0u;
#endif

// Scale of squares of velocities along directions of search up to `bound`.
fn energy_scale(bound: f32) -> f32 {
    let one = inverse(bound, LEAST_COUNTED);
    return 0.125 * PRECISION * one * one;
}
