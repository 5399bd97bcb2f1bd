// Scales of the fixed-point sums of the implicit scheme. Twin: src/cpu/solve.rs. Needs the bindings constants and solve.

// Largest power of two not above `x`.
fn power(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(max(x, 0x1p-126f)) & 0x7f800000u);
}

// Of what pressures up to `bound` add to the nodes.
fn force_scale(bound: f32) -> f32 {
#if SCALARS
    const SHARE = 0.25;
#endif
#if TENSORS
    const SHARE = 0.125;
#endif
#if CORRECTS_STRESS
    const MOST = LEAST_SEEN * SHARE;
#else
    const MOST = SHARE;
#endif
    return power(constants.mass_scale * (MOST * (1.0 / max(bound, 1e-12))));
}

// About the inverse of `x`, a power of two.
fn inverse(x: f32) -> f32 {
    return power(1.0 / max(x, 1e-8));
}

// A sum of two words, the lower first, before scaling: by halves of words, which are exact, since devices convert whole words
// differently from 2^31 on. Twin: `of_whole` in src/math/real.rs.
fn unscaled(low: u32, high: u32) -> f32 {
    let upper = f32(high >> 16u) * 65536.0 + f32(high & 0xffffu);
    return (upper * 65536.0 + f32(low >> 16u)) * 65536.0 + f32(low & 0xffffu);
}

// Of squares of residuals.
fn square_scale(compliance: f32) -> f32 {
    let one = inverse(solve.bound);
    return 0x1p31f * one * one * inverse(1.0 + compliance);
}

// Of squares by compliance, of sums of an answer and a direction.
fn compliant_scale(compliance: f32) -> f32 {
    let one = inverse(solve.bound + solve.direction_bound);
    return 0x1p31f * one * one * inverse(compliance);
}

#if RESUMES
// How many directions of search there are before those made of answers: what particles bring.
const RESUMED = 1u;
#else
const RESUMED = 0u;
#endif

// Share of the last direction of search in the next: none in the first, nor where an answer was cut, since it is not what that
// direction is made for, nor in the first after what particles have brought, which is none of the answers.
fn mixing(square: f32, answer: f32) -> f32 {
    if solve.count > RESUMED && answer <= solve.bound {
        return square * (1.0 / solve.last_square);
    }
    return 0.0;
}

// A bound for the next directions of search.
fn ahead(mix: f32, answer: f32, direction: f32) -> f32 {
    return min(answer, solve.bound) + mix * direction;
}

// Of squares of velocities along directions of search up to `bound`.
fn energy_scale(bound: f32) -> f32 {
    let one = inverse(bound);
    return 0x1p28f * one * one;
}
