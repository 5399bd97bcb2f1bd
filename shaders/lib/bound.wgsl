// The bound on displacements that the fixed-point scale is made for. Needs linear and the binding constants.

fn is_fast(u: vec3f) -> bool {
    return dot3(u, u) > constants.max_displacement * constants.max_displacement;
}

// `u`, shortened to this length if it is longer.
fn within_length(u: vec3f, bound: f32) -> vec3f {
    let square = dot3(u, u);
    if square > bound * bound {
        return u * (bound / sqrt(square));
    }
    return u;
}

// The displacement `u`, shortened to the bound if it is longer.
fn slowed(u: vec3f) -> vec3f {
    return within_length(u, constants.max_displacement);
}
