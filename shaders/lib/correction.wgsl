// What particles see too little of strains, solids beside clamps and liquids beside what they stick to. Twin: src/stages/correction.rs.
// Needs linear, kernel, sdf and contact.

// What makes up for it beside a body: zero where all is seen; what the turning of the body brings to D m in a step; and per D m of it by what
// a liquid's motion is to be changed, and what its gradient lacks.
struct Correction {
    m: vec3f,
    body: u32,
    turned: vec3f,
    ahead: f32,
    lacks: vec3f,
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

// What a particle sees of matter whose motion is the distance from a body: of a strain along the normal a share, and of the nodes that are
// held, which move as the body, what they would have of that motion, and of its gradient.
struct Seen {
    share: f32,
    behind: f32,
    slope: vec3f,
}

fn in_row(parts: vec3f, weights: vec3f) -> f32 {
    return parts.x * weights.x + parts.y * weights.y + parts.z * weights.z;
}

// Of a particle at `x` to which the body is `at`.
fn seen(c: u32, x: vec3f, at: Surface) -> Seen {
    let first = vec3f(base(x));
    let s = stencil(x - first);
    let wx = vec3f(s.w0.x, s.w1.x, s.w2.x);
    let wy = vec3f(s.w0.y, s.w1.y, s.w2.y);
    let wz = vec3f(s.w0.z, s.w1.z, s.w2.z);
    var holds_a_node = false;
    var sum = 0.0;
    var behind = 0.0;
    var slope = vec3f(0.0);
    for (var n = 0u; n < 9u; n++) {
        let j = n % 3u;
        let k = n / 3u;
        var strain: vec3f;
        var lacking: vec3f;
        var ways: array<vec3f, 3>;
        for (var i = 0u; i < 3u; i++) {
            let node = first + vec3f(f32(i), f32(j), f32(k));
            ways[i] = node - x;
            let along = dot3(ways[i], at.normal);
            let distance = surface_after(c, node).distance;
            holds_a_node |= distance <= 0.0;
            let height = along + at.distance;
            let before = height > 0.0 && distance > 0.0;
            strain[i] = select(0.0, distance, before) * along;
            lacking[i] = select(height, 0.0, distance > 0.0);
        }
        let weight = wz[k] * wy[j];
        sum += weight * in_row(strain, wx);
        behind += weight * in_row(lacking, wx);
        let across = vec3f(
            in_row(lacking * vec3f(ways[0].x, ways[1].x, ways[2].x), wx),
            in_row(lacking * vec3f(ways[0].y, ways[1].y, ways[2].y), wx),
            in_row(lacking * vec3f(ways[0].z, ways[1].z, ways[2].z), wx),
        );
        slope += weight * across;
    }
    return Seen(select(1.0, 4.0 * sum, holds_a_node), behind, slope * 4.0);
}

// Of a particle at `x`: none inside a body. Solids are beside clamps that do not turn, liquids beside all they stick to.
fn correction(block: u32, x: vec3f, liquid: bool) -> Correction {
    let none = Correction(vec3f(0.0), 0u, vec3f(0.0), 0.0, vec3f(0.0));
    var body = 0u;
    var nearest = Surface(vec3f(0.0), KERNEL_REACH);
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
    if nearest.distance >= KERNEL_REACH {
        return none;
    }
    let seen = seen(body, x, nearest);
    if seen.share >= ALL_SEEN {
        return none;
    }
    var makes_up = 1.0 / max(seen.share, LEAST_SEEN);
    if liquid {
        makes_up = 1.0 / sqrt(max(seen.share, LEAST_SEEN_BY_LIQUIDS));
    }
    let size = sqrt(makes_up - 1.0);
    let m = nearest.normal * size;
    let per_rate = makes_up * makes_up * (1.0 / size);
    return Correction(m, body, transform(colliders[body].turn, m), seen.behind * per_rate, seen.slope * per_rate);
}
