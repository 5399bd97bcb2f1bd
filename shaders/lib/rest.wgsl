// How long particles have been at rest. Twin: src/stages/bin_sleep.rs. Needs linear and the binding constants.

// By now, µs, up to what sleep needs. One that has not been measured on the grid has just appeared.
fn rested(before: u32, u: vec4f) -> u32 {
    if dot3(u.xyz, u.xyz) > constants.rest_square || u.w == 0.0 {
        return 0u;
    }
    return min(before + constants.rest_lasted, constants.rest_needed);
}
