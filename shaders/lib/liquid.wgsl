// A liquid's constraint. Twin: `liquid` in src/stages/constraint.rs. Needs linear and the binding constants.

fn constrain_liquid(m: Material, ratio: f32, d: mat3x3f) -> mat3x3f {
    let trace = d[0][0] + d[1][1] + d[2][2];
    var error = 1.0 / ratio - 1.0 - trace;
    if ratio > constants.tension_limit {
        error = max(error, 0.0);
    }
    return d + diagonal_of(vec3f(m.gain * error));
}
