// How compliant matter is. Twin: `compliances` in src/stages/seek.rs. Needs the binding constants.

// A material's compliances to pressure and to shear; the latter 0 of a liquid.
fn compliances(m: Material) -> vec2f {
    let unit = m.inverse_density * constants.seconds * constants.seconds * constants.impulse;
    let bulk = unit * m.bulk;
#if TENSORS
    let shear = unit * m.shear;
    if shear > 0.0 {
        let limit = SOLID_SHARE * constants.stiffness_limit;
        let later = weights(m).x;
        let share = min(limit * (1.0 / (bulk + (4.0 / 3.0) * shear)), 1.0);
        return vec2f(1.0 / (4.0 * later * share * bulk), 1.0 / (8.0 * later * share * shear));
    }
#endif
    return vec2f(1.0 / (4.0 * min(bulk, constants.stiffness_limit)), 0.0);
}

#if TENSORS
// Of the strains at the step's end and before its beginning, in the stress that acts. Twin: `weights` in src/stages/seek.rs.
fn weights(m: Material) -> vec2f {
    return select(vec2f(1.0, 0.0), vec2f(LATER, EARLIER), m.model == MODEL_ELASTIC);
}
#endif
