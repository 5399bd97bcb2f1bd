// How much of a strain solids beside a clamp, and liquids beside bodies that they stick to, see, and how the rest is
// compensated. Twin: src/stages/correction.rs. Needs linear, kernel, sdf and contact.

// Compensates for the part of a strain that a particle does not see.
struct Correction {
    // Zero where the particle sees all of a strain.
    m: vec3f,
    // Index of the body.
    body: u32,
    // The part of D m that comes from the rotation of the body in a step, which is no strain.
    turned: vec3f,
    // The change of a liquid's motion along the body, per D m of it.
    ahead: f32,
    // The part that its gradient lacks, per D m of it.
    lacks: vec3f,
}

// Whether a body holds what is inside.
fn holds_inside(c: u32) -> bool {
    return colliders[c].friction >= FIXED;
}

// Whether it does so and does not turn.
fn is_clamp(c: u32) -> bool {
    let turn = turn_of(c);
    return holds_inside(c) && turn[0].y == 0.0 && turn[0].z == 0.0 && turn[1].z == 0.0;
}

// What a particle sees of a motion that equals the distance from a body.
struct Seen {
    // The share of a strain along the normal. 1 where none of the particle's nodes is held.
    share: f32,
    // The weighted sum of the heights of the held nodes over the body's surface; they are not positive.
    behind: f32,
    // What these heights would add to the gradient of the distance.
    slope: vec3f,
}

fn in_row(parts: vec3f, weights: vec3f) -> f32 {
    return parts.x * weights.x + parts.y * weights.y + parts.z * weights.z;
}

// What a particle at `x`, with the body's surface `at` this distance, sees if the nodes at and behind that surface move
// with it.
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
            holds_a_node |= distance <= ON_SURFACE;
            let height = along + at.distance;
            let before = height > 0.0 && distance > ON_SURFACE;
            strain[i] = select(0.0, distance, before) * along;
            lacking[i] = select(height, 0.0, distance > ON_SURFACE);
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

// The correction for a particle at `x`; none inside a body. Solids are corrected beside clamps that do not turn,
// liquids beside all bodies that they stick to.
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
    return Correction(m, body, transform(turn_of(body), m), seen.behind * per_rate, seen.slope * per_rate);
}
