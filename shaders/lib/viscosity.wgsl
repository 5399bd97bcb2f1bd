// What viscosity takes from a displacement gradient. Twin: src/stages/viscosity.rs. Where liquids stick it needs linear, corrected and the
// binding deformation.

// Takes a share off the shear rate.
fn take_shear(share: f32, d: mat3x3f) -> mat3x3f {
    if share > 0.0 {
        let mean = (d[0][0] + d[1][1] + d[2][2]) * (1.0 / 3.0);
        let shear = share * 0.5 * (d + transpose(d));
        return (d - shear) + mat3x3f(share * mean, 0.0, 0.0, 0.0, share * mean, 0.0, 0.0, 0.0, share * mean);
    }
    return d;
}

#if STICKS
// The deviator of the symmetric part.
fn shear_of(m: mat3x3f) -> mat3x3f {
    let mean = (m[0][0] + m[1][1] + m[2][2]) * (1.0 / 3.0);
    let yz = 0.5 * (m[1][2] + m[2][1]);
    let xz = 0.5 * (m[0][2] + m[2][0]);
    let xy = 0.5 * (m[0][1] + m[1][0]);
    return mat3x3f(m[0][0] - mean, xy, xz, xy, m[1][1] - mean, yz, xz, yz, m[2][2] - mean);
}

// Takes a share off the shear rate of a liquid, with what it misses of it beside what it sticks to.
fn take_shear_beside(f: Deformation, share: f32, d: mat3x3f) -> mat3x3f {
    let m = kept_correction(f);
    if share <= 0.0 || dot3(m, m) <= 0.0 {
        return take_shear(share, d);
    }
    let shear = shear_of(d + missed_by_liquid(d, f));
    // Along the wall it counts once as it is seen and once as it acts.
    let times = times_seen(m);
    let taken = min(share, 2.0 * (1.0 / (1.0 + times * times)));
    return d - corrected(shear, m) * taken;
}
#endif

// The share that viscosity takes in a step.
fn viscous_share(m: Material) -> f32 {
    return min(8.0 * m.viscosity * m.inverse_density * constants.seconds, 1.0);
}

// What viscosity that is not solved for leaves of a particle's displacement gradient.
fn less_viscous(p: u32, m: Material, d: mat3x3f) -> mat3x3f {
#if STICKS
    if m.model == MODEL_LIQUID {
        return take_shear_beside(deformation[p], viscous_share(m), d);
    }
#endif
    return take_shear(viscous_share(m), d);
}
