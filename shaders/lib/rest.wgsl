// How long particles have been at rest. Twin: src/stages/bin_sleep.rs. Needs linear and the binding constants.

// How long a particle has been at rest by now, in µs, up to the time that sleep needs. A particle whose fraction is
// still 0 has just appeared and has not been measured on the grid.
fn rested(before: u32, u: vec4f) -> u32 {
    if dot3(u.xyz, u.xyz) > constants.rest_square || u.w == 0.0 {
        return 0u;
    }
    return min((before & ~ASLEEP) + constants.rest_lasted, constants.rest_needed);
}
