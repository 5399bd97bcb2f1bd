// Which measures of volume a particle believes. Twin: src/stages/believed.rs.

// The volume fraction measured at a particle, of opposite sign where it is too little and believed nevertheless.
fn believed(fraction: f32, ratio: f32, even: bool) -> f32 {
    return select(fraction, -fraction, fraction * ratio < 1.0 - SHORTFALL && even);
}

#if MIXES
// The same where there are solids: less BESIDE_SOLIDS where they are the reason.
fn believed_beside(fraction: f32, ratio: f32, even: bool, beside: bool) -> f32 {
    let plain = believed(fraction, ratio, even);
    return select(plain, -(fraction + BESIDE_SOLIDS), fraction * ratio < 1.0 - SHORTFALL && beside);
}
#endif
