// Twin: `take_shear` in src/stages/constraint.rs.

// Takes a share off the shear rate, leaving spin and divergence alone.
fn take_shear(share: f32, d: mat3x3f) -> mat3x3f {
    let mean = (d[0][0] + d[1][1] + d[2][2]) * (1.0 / 3.0);
    let shear = share * 0.5 * (d + transpose(d));
    return (d - shear) + mat3x3f(share * mean, 0.0, 0.0, 0.0, share * mean, 0.0, 0.0, 0.0, share * mean);
}
