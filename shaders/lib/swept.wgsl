// How points go along bodies that are known by their distances. Twin: src/stages/swept.rs.
// Needs the binding colliders, and linear, sdf and contact.

// How far a point comes from `start` on its way, in the body's frame.
fn walk(c: u32, start: vec3f, way: vec3f, friction: f32) -> Resolved {
    let kind = colliders[c].kind;
    let size = colliders[c].size;
    let least = distance_grids[u32(size.x)].spacing * 0.5;
    var at = start;
    var rest = way;
    var left = sqrt(dot3(rest, rest));
    var near = surface(kind, size, at);
    let level = level_of(near.distance);
    var gap = near.distance - level;
    let stuck = sticks(near.distance, friction);
    var touched = stuck;
    if stuck {
        rest = near.normal * max(dot3(rest, near.normal), -gap);
        left = sqrt(dot3(rest, rest));
    }
    for (var i = 0u; i < PIECES; i++) {
        var piece = gap * REACH;
        if piece >= left {
            return Resolved(at + rest - start, touched, stuck);
        }
        if piece < least {
            let along = dot3(rest, near.normal);
            let stopped = -gap - along;
            if stopped > 0.0 {
                rest = rubbed(rest - near.normal * along, stopped, friction_outside(friction)) - near.normal * gap;
                left = sqrt(dot3(rest, rest));
                touched = true;
            }
            piece = least;
        }
        if piece >= left {
            at += rest;
            left = 0.0;
            break;
        }
        let part = rest * (piece / left);
        at += part;
        rest -= part;
        left -= piece;
        near = surface(kind, size, at);
        gap = near.distance - level;
        if gap < 0.0 {
            at -= near.normal * gap;
            gap = 0.0;
            touched = true;
        }
    }
    touched |= left > 0.0;
    for (var i = 0u; i < MENDS; i++) {
        near = surface(kind, size, at);
        gap = near.distance - level;
        if gap >= 0.0 {
            break;
        }
        at -= near.normal * gap;
        touched = true;
    }
    return Resolved(at - start, touched, stuck);
}

// Beside such a body the way relative to it is walked in pieces.
fn resolve_swept(c: u32, x: vec3f, u: vec3f, friction: f32) -> Resolved {
    let axes = colliders[c].axes;
    let turn = colliders[c].turn;
    let r = x - colliders[c].position;
    let start = transform_transposed(axes, r);
    let to = r + (u - colliders[c].shift);
    let way = transform_transposed(axes, transform_transposed(turn, to) + to) - start;
    let walked = walk(c, start, way, friction);
    if !walked.touched {
        return Resolved(u, false, false);
    }
    let turned = transform(axes, walked.u);
    return Resolved(body_motion(c, x) + (transform(turn, turned) + turned), true, walked.stuck);
}
