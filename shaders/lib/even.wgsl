// How evenly matter lies around a particle: the mass of the emptiest of its 27 nodes over that of the fullest, and the
// difference between opposite sides. Twin: src/stages/even.rs. Needs the binding constants, and `cell_row`, which
// returns what three nodes in a row along x hold, by the number of the first among the cell's 27.

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

// By axis, which of a cell's nodes count: those inside, and along an axis without any, all.
struct Counting {
    x: vec3<bool>,
    y: vec3<bool>,
    z: vec3<bool>,
}

// The same for the cell whose first node is `node`.
fn counting(node: vec3f) -> Counting {
    let a = inside(node);
    let b = inside(node + 1.0);
    let c = inside(node + 2.0);
    let none = !(a | b | c);
    return Counting(
        vec3<bool>(a.x, b.x, c.x) | vec3<bool>(none.x),
        vec3<bool>(a.y, b.y, c.y) | vec3<bool>(none.y),
        vec3<bool>(a.z, b.z, c.z) | vec3<bool>(none.z),
    );
}

// The least and the largest of what the nodes of a cell hold.
fn cell_extremes(cell: ptr<function, CellNodes>, counts: Counting) -> vec2f {
    let first = extremes(cell, 0u, counts.x, counts.y);
    let second = extremes(cell, 9u, counts.x, counts.y);
    let third = extremes(cell, 18u, counts.x, counts.y);
    return vec2f(
        least(vec3f(first.x, second.x, third.x), counts.z),
        largest(vec3f(first.y, second.y, third.y), counts.z),
    );
}

// The middle one of three rows, or, where it does not count, one that does; the same of the numbers in a row.
fn middle_row(a: vec3f, b: vec3f, c: vec3f, counts: vec3<bool>) -> vec3f {
    return select(select(c, a, counts.x), b, counts.y);
}

fn middle(held: vec3f, counts: vec3<bool>) -> f32 {
    return select(select(held.z, held.x, counts.x), held.y, counts.y);
}

// The difference between the outer ones; where one does not count, the next one that does takes its place.
fn across(held: vec3f, counts: vec3<bool>) -> f32 {
    let first = select(select(held.z, held.y, counts.y), held.x, counts.x);
    let last = select(select(held.x, held.y, counts.y), held.z, counts.z);
    return abs(last - first);
}

// The middle one of three rows of a cell, the first of which has the number `n` and the others the next by `stride`.
fn middle_of(cell: ptr<function, CellNodes>, n: u32, stride: u32, counts: vec3<bool>) -> vec3f {
    return middle_row(cell_row(cell, n), cell_row(cell, n + stride), cell_row(cell, n + 2u * stride), counts);
}

// The largest difference, along the axes, between what the outer nodes before and behind a cell's middle one hold.
fn cell_difference(cell: ptr<function, CellNodes>, counts: Counting) -> f32 {
    // In the middle plane across z.
    let a = middle_of(cell, 0u, 9u, counts.z);
    let b = middle_of(cell, 3u, 9u, counts.z);
    let c = middle_of(cell, 6u, 9u, counts.z);
    let x = middle_row(a, b, c, counts.y);
    let y = vec3f(middle(a, counts.x), middle(b, counts.x), middle(c, counts.x));
    let z = vec3f(
        middle(middle_of(cell, 0u, 3u, counts.y), counts.x),
        middle(middle_of(cell, 9u, 3u, counts.y), counts.x),
        middle(middle_of(cell, 18u, 3u, counts.y), counts.x),
    );
    return max(max(across(x, counts.x), across(y, counts.y)), across(z, counts.z));
}

// Whether matter with these extremes lies evenly, from this share on.
fn is_even(e: vec2f, share: f32) -> bool {
    return e.x >= e.y * share;
}

// Whether matter with these extremes lies loosely, where `lacking` is the deficit and opposite sides differ by
// `difference`, both as volume fractions.
fn is_loose(e: vec2f, difference: f32, lacking: f32) -> bool {
    return is_even(e, SOME) && difference <= lacking * ONE_SIDED;
}

// How evenly matter lies, from 0 to 1; −1 where it is sparse.
fn evenness(e: vec2f) -> f32 {
    if e.y < constants.lightest * SPARSE {
        return -1.0;
    }
    return e.x * (1.0 / max(e.y, NOTHING));
}
