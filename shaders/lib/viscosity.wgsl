// The effect of viscosity on a displacement gradient. Twin: src/stages/viscosity.rs. Needs linear.

// Removes a share of the shear rate.
fn take_shear(share: f32, gradient: mat3x3f) -> mat3x3f {
    var d = gradient;
    if share > 0.0 {
#if REPEATS
        // As if it had been stored: lavapipe would simplify expressions across it, and round differently.
        let most = vec3f(3e38);
        d = mat3x3f(clamp(d[0], -most, most), clamp(d[1], -most, most), clamp(d[2], -most, most));
#endif
        let mean = (d[0][0] + d[1][1] + d[2][2]) * (1.0 / 3.0);
        let shear = share * 0.5 * (d + transpose(d));
        return (d - shear) + diagonal_of(vec3f(share * mean));
    }
    return d;
}

// The share of its shear rate that an isolated particle loses in a step by viscosity that is not solved for.
fn viscous_share(m: Material) -> f32 {
    return min(8.0 * m.viscosity * m.inverse_density * constants.seconds, 1.0);
}
