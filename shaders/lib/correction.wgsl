// What particles beside clamps see too little of strains. Twin: src/stages/correction.rs. Needs linear, kernel, sdf and contact.

// Whether a body holds what is inside, and does not turn.
fn is_clamp(c: u32) -> bool {
    let kind = colliders[c].kind;
    if (kind & INVERTED) != 0u || kind == SHAPE_GRID {
        return false;
    }
    let turn = colliders[c].turn;
    return colliders[c].friction >= FIXED && turn[0].y == 0.0 && turn[0].z == 0.0 && turn[1].z == 0.0;
}

// Whether the clamp holds one of the nodes that were looked at.
var<private> holds_a_node: bool;

// What a row of three nodes adds to what a particle at `x` sees.
fn seen_in_row(c: u32, x: vec3f, at: Surface, first: vec3f, weights: vec3f) -> f32 {
    var parts: vec3f;
    for (var i = 0u; i < 3u; i++) {
        let node = first + vec3f(f32(i), 0.0, 0.0);
        let along = dot3(node - x, at.normal);
        let distance = surface_after(c, node).distance;
        holds_a_node |= distance <= 0.0;
        parts[i] = select(0.0, distance, along + at.distance > 0.0 && distance > 0.0) * along;
    }
    return parts.x * weights.x + parts.y * weights.y + parts.z * weights.z;
}

// The share of a strain along the normal that a particle sees to which the clamp is `at`: that of the strain of matter whose motion is the
// distance from the clamp, zero inside and behind it, as the nodes have it. All where none of its nodes is held.
fn seen(c: u32, x: vec3f, at: Surface) -> f32 {
    holds_a_node = false;
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

// The m of a particle at `x`: zero where it sees all, inside a clamp, and beside one that turns.
fn correction(block: u32, x: vec3f) -> vec3f {
    var body = 0u;
    var nearest = Surface(vec3f(0.0), SIGHT);
    var reach = reach_from(block, 0u);
    while reach.bits != 0u {
        let c = first_in(reach);
        if is_clamp(c) {
            let at = surface_after(c, x);
            if at.distance < 0.0 {
                return vec3f(0.0);
            }
            if at.distance < nearest.distance {
                body = c;
                nearest = at;
            }
        }
        reach = without_first(block, reach);
    }
    if nearest.distance >= SIGHT {
        return vec3f(0.0);
    }
    let share = seen(body, x, nearest);
    if share >= 1.0 {
        return vec3f(0.0);
    }
    return nearest.normal * sqrt(1.0 / max(share, LEAST_SEEN) - 1.0);
}
