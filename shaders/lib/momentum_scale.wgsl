// Units per unit of momentum. Twin: `momentum_scale` in src/stages/motion.rs. Needs the bindings constants and counters.
#if PUBLISHED
fn momentum_scale() -> f32 {
    return constants.momentum_scale;
}
#else
#import power

// By the most that particles bring.
fn momentum_scale() -> f32 {
    let largest = bitcast<f32>(atomicLoad(&counters.largest_motion));
    return power(constants.mass_scale * (0.5 * (1.0 / max(largest, LEAST_MOTION))));
}
#endif
