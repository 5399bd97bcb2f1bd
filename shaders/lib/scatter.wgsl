// Sums what particles bring to the 27 nodes of their cell, in integers. Twin: `scatter_affine` in src/stages/p2g.rs.
// Needs kernel, and from scatter_tile or scatter_grid `Sums` and `add_to_sums`, which adds to the node of a number.

fn rounded(value: vec4f) -> vec4i {
    return vec4i(round(value));
}

// Adds to the three nodes of a row; returns the sum of all parts.
fn add_row(sums: ptr<function, Sums>, n: u32, row: vec4f, dx: vec4f, weight: f32, s: Stencil) -> vec4i {
    let a = rounded((row - dx) * (weight * s.w0.x));
    let b = rounded(row * (weight * s.w1.x));
    let c = rounded((row + dx) * (weight * s.w2.x));
    add_to_sums(sums, n, a);
    add_to_sums(sums, n + 1u, b);
    add_to_sums(sums, n + 2u, c);
    return a + b + c;
}

// Adds to the three rows of a plane; returns the sum of all parts.
fn add_plane(sums: ptr<function, Sums>, n: u32, plane: vec4f, dx: vec4f, dy: vec4f, weight: f32, s: Stencil) -> vec4i {
    return add_row(sums, n, plane - dy, dx, weight * s.w0.y, s)
        + add_row(sums, n + 3u, plane, dx, weight * s.w1.y, s)
        + add_row(sums, n + 6u, plane + dy, dx, weight * s.w2.y, s);
}

// Adds a particle's `value`, which changes by `dx`, `dy` and `dz` per cell along the axes, to the 27 nodes.
fn add_affine(sums: ptr<function, Sums>, x: vec3f, value: vec4f, dx: vec4f, dy: vec4f, dz: vec4f) {
    let s = stencil(x - vec3f(base(x)));
    let middle = value + dx * s.r1.x + dy * s.r1.y + dz * s.r1.z;
#if TILES
    // A loop: devices fetch the instructions again for each workgroup, and three times as many take longer than
    // looping.
    var total = vec4i(0);
    for (var k = 0u; k < 3u; k++) {
        let weight = select(select(s.w2.z, s.w1.z, k == 1u), s.w0.z, k == 0u);
        let plane = select(select(middle + dz, middle, k == 1u), middle - dz, k == 0u);
        var above = *sums + tile_word(vec3u(0u, 0u, k));
        total += add_plane(&above, 0u, plane, dx, dy, weight, s);
    }
#else
    let total = add_plane(sums, 0u, middle - dz, dx, dy, s.w0.z, s)
        + add_plane(sums, 9u, middle, dx, dy, s.w1.z, s)
        + add_plane(sums, 18u, middle + dz, dx, dy, s.w2.z, s);
#endif
    // The particle's whole less the sum of its rounded parts goes to the middle node: otherwise many small parts that
    // all round to nothing would slow the matter.
    add_to_sums(sums, 13u, rounded(value) - total);
}
