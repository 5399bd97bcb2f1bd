// How points move along bodies given by grids of distances. Twin: src/stages/swept.rs. Needs the binding colliders, and
// linear, sdf and contact.

// How far a point gets on its way from `start`, in the body's frame.
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

// Holds a node beyond the mesh's normal, at a seam and behind a thin part. It is at `p` in the mesh's frame, and
// queries it from `start`.
fn hold_node(c: u32, x: vec3f, p: vec3f, start: vec3f, walked: Resolved) -> Resolved {
    let kind = colliders[c].kind;
    let size = colliders[c].size;
    let at = surface(kind, size, p);
    let slack = min(ROUGH * distance_grids[u32(size.x)].spacing, STUCK);
    if first_look && at.distance <= slack {
        // At its edge, if the place of the query is.
        let edge = select(0.5, 1.0, surface(kind, size, start).distance < -SEAM);
        filled += select(edge * 0.5, edge, at.distance < -slack);
    }
    let seam = seam_at(Surface(transform(colliders[c].axes, at.normal), at.distance), slack);
    let body = body_motion(c, x);
    if seam.enclosed {
        return Resolved(body, true, true);
    }
    let relative = walked.u - body;
    let away = behind_thin_mesh(c, p, at);
    let leaving = dot3(relative, away);
    if leaving > 0.0 {
        return Resolved(body + (relative - away * leaving), true, walked.stuck);
    }
    return walked;
}

// Beside a body given by a grid of distances, the way of a point relative to the body is walked in pieces. The walk
// begins at the place off other bodies from which the mesh is queried.
fn resolve_swept(block: u32, c: u32, x: vec3f, u: vec3f, friction: f32) -> Resolved {
    let axes = colliders[c].axes;
    let turn = turn_of(c);
    let r = x - colliders[c].position;
    let at = transform_transposed(axes, r);
    let to = r + (u - colliders[c].shift);
    let way = transform_transposed(axes, transform_transposed(turn, to) + to) - at;
    let start = frame(c, off_others(block, c, x));
    let walked = walk(c, start, way, friction);
    var kept = Resolved(u, false, false);
    if walked.touched {
        let turned = transform(axes, walked.u);
        kept = Resolved(body_motion(c, x) + (transform(turn, turned) + turned), true, walked.stuck);
    }
    if fill >= 0.0 {
        return hold_node(c, x, at, start, kept);
    }
    return kept;
}
