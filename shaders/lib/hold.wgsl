// The directions in which bodies hold a node. Twins: `note`, `counts` and `hold` in src/stages/predict.rs. Needs
// linear.

#if HOLDS
var<private> held_axis: vec3f;
var<private> held_count: u32;
// The body that was the last to hold it.
var<private> held_body: u32;
#if STICKS
var<private> held_braked: f32;
var<private> braked_normal: vec3f;

// Records that the node loses this share of its motion along a body.
fn brake(share: f32, normal: vec3f) {
    held_braked = share;
    braked_normal = normal;
}
#endif

// Holds a node that sticks to a body: in all directions, or, where it leaves the body or may come nearer, only
// perpendicular to its motion, which is along the normal.
fn hold_sticking(body: u32, relative: vec3f) {
    held_body = body;
    let square = dot3(relative, relative);
    if square <= NEARER * NEARER {
        held_count = 3u;
        return;
    }
    let line = relative * (1.0 / sqrt(square));
    let other = cross3(held_axis, line);
    var alike = held_count == 0u;
    if held_count == 1u {
        alike = abs(dot3(held_axis, line)) <= ACROSS;
    }
    if held_count == 2u {
        alike = dot3(other, other) < ALONG;
    }
    held_axis = line;
    held_count = select(3u, 2u, alike);
}

// Adds the direction of a `change` of a node's motion that is more than rounding to those in which the node is held.
// `after` is the motion afterwards, `relative` the same relative to the body. A node that still comes nearer is not
// held.
fn hold(body: u32, change: vec3f, after: vec3f, relative: vec3f, stuck: bool) {
    let square = dot3(change, change);
    let rounding = select(dot3(after, after) * SLIGHT, 0.0, stuck);
    if square < max(TOUCH, rounding) || held_count == 3u {
        return;
    }
    let normal = change * (1.0 / sqrt(square));
    if stuck {
        hold_sticking(body, relative);
        return;
    }
    if dot3(relative, normal) < -NEARER {
        return;
    }
    if held_count == 0u {
        held_axis = normal;
        held_count = 1u;
        held_body = body;
    } else if held_count == 1u {
        let line = cross3(held_axis, normal);
        let square = dot3(line, line);
        if square >= ALONG {
            held_axis = line * (1.0 / sqrt(square));
            held_count = 2u;
            held_body = body;
        }
    } else if held_count == 2u && abs(dot3(held_axis, normal)) > ACROSS {
        held_count = 3u;
        held_body = body;
    }
}
#endif

// In how many directions a node is held.
fn directions(held: Held) -> u32 {
    return held.count_and_body & 3u;
}

// The part of `v` in the directions in which a node is free.
fn free(held: Held, v: vec3f) -> vec3f {
    switch directions(held) {
        case 0u: { return v; }
        case 1u: { return v - held.axis * dot3(held.axis, v); }
        case 2u: { return held.axis * dot3(held.axis, v); }
        default: { return vec3f(0.0); }
    }
}

#if HOLDS
// How a node that would move by `u` is held. The motion to store is, for a braked node, the held part of `u` plus the
// free part of the body's normal.
fn held_with(u: vec3f) -> Held {
    let held = Held(held_axis, held_count | (held_body << 2u), u, 0.0);
#if STICKS
    if held_braked > 0.0 {
        return Held(held_axis, held.count_and_body, (u - free(held, u)) + free(held, braked_normal), held_braked);
    }
#endif
    return held;
}
#else
// The motion that a node gets from forces that would give a free node the motion `v`.
fn reply(held: Held, v: vec3f) -> vec3f {
    let moved = free(held, v);
#if STICKS
    let braked = held.braked;
    if braked > 0.0 {
        let normal = free(held, held.motion);
        return moved * (1.0 - braked) + normal * (braked * dot3(normal, moved));
    }
#endif
    return moved;
}

// Twice the work per mass of the forces that have given a node the motion `u`; see the twin.
fn work(held: Held, u: vec3f) -> f32 {
    let square = dot3(u, u);
#if STICKS
    let braked = held.braked;
    if braked > 0.0 {
        let normal = free(held, held.motion);
        let along = dot3(normal, u);
        let left = 1.0 - braked;
        return (square - braked * (along * along) * (1.0 / (left + braked * dot3(normal, normal)))) * (1.0 / left);
    }
#endif
    return square;
}
#endif
