// What particles see too little of strains, solids beside clamps and liquids beside what they stick to. Twin: src/stages/correction.rs.
// Needs linear, kernel, sdf and contact.

// What makes up for it: zero where all is seen; and what the turning of the body brings to D m in a step.
struct Correction {
    m: vec3f,
    turned: vec3f,
}

// Whether a body holds what is inside.
fn holds_inside(c: u32) -> bool {
    let kind = colliders[c].kind;
    return (kind & INVERTED) == 0u && kind != SHAPE_GRID && colliders[c].friction >= FIXED;
}

// Whether it does so and does not turn.
fn is_clamp(c: u32) -> bool {
    let turn = colliders[c].turn;
    return holds_inside(c) && turn[0].y == 0.0 && turn[0].z == 0.0 && turn[1].z == 0.0;
}

// Up to which distance the body holds nodes, and whether it holds one of those that were looked at.
var<private> held_up_to: f32;
var<private> holds_a_node: bool;

// What a row of three nodes adds to what a particle at `x` sees.
fn seen_in_row(c: u32, x: vec3f, at: Surface, first: vec3f, weights: vec3f) -> f32 {
    var parts: vec3f;
    for (var i = 0u; i < 3u; i++) {
        let node = first + vec3f(f32(i), 0.0, 0.0);
        let along = dot3(node - x, at.normal);
        let distance = surface_after(c, node).distance;
        holds_a_node |= distance <= held_up_to;
        parts[i] = select(0.0, distance, along + at.distance > 0.0 && distance > held_up_to) * along;
    }
    return parts.x * weights.x + parts.y * weights.y + parts.z * weights.z;
}

// The share of a strain along the normal that a particle sees to which the body is `at`: that of the strain of matter whose motion is the
// distance from the body, zero at and behind the nodes that it holds. All where none of its nodes is held.
fn seen(c: u32, x: vec3f, at: Surface) -> f32 {
    holds_a_node = false;
    held_up_to = select(STUCK, 0.0, holds_inside(c));
    let first = vec3f(base(x));
    let s = stencil(x - first);
    let wx = vec3f(s.w0.x, s.w1.x, s.w2.x);
    let wy = vec3f(s.w0.y, s.w1.y, s.w2.y);
    let wz = vec3f(s.w0.z, s.w1.z, s.w2.z);
    var sum = 0.0;
    for (var n = 0u; n < 9u; n++) {
        let j = n % 3u;
        let k = n / 3u;
        sum += (wz[k] * wy[j]) * seen_in_row(c, x, at, first + vec3f(0.0, f32(j), f32(k)), wx);
    }
    return select(1.0, 4.0 * sum, holds_a_node);
}

// Of a particle at `x`: none inside a body. Solids are beside clamps that do not turn, liquids beside all they stick to.
fn correction(block: u32, x: vec3f, liquid: bool) -> Correction {
    let none = Correction(vec3f(0.0), vec3f(0.0));
    var body = 0u;
    let sight = select(SIGHT, SIGHT + STUCK, liquid);
    var nearest = Surface(vec3f(0.0), sight);
    var reach = reach_from(block, 0u);
    while reach.bits != 0u {
        let c = first_in(reach);
        if (liquid && colliders[c].friction >= STICKING) || (!liquid && is_clamp(c)) {
            let at = surface_after(c, x);
            if at.distance < 0.0 {
                return none;
            }
            if at.distance < nearest.distance {
                body = c;
                nearest = at;
            }
        }
        reach = without_first(block, reach);
    }
    if nearest.distance >= sight {
        return none;
    }
    let share = seen(body, x, nearest);
    if share == 1.0 || (share > 1.0 && !liquid) {
        return none;
    }
    let too_little = 1.0 / max(share, LEAST_SEEN) - 1.0;
    let too_much = TOO_MUCH + (1.0 - 1.0 / min(share, MOST_SEEN));
    let m = nearest.normal * sqrt(select(too_much, too_little, share < 1.0));
    return Correction(m, transform(colliders[body].turn, m));
}
