// How evenly matter lies around a particle: the mass of the emptiest of its 27 nodes over that of the fullest. Twin:
// src/stages/even.rs. Needs the binding constants, and `cell_row`, which returns what three nodes in a row along x
// hold, by the number of the first among the cell's 27.

// More than any node holds.
const LARGE = 3e38;

// By axis, whether a node lies neither on a wall of the domain nor behind one.
fn inside(node: vec3f) -> vec3<bool> {
    let open = (vec3u(constants.open_sides) >> vec3u(0u, 2u, 4u)) & vec3u(3u);
    let above = ((open & vec3u(1u)) != vec3u(0u)) | (node - constants.lo >= vec3f(0.5));
    let below = ((open & vec3u(2u)) != vec3u(0u)) | (constants.hi - node >= vec3f(0.5));
    return above & below;
}

// The least and the largest of those of three numbers that count.
fn least(held: vec3f, counts: vec3<bool>) -> f32 {
    let v = select(vec3f(LARGE), held, counts);
    return min(min(v.x, v.y), v.z);
}

fn largest(held: vec3f, counts: vec3<bool>) -> f32 {
    let v = select(vec3f(0.0), held, counts);
    return max(max(v.x, v.y), v.z);
}

// The same for a plane of nine nodes, the first of which has the number `n` in the cell.
fn extremes(cell: ptr<function, CellNodes>, n: u32, x: vec3<bool>, y: vec3<bool>) -> vec2f {
    let a = cell_row(cell, n);
    let b = cell_row(cell, n + 3u);
    let c = cell_row(cell, n + 6u);
    return vec2f(
        least(vec3f(least(a, x), least(b, x), least(c, x)), y),
        largest(vec3f(largest(a, x), largest(b, x), largest(c, x)), y),
    );
}

// The least and the largest of what the nodes of a cell hold. Its first node is `node`.
fn cell_extremes(cell: ptr<function, CellNodes>, node: vec3f) -> vec2f {
    let a = inside(node);
    let b = inside(node + 1.0);
    let c = inside(node + 2.0);
    // Only nodes inside count; along an axis without any, all do.
    let none = !(a | b | c);
    let x = vec3<bool>(a.x, b.x, c.x) | vec3<bool>(none.x);
    let y = vec3<bool>(a.y, b.y, c.y) | vec3<bool>(none.y);
    let z = vec3<bool>(a.z, b.z, c.z) | vec3<bool>(none.z);
    let first = extremes(cell, 0u, x, y);
    let second = extremes(cell, 9u, x, y);
    let third = extremes(cell, 18u, x, y);
    return vec2f(
        least(vec3f(first.x, second.x, third.x), z),
        largest(vec3f(first.y, second.y, third.y), z),
    );
}

// Whether matter with these extremes lies evenly, from this share on.
fn is_even(e: vec2f, share: f32) -> bool {
    return e.x >= e.y * share;
}

// How evenly matter lies, from 0 to 1.
fn evenness(e: vec2f) -> f32 {
    return e.x * (1.0 / max(e.y, NOTHING));
}
