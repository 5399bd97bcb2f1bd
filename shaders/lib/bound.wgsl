// The bound on displacements that the fixed-point scale is made for. Twin: `slowed` in src/stages/grid_update.rs.
// Needs linear and the binding constants.

fn is_fast(u: vec3f) -> bool {
    return dot3(u, u) > constants.max_displacement * constants.max_displacement;
}

// The displacement `u`, shortened to the bound if it is longer.
fn slowed(u: vec3f) -> vec3f {
    if is_fast(u) {
        return u * (constants.max_displacement / sqrt(dot3(u, u)));
    }
    return u;
}
