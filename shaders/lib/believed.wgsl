// Which measures of volume a particle believes. Twin: src/stages/believed.rs. Needs the binding constants, and
// `cell_row`, which gives the volumes of three nodes in a row along x, by the number of the first among the 27 of the cell.

// Above every volume.
const LARGE = 3e38;

// Whether nodes lie neither on walls nor behind them.
fn inside(node: vec3f) -> vec3<bool> {
    let open = (vec3u(constants.open_sides) >> vec3u(0u, 2u, 4u)) & vec3u(3u);
    let above = ((open & vec3u(1u)) != vec3u(0u)) | (node - constants.lo >= vec3f(0.5));
    let below = ((open & vec3u(2u)) != vec3u(0u)) | (constants.hi - node >= vec3f(0.5));
    return above & below;
}

// The least and the largest of those of three that count.
fn least(volumes: vec3f, counts: vec3<bool>) -> f32 {
    let v = select(vec3f(LARGE), volumes, counts);
    return min(min(v.x, v.y), v.z);
}

fn largest(volumes: vec3f, counts: vec3<bool>) -> f32 {
    let v = select(vec3f(0.0), volumes, counts);
    return max(max(v.x, v.y), v.z);
}

// The same of a plane of nine, the first of which is that number of the cell's nodes.
fn extremes(cell: ptr<function, CellNodes>, n: u32, x: vec3<bool>, y: vec3<bool>) -> vec2f {
    let a = cell_row(cell, n);
    let b = cell_row(cell, n + 3u);
    let c = cell_row(cell, n + 6u);
    return vec2f(
        least(vec3f(least(a, x), least(b, x), least(c, x)), y),
        largest(vec3f(largest(a, x), largest(b, x), largest(c, x)), y),
    );
}

// Whether the nodes of the cell whose first node this is measure about the same: its particles are deep inside matter.
fn is_even(cell: ptr<function, CellNodes>, node: vec3f) -> bool {
    let a = inside(node);
    let b = inside(node + 1.0);
    let c = inside(node + 2.0);
    // Those inside count; all where there are none.
    let none = !(a | b | c);
    let x = vec3<bool>(a.x, b.x, c.x) | vec3<bool>(none.x);
    let y = vec3<bool>(a.y, b.y, c.y) | vec3<bool>(none.y);
    let z = vec3<bool>(a.z, b.z, c.z) | vec3<bool>(none.z);
    let first = extremes(cell, 0u, x, y);
    let second = extremes(cell, 9u, x, y);
    let third = extremes(cell, 18u, x, y);
    let most = largest(vec3f(first.y, second.y, third.y), z);
    return least(vec3f(first.x, second.x, third.x), z) >= most * EVEN;
}

// The volume fraction measured at a particle, of opposite sign where it is too little and believed nevertheless.
fn believed(fraction: f32, ratio: f32, even: bool) -> f32 {
    return select(fraction, -fraction, fraction * ratio < 1.0 - SHORTFALL && even);
}
