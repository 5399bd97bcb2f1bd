// In which directions bodies hold a node. Twin: src/stages/predict.rs. Needs linear.

#if HOLDS
var<private> held_axis: vec3f;
var<private> held_count: u32;
var<private> held_braked: f32;

// Notes that the node loses this share of its motion along a body.
fn brake(share: f32, normal: vec3f) {
    if share <= 0.0 {
        return;
    }
    held_braked = share;
    if held_count == 0u {
        held_axis = normal;
    }
}

// The same of a node that sticks to a body: in all directions, and across its motion, which is along the normal, where it leaves or may come
// nearer.
fn hold_sticking(relative: vec3f) {
    let square = dot3(relative, relative);
    if square <= NEARER * NEARER {
        held_count = 3u;
        return;
    }
    let line = relative * (1.0 / sqrt(square));
    let other = cross3(held_axis, line);
    var alike = held_count == 0u;
    if held_count == 1u {
        alike = abs(dot3(held_axis, line)) <= 0.03;
    }
    if held_count == 2u {
        alike = dot3(other, other) < 1e-3;
    }
    held_axis = line;
    held_count = select(3u, 2u, alike);
}

// Adds to the directions in which the node is held that in which contact has changed its motion to this one, relative to the body. Not
// where it still comes nearer.
fn hold(change: vec3f, relative: vec3f, stuck: bool) {
    let square = dot3(change, change);
    if square < TOUCH || held_count == 3u {
        return;
    }
    let normal = change * (1.0 / sqrt(square));
    if stuck {
        hold_sticking(relative);
        return;
    }
    if dot3(relative, normal) < -NEARER {
        return;
    }
    if held_count == 0u {
        held_axis = normal;
        held_count = 1u;
    } else if held_count == 1u {
        let line = cross3(held_axis, normal);
        let square = dot3(line, line);
        if square >= 1e-3 {
            held_axis = line * (1.0 / sqrt(square));
            held_count = 2u;
        }
    } else if held_count == 2u && abs(dot3(held_axis, normal)) > 0.03 {
        held_count = 3u;
    }
}
#else
// The part of `v` in the directions in which a node is free.
fn free(held: Held, v: vec3f) -> vec3f {
    switch held.count {
        case 0u: { return v; }
        case 1u: { return v - held.axis * dot3(held.axis, v); }
        case 2u: { return held.axis * dot3(held.axis, v); }
        default: { return vec3f(0.0); }
    }
}

// What forces that would give a free node the motion `v` give it.
fn reply(held: Held, v: vec3f) -> vec3f {
    let free = free(held, v);
#if STICKS
    if held.braked > 0.0 {
        let left = free * (1.0 - held.braked);
        if held.count > 0u {
            return left;
        }
        return left + held.axis * (held.braked * dot3(held.axis, v));
    }
#endif
    return free;
}

// Twice the work per mass of the forces that have given a node the motion `u`.
fn work(held: Held, u: vec3f) -> f32 {
    let square = dot3(u, u);
#if STICKS
    if held.braked > 0.0 {
        var normal = 0.0;
        if held.count == 0u {
            normal = dot3(held.axis, u);
        }
        normal = normal * normal;
        return normal + (square - normal) * (1.0 / (1.0 - held.braked));
    }
#endif
    return square;
}
#endif
