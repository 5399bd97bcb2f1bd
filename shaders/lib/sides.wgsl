// Nodes that more than the nearest side of a body stops. Twin: src/stages/sides.rs. Needs the binding colliders, and contact, linear and sdf.

// How far from the second nearest of a body's sides a point of its frame is.
fn second_depth(kind: u32, size: vec3f, p: vec3f) -> f32 {
    var nearest = FAR;
    var second = FAR;
    for (var side = 0u; side < MOST_WALLS; side++) {
        if side >= wall_count(kind) {
            continue;
        }
        let depth = side_surface(kind, side, size, p).distance;
        second = min(second, max(nearest, depth));
        nearest = min(nearest, depth);
    }
    return second;
}

// Motions relative to a body of a node at `p` in its frame that the nearest side has stopped, up to a gap that is left: also by the sides that
// are not much deeper, at a seam, where there is no gap, by all that kernels reach. One that is enclosed is held in all directions.
fn resolve_sides(c: u32, p: vec3f, distance: f32, seam: Seam, gap_left: f32, motion: vec3f, friction: f32) -> Resolved {
    if seam.enclosed {
        return Resolved(vec3f(0.0), true, true);
    }
    let kind = colliders[c].kind;
    let size = colliders[c].size;
    let axes = colliders[c].axes;
    let reach = select(EDGE_REACH - distance, KERNEL_REACH, seam.between);
    if !seam.between && second_depth(kind, size, p) > reach {
        return Resolved(motion, false, false);
    }
    let gap = select(gap_left, 0.0, seam.between);
    var relative = transform_transposed(axes, motion);
    let least = sqrt(dot3(relative, relative)) * LEAST_SHARE;
    var touched = false;
    for (var side = 0u; side < MOST_WALLS; side++) {
        if side >= wall_count(kind) {
            continue;
        }
        let inside = side_surface(kind, side, size, p);
        let along = dot3(relative, inside.normal);
        let stopped = along - gap;
        if inside.distance <= reach && stopped > least {
            relative = rubbed(relative - inside.normal * along, stopped, friction) + inside.normal * gap;
            touched = true;
        }
    }
    return Resolved(transform(axes, relative), touched, false);
}
