// Which measured densities a particle believes (accepts, so that they change its volume ratio J). Twin:
// src/stages/believed.rs.

// The volume `fraction` measured at a particle, negated if it is a deficit that is believed: where matter lies evenly,
// or, less LOOSE, loosely for what it lacks.
fn believed(fraction: f32, ratio: f32, even: bool, loose: bool) -> f32 {
    let found = select(select(fraction, -(fraction + LOOSE), loose), -fraction, even);
    return select(fraction, found, is_too_little(fraction, ratio));
}

fn is_too_little(fraction: f32, ratio: f32) -> bool {
    return fraction * ratio < 1.0 - SHORTFALL;
}

#if MIXES
// As `believed` in worlds with solids: BESIDE_SOLIDS is subtracted as well where they are the reason.
fn believed_beside(fraction: f32, ratio: f32, even: bool, loose: bool, beside: bool) -> f32 {
    let plain = believed(fraction, ratio, even, loose);
    return select(plain, -(fraction + BESIDE_SOLIDS), is_too_little(fraction, ratio) && beside);
}
#endif
