// Quadratic B-spline on grid nodes. Twin: src/math/kernel.rs.

// Index of the first of the three nodes on each axis.
fn base(x: vec3f) -> vec3u {
    return vec3u(x - 0.5);
}

// Of the three nodes on each axis: weights; of the middle one: the distance from the particle. Named, not indexed: arrays that
// are indexed in a loop end up in memory on some devices.
struct Stencil {
    w0: vec3f,
    w1: vec3f,
    w2: vec3f,
    r1: vec3f,
}

// For a particle at distance `f` from the first node.
fn stencil(f: vec3f) -> Stencil {
    let a = 1.5 - f;
    let b = f - 1.0;
    let c = f - 0.5;
    return Stencil(0.5 * a * a, 0.75 - b * b, 0.5 * c * c, 1.0 - f);
}
