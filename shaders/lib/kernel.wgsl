// Quadratic B-spline on grid nodes. Twin: src/math/kernel.rs.

// The share of a node's kernel that lies before a plane at a distance of 0 to KERNEL_REACH from it. Constants are the
// innermost factors: lavapipe moves those farther out there, which changes the rounding.
fn share_before(d: f32) -> f32 {
    let rest = KERNEL_REACH - d;
    let far = 1.0 - rest * (rest * (rest * (1.0 / 6.0)));
    return select(share_near(d), far, d > 0.5);
}

// The same up to half a cell.
fn share_near(d: f32) -> f32 {
    return 0.5 + d * (0.75 - d * (d * (1.0 / 3.0)));
}

// Index of the first of the three nodes on each axis.
fn base(x: vec3f) -> vec3u {
    return vec3u(x - 0.5);
}

// The three nodes on each axis: their weights, and the distance from the particle to the middle one. Named, not
// indexed: some devices keep arrays that are indexed in a loop in memory.
struct Stencil {
    w0: vec3f,
    w1: vec3f,
    w2: vec3f,
    r1: vec3f,
}

// For a particle at distance `f` from the first node.
fn stencil(f: vec3f) -> Stencil {
    let a = KERNEL_REACH - f;
    let b = f - 1.0;
    let c = f - 0.5;
    return Stencil(0.5 * a * a, 0.75 - b * b, 0.5 * c * c, 1.0 - f);
}
