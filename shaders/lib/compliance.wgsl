// Twin: `compliance` in src/stages/seek.rs. Needs the binding constants.

// Divergence per pressure, and the share of an error in volume that a step takes back.
struct Compliance {
    value: f32,
    share: f32,
}

fn compliance(m: Material) -> Compliance {
    let stiffness = 4.0 * m.inverse_density * constants.seconds * constants.seconds * m.bulk;
    let at_rest = min(stiffness, 4.0 * constants.rest_limit);
    let value = 1.0 / min(stiffness, 4.0 * constants.stiffness_limit);
    return Compliance(value, at_rest * value);
}
