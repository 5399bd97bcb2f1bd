// Which measures of volume a particle believes. Twin: src/stages/believed.rs.

// The volume fraction measured at a particle, of opposite sign where it is too little and believed nevertheless.
fn believed(fraction: f32, ratio: f32, even: bool) -> f32 {
    return select(fraction, -fraction, fraction * ratio < 1.0 - SHORTFALL && even);
}
