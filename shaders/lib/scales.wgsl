// Scales of the fixed-point sums of the implicit scheme. Twin: src/cpu/solve.rs. Needs force_scale and the bindings constants and
// solve.

// What scales of squares take numbers for at least.
const LEAST = 1e-8;

// Of squares of residuals.
fn square_scale(compliance: f32) -> f32 {
    let one = inverse(solve.bound, LEAST);
    return 0x1p31f * one * one * inverse(1.0 + compliance, LEAST);
}

// Of squares by compliance, of sums of an answer and a direction.
fn compliant_scale(compliance: f32) -> f32 {
    let one = inverse(solve.bound + solve.direction_bound, LEAST);
    return 0x1p31f * one * one * inverse(compliance, LEAST);
}

#if RESUMES
// How many directions of search there are before those made of answers: what particles bring.
const RESUMED = 1u;
#else
const RESUMED = 0u;
#endif

// Of squares of velocities along directions of search up to `bound`.
fn energy_scale(bound: f32) -> f32 {
    let one = inverse(bound, LEAST);
    return 0x1p28f * one * one;
}
