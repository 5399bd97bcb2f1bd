// Whether a particle's state is made of finite numbers, or why there is none. Twin: src/stages/sound.rs.

// By the bits: a compiler may assume that floats are finite.
fn finite(v: vec4f) -> bool {
    let exponent = vec4u(0x7f800000u);
    return all((bitcast<vec4u>(v) & exponent) != exponent);
}

// Whether the fourth lane of a position tells why there is no particle, rather than being a volume ratio.
fn is_fate(ratio: f32) -> bool {
    return ratio == VACANT || ratio == ESCAPED || ratio == QUARANTINED || ratio == DRAINED;
}

fn sound(x: vec4f, u: vec4f, d: Gradient) -> bool {
    return finite(x) && finite(u) && finite(vec4f(d.x, d.mass)) && finite(vec4f(d.y, d.material)) && finite(vec4f(d.z, d.pressure));
}
