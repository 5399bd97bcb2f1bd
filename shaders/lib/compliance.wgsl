// Compliance of matter in a step of the implicit scheme. Twin: src/stages/compliance.rs. Needs the binding constants.

// Factor from a modulus to the square of the cells that its sound travels in a step.
fn unit(m: Material) -> f32 {
    return m.inverse_density * constants.seconds * constants.seconds * constants.impulse;
}

#if TENSORS
// Stress per strain of a step for viscosity that is solved for.
fn viscous_stiffness(m: Material) -> f32 {
    return min(8.0 * m.solved_viscosity * m.inverse_density * constants.seconds, THICKEST);
}
#endif

// How stiff a liquid's particle is, as the square of the cells that its sound travels in a step.
fn particle_stiffness(m: Material) -> f32 {
    return min(unit(m) * m.bulk, constants.stiffness_limit);
}

// Compliances to pressure, as divergence per pressure, and to shear, as strain per stress; the latter is 0 for a liquid
// whose viscosity is not solved for. Stiffer matter counts as only as stiff as the iterations can follow.
fn compliances(m: Material) -> vec2f {
    var shear = 0.0;
#if TENSORS
    let viscous = viscous_stiffness(m);
    if viscous > 0.0 {
        shear = 1.0 / viscous;
    }
#endif
#if SOLIDS
    if m.shear > 0.0 {
        return vec2f(1.0 / (4.0 * borne(m) * (unit(m) * m.bulk)), 1.0 / (elastic_stiffness(m) + viscous));
    }
#endif
    return vec2f(1.0 / (4.0 * particle_stiffness(m)), shear);
}

#if SHARES_PRESSURE
// The compliance of a liquid's particle to a change of the volume of its whole block.
fn compliance_with_block(m: Material) -> f32 {
    return 1.0 / (4.0 * max(particle_stiffness(m), constants.block_stiffness));
}

// How much stiffer a liquid is to the mean compression of a block than to that of a particle, as pressure per
// divergence.
fn stiffness_beside(m: Material) -> f32 {
    return 4.0 * max(constants.block_stiffness - particle_stiffness(m), 0.0);
}
#endif

#if SOLIDS
// Square of the cells that sound travels through a material in a step.
fn sound_square(m: Material) -> f32 {
    return unit(m) * (m.bulk + (4.0 / 3.0) * m.shear);
}

// The share of a solid's moduli that a step accounts for, times the weight of the step's end.
fn borne(m: Material) -> f32 {
    let limit = min(SOLID_SHARE * constants.stiffness_limit, SOLID_LIMIT);
    return weights(m).x * min(limit * (1.0 / sound_square(m)), 1.0);
}

// Stress per strain for a solid's shear.
fn elastic_stiffness(m: Material) -> f32 {
    return 8.0 * borne(m) * (unit(m) * m.shear);
}

// The share of the stress from the strains of the step's beginning that remains where viscosity is solved for as well.
fn elastic_share(m: Material, compliance: f32) -> f32 {
    if m.solved_viscosity > 0.0 {
        return elastic_stiffness(m) * compliance;
    }
    return 1.0;
}

// LATER and EARLIER of a material. Stiffer matter, and matter that flows and so has no earlier strain to swing back to,
// has the stress of the step's end.
fn weights(m: Material) -> vec2f {
    return select(vec2f(1.0, 0.0), vec2f(LATER, EARLIER), m.model == MODEL_ELASTIC && sound_square(m) <= RESOLVED);
}
#endif
