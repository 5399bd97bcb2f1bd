// Units per unit of momentum. Twin: `momentum_scale` in src/stages/motion.rs. Needs the bindings constants and
// counters.
#if PUBLISHED
fn momentum_scale() -> f32 {
    return constants.momentum_scale;
}
#else
// From the largest motion that particles bring, by its bits, so that all that read it agree.
fn momentum_scale() -> f32 {
    let largest = max(bitcast<f32>(atomicLoad(&counters.largest_motion)), LEAST_MOTION);
    let twice_inverse = bitcast<f32>(0x7f800000u - (bitcast<u32>(largest) & 0x7f800000u));
    return constants.mass_scale * (0.125 * twice_inverse);
}
#endif
