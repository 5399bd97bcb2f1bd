// Quadratic B-spline on grid nodes. Twin: src/math/kernel.rs.

// Index of the first of the three nodes on each axis.
fn base(x: vec3f) -> vec3u {
    return vec3u(x - 0.5);
}

// Weights of the three nodes on each axis for a particle at distance `f` from the first: w[node][axis].
fn weights(f: vec3f) -> array<vec3f, 3> {
    let a = 1.5 - f;
    let b = f - 1.0;
    let c = f - 0.5;
    return array<vec3f, 3>(0.5 * a * a, 0.75 - b * b, 0.5 * c * c);
}
