// Stresses of solids as what they add to a displacement gradient. Twin: src/stages/stress.rs.

// Principal strains: fixed corotated of elastic matter, logarithmic of matter that yields.
fn principal_strain(m: Material, stretch: vec3f) -> vec3f {
#if YIELDING
    if m.model != MODEL_ELASTIC {
        return ln3(abs(stretch));
    }
#endif
    return stretch - 1.0;
}

// What the stress of a solid adds whose deformation gradient, of which all is elastic, is `f`.
fn solid_stress(m: Material, f: Deformation, unit: f32) -> mat3x3f {
    let s = svd(mat3x3f(f.x.xyz, f.y.xyz, f.z.xyz));
    let stretch = stretch_sign(s.sigma) * stretch_size(s.sigma);
    let strain = principal_strain(m, stretch);
    let trace = strain.x + strain.y + strain.z;
    let mean = trace * (1.0 / 3.0);
    var stress = (m.shear + m.shear) * (strain - mean) + m.bulk * trace;
    if m.model == MODEL_ELASTIC {
        stress = stress * stretch;
    }
    return along(s.u, -(unit * stress));
}
