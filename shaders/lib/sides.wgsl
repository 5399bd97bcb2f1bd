// Nodes that are stopped by more than the nearest side of a body. Twin: src/stages/sides.rs. Needs the binding
// colliders, and contact, linear and sdf.

// Depth of a point in the body's frame below the second nearest of its sides.
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

// For a node at `p` in the body's frame that the nearest side has stopped up to a remaining gap, its `motion` relative
// to the body, also stopped by the other sides within their reach: those that are not much deeper, or at a seam, where
// there is no gap, all that kernels reach. Enclosed nodes are held in all directions.
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
