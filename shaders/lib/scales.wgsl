// Scales of the fixed-point sums of the implicit scheme. Twin: src/cpu/solve.rs. Needs the binding constants.

// Largest power of two not above `x`.
fn power(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(max(x, 0x1p-126f)) & 0x7f800000u);
}

// Of the momentum: that of the world, or what the pressures that are brought along leave.
fn momentum_scale(pressure: f32) -> f32 {
    if pressure <= 0.0 {
        return constants.momentum_scale;
    }
    let speed = constants.max_displacement + 2.6 * (constants.max_gradient + 1.74 * pressure);
    return power(constants.mass_scale * (0.5 * (1.0 / speed)));
}

// Of what pressures up to `bound` add to the nodes.
fn force_scale(bound: f32) -> f32 {
    return power(constants.mass_scale * (0.25 * (1.0 / max(bound, 1e-12))));
}

// Of the pressures that are brought along, summed by mass.
fn pressure_scale(pressure: f32) -> f32 {
    return power(constants.mass_scale * (0.5 * (1.0 / max(pressure, 1e-12))));
}

// Of squares of residuals.
fn square_scale(bound: f32) -> f32 {
    let one = power(1.0 / max(bound, 1e-12));
    return 0x1p31f * one * one;
}

// Of squares of velocities.
fn energy_scale(bound: f32) -> f32 {
    let one = power(1.0 / max(bound, 1e-12));
    return 0x1p24f * one * one;
}
