// Sums what the particles of a cell bring to its 27 nodes, in integers. Twin: `scatter_affine` in src/stages/p2g.rs. Needs kernel.

// What the particles of one cell bring to its 27 nodes.
alias Sums = array<vec4i, 27>;

fn rounded(value: vec4f) -> vec4i {
    return vec4i(round(value));
}

// The three nodes of a row; gives what was added.
fn add_row(sums: ptr<function, Sums>, n: u32, row: vec4f, dx: vec4f, weight: f32, s: Stencil) -> vec4i {
    let a = rounded((row - dx) * (weight * s.w0.x));
    let b = rounded(row * (weight * s.w1.x));
    let c = rounded((row + dx) * (weight * s.w2.x));
    (*sums)[n] += a;
    (*sums)[n + 1u] += b;
    (*sums)[n + 2u] += c;
    return a + b + c;
}

// The three rows of a plane; gives what was added.
fn add_plane(sums: ptr<function, Sums>, n: u32, plane: vec4f, dx: vec4f, dy: vec4f, weight: f32, s: Stencil) -> vec4i {
    return add_row(sums, n, plane - dy, dx, weight * s.w0.y, s)
        + add_row(sums, n + 3u, plane, dx, weight * s.w1.y, s)
        + add_row(sums, n + 6u, plane + dy, dx, weight * s.w2.y, s);
}

// Adds the `value` of a particle at `x`, which changes by `dx`, `dy`, `dz` per cell along the axes.
fn add_affine(sums: ptr<function, Sums>, x: vec3f, value: vec4f, dx: vec4f, dy: vec4f, dz: vec4f) {
    let s = stencil(x - vec3f(base(x)));
    let middle = value + dx * s.r1.x + dy * s.r1.y + dz * s.r1.z;
    let total = add_plane(sums, 0u, middle - dz, dx, dy, s.w0.z, s)
        + add_plane(sums, 9u, middle, dx, dy, s.w1.z, s)
        + add_plane(sums, 18u, middle + dz, dx, dy, s.w2.z, s);
    // What rounding node by node took from the particle's whole goes to the middle node: many small parts that all round
    // to nothing would otherwise slow it.
    (*sums)[13] += rounded(value) - total;
}
