// Gathers from the 27 nodes of a cell. Twin: `gather` in src/stages/g2p.rs. Needs kernel, and from gather_tile or
// gather_grid `Nodes` and `node_of`, which returns the node of a number.

// Along a line of three nodes: the weighted sum, and the weighted sum of the values times their distances from the
// middle.
struct Line {
    sum: vec4f,
    moment: vec4f,
}

// Sums over a plane of nine nodes, and moments about its middle.
struct Plane {
    sum: vec4f,
    x: vec4f,
    y: vec4f,
}

// The value at a particle, and its change per cell along the axes.
struct Gathered {
    sum: vec4f,
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

fn weighted(a: vec4f, b: vec4f, c: vec4f, w: vec3f) -> Line {
    let wa = a * w.x;
    let wb = b * w.y;
    let wc = c * w.z;
    return Line(wa + wb + wc, wc - wa);
}

fn plane(nodes: ptr<function, Nodes>, n: u32, wx: vec3f, wy: vec3f) -> Plane {
    let a = weighted(node_of(nodes, n), node_of(nodes, n + 1u), node_of(nodes, n + 2u), wx);
    let b = weighted(node_of(nodes, n + 3u), node_of(nodes, n + 4u), node_of(nodes, n + 5u), wx);
    let c = weighted(node_of(nodes, n + 6u), node_of(nodes, n + 7u), node_of(nodes, n + 8u), wx);
    let line = weighted(a.sum, b.sum, c.sum, wy);
    return Plane(line.sum, weighted(a.moment, b.moment, c.moment, wy).sum, line.moment);
}

fn gathered(nodes: ptr<function, Nodes>, x: vec3f) -> Gathered {
    let s = stencil(x - vec3f(base(x)));
    let wx = vec3f(s.w0.x, s.w1.x, s.w2.x);
    let wy = vec3f(s.w0.y, s.w1.y, s.w2.y);
    let wz = vec3f(s.w0.z, s.w1.z, s.w2.z);
    let a = plane(nodes, 0u, wx, wy);
    let b = plane(nodes, 9u, wx, wy);
    let c = plane(nodes, 18u, wx, wy);
    let line = weighted(a.sum, b.sum, c.sum, wz);
    // From moments about the middle node to moments about the particle.
    return Gathered(
        line.sum,
        4.0 * (weighted(a.x, b.x, c.x, wz).sum + line.sum * s.r1.x),
        4.0 * (weighted(a.y, b.y, c.y, wz).sum + line.sum * s.r1.y),
        4.0 * (line.moment + line.sum * s.r1.z),
    );
}
