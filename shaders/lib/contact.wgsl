// Contact with colliders, shared by the grid and the particles. Twin: src/stages/contact.rs.
// Needs the bindings constants, colliders, cull.

// Surface in the world for a point at `r` from the body's centre.
fn surface_at(c: u32, r: vec3f) -> Surface {
    let axes = colliders[c].axes;
    let local = surface(colliders[c].kind, colliders[c].size, transform_transposed(axes, r));
    return Surface(transform(axes, local.normal), local.distance);
}

// Surface at the end of the step.
fn surface_after(c: u32, x: vec3f) -> Surface {
    let r = x - colliders[c].position - colliders[c].shift;
    let turn = colliders[c].turn;
    let turned = surface_at(c, transform_transposed(turn, r) + r);
    return Surface(transform(turn, turned.normal) + turned.normal, turned.distance);
}

// Displacement of the body's material at `x` in the step.
fn body_motion(c: u32, x: vec3f) -> vec3f {
    return colliders[c].shift + transform(colliders[c].turn, x - colliders[c].position);
}

struct Resolved {
    u: vec3f,
    touched: bool,
}

// Relative to the body, a point at distance d may move at most max(d, 0) against the normal.
fn resolve(c: u32, x: vec3f, u: vec3f, friction: f32) -> Resolved {
    let at = surface_at(c, x - colliders[c].position);
    let body = body_motion(c, x);
    let relative = u - body;
    let along = dot3(relative, at.normal);
    let gap = max(at.distance, 0.0);
    let stopped = -gap - along;
    if stopped <= 0.0 {
        return Resolved(u, false);
    }
    var tangent = relative - at.normal * along;
    if friction > 0.0 {
        let slip = sqrt(dot3(tangent, tangent));
        tangent *= select(0.0, 1.0 - friction * stopped / slip, slip > friction * stopped);
    }
    return Resolved(body + (tangent - at.normal * gap), true);
}

// `u` kept out of all bodies in reach of `block`.
fn resolve_all(block: u32, x: vec3f, start: vec3f, with_friction: bool) -> vec3f {
    var u = start;
    for (var sweep = 0u; sweep < SWEEPS; sweep++) {
        var touched = false;
        for (var word = 0u; word < constants.cull_words; word++) {
            var rest = cull[block * constants.cull_words + word];
            while rest != 0u {
                let c = word * 32u + firstTrailingBit(rest);
                rest &= rest - 1u;
                let resolved = resolve(c, x, u, select(0.0, colliders[c].friction, with_friction));
                u = resolved.u;
                touched |= resolved.touched;
            }
        }
        if !touched {
            break;
        }
    }
    return u;
}
