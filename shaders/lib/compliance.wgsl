// Divergence per pressure. Twin: `compliance` in src/stages/seek.rs. Needs the binding constants.
fn compliance(m: Material) -> f32 {
    let stiffness = m.inverse_density * constants.seconds * constants.seconds * m.bulk * constants.impulse;
    return 1.0 / (4.0 * min(stiffness, constants.stiffness_limit));
}
