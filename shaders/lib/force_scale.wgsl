// The scale of the fixed-point sums of what stresses add to the nodes, and what this and other scales are made of.
// Twin: src/cpu/solve.rs. Needs the binding constants.

// Largest power of two not above the inverse of `x`, computed from the bits, so that all callers agree: devices may
// divide with an error, which could give the next power in one pipeline and not in another where the inverse is a power
// of two.
fn inverse(x: f32, least: f32) -> f32 {
    let bounded = min(max(x, least), 0x1p126);
    return bitcast<f32>((0x7f000000u - bitcast<u32>(bounded)) & 0x7f800000u);
}

// Scale of what stresses up to `bound` add to the nodes.
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
    return constants.mass_scale * MOST * inverse(bound, LEAST_BOUND);
}

// The value of a sum in two words, the lower first, before scaling. By parts of 16 bits, which are exact: devices
// differ in how they convert whole words from 2^31 on. Twin: `of_whole` in src/math/real.rs.
fn unscaled(low: u32, high: u32) -> f32 {
    let upper = f32(high >> 16u) * 65536.0 + f32(high & 0xffffu);
    return (upper * 65536.0 + f32(low >> 16u)) * 65536.0 + f32(low & 0xffffu);
}
