// The effect of the stress of solids on displacement gradients. Twin: src/stages/stress.rs.

// The effect of a solid's stress. Its deformation gradient `f` is entirely elastic.
fn solid_stress(m: Material, f: Deformation, unit: f32) -> mat3x3f {
    let s = svd(mat3x3f(f.x.xyz, f.y.xyz, f.z.xyz));
    let strain = ln3(stretch_size(s.sigma));
    let trace = strain.x + strain.y + strain.z;
    let mean = trace * (1.0 / 3.0);
    let stress = (m.shear + m.shear) * (strain - mean) + m.bulk * trace;
    return along(s.u, -(unit * stress));
}
