// Stresses of solids as what they add to a displacement gradient. Twin: src/stages/stress.rs.

// What the stress of a solid adds whose deformation gradient, of which all is elastic, is `f`.
fn solid_stress(m: Material, f: Deformation, unit: f32) -> mat3x3f {
    let s = svd(mat3x3f(f.x.xyz, f.y.xyz, f.z.xyz));
    let strain = ln3(stretch_size(s.sigma));
    let trace = strain.x + strain.y + strain.z;
    let mean = trace * (1.0 / 3.0);
    let stress = (m.shear + m.shear) * (strain - mean) + m.bulk * trace;
    return along(s.u, -(unit * stress));
}
