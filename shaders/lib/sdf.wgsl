// Signed distance and outward normal of the collider shapes, in the shape's own frame. Twin: src/math/sdf.rs.

struct Surface {
    normal: vec3f,
    distance: f32,
}

fn sign_of(x: vec3f) -> vec3f {
    return select(vec3f(1.0), vec3f(-1.0), x < vec3f(0.0));
}

#if BOXES
fn box_surface(half: vec3f, p: vec3f) -> Surface {
    let q = abs(p) - half;
    let out = max(q, vec3f(0.0));
    let distance = sqrt(out.x * out.x + out.y * out.y + out.z * out.z);
    let side = sign_of(p);
    if distance > 0.0 {
        return Surface(side * out * (1.0 / distance), distance);
    }
    // Inside: the nearest face; of equally near ones that of the first axis.
    if q.x >= q.y && q.x >= q.z {
        return Surface(vec3f(side.x, 0.0, 0.0), q.x);
    }
    if q.y >= q.z {
        return Surface(vec3f(0.0, side.y, 0.0), q.y);
    }
    return Surface(vec3f(0.0, 0.0, side.z), q.z);
}
#endif

#if SPHERES
fn sphere_surface(radius: f32, p: vec3f) -> Surface {
    let length = sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    if length > 1e-12 {
        return Surface(p * (1.0 / length), length - radius);
    }
    return Surface(vec3f(0.0, 1.0, 0.0), -radius);
}
#endif

#if CAPSULES
fn capsule_surface(radius: f32, half: f32, p: vec3f) -> Surface {
    let r = vec3f(p.x, p.y - max(min(p.y, half), -half), p.z);
    let length = sqrt(r.x * r.x + r.y * r.y + r.z * r.z);
    if length > 1e-12 {
        return Surface(r * (1.0 / length), length - radius);
    }
    // On the axis the surface is nearest sideways, in no particular direction.
    return Surface(vec3f(1.0, 0.0, 0.0), -radius);
}
#endif

// Distance from the y axis, and the direction away from it in x and z; on the axis, along x.
struct AroundAxis {
    distance: f32,
    away: vec2f,
}

fn around_axis(p: vec3f) -> AroundAxis {
    let around = sqrt(p.x * p.x + p.z * p.z);
    if around > 1e-12 {
        return AroundAxis(around, vec2f(p.x, p.z) * (1.0 / around));
    }
    return AroundAxis(around, vec2f(1.0, 0.0));
}

#if CYLINDERS
fn cylinder_surface(radius: f32, half: f32, p: vec3f) -> Surface {
    let side = select(1.0, -1.0, p.y < 0.0);
    let axis = around_axis(p);
    let q = vec2f(axis.distance - radius, abs(p.y) - half);
    let out = max(q, vec2f(0.0));
    let distance = sqrt(out.x * out.x + out.y * out.y);
    if distance > 0.0 {
        let shares = out * (1.0 / distance);
        return Surface(vec3f(axis.away.x * shares.x, side * shares.y, axis.away.y * shares.x), distance);
    }
    // Inside: the nearer of wall and end; the wall if they are equally near.
    if q.x >= q.y {
        return Surface(vec3f(axis.away.x, 0.0, axis.away.y), q.x);
    }
    return Surface(vec3f(0.0, side, 0.0), q.y);
}
#endif

#if MESHES
#import distance_grid
#endif

fn shape_surface(shape: u32, size: vec3f, p: vec3f) -> Surface {
    switch shape {
#if BOXES
        case SHAPE_BOX: { return box_surface(size, p); }
#endif
#if SPHERES
        case SHAPE_SPHERE: { return sphere_surface(size.x, p); }
#endif
#if CAPSULES
        case SHAPE_CAPSULE: { return capsule_surface(size.x, size.y, p); }
#endif
#if CYLINDERS
        case SHAPE_CYLINDER: { return cylinder_surface(size.x, size.y, p); }
#endif
#if MESHES
        case SHAPE_GRID: { return grid_surface(u32(size.x), p); }
#endif
        default: { return Surface(vec3f(0.0, 1.0, 0.0), p.y); }
    }
}

#if MESHES
fn is_grid(kind: u32) -> bool {
    return (kind & ~INVERTED) == SHAPE_GRID;
}
#endif

#if CONTAINERS
fn is_inverted(kind: u32) -> bool {
    return (kind & INVERTED) != 0u;
}
#endif

fn surface(kind: u32, size: vec3f, p: vec3f) -> Surface {
    let of_shape = shape_surface(kind & ~INVERTED, size, p);
#if CONTAINERS
    if is_inverted(kind) {
        return Surface(-of_shape.normal, -of_shape.distance);
    }
#endif
    return of_shape;
}

#if EDGES
// Loops over walls beside nodes go this far for every kind, so that drivers unroll them: llvmpipe leaves loops after
// 65,535 turns.
const MOST_WALLS = 3u;

// Number of walls of a container: parts of its surface that meet in edges, at right angles.
fn wall_count(kind: u32) -> u32 {
    switch kind & ~INVERTED {
        case SHAPE_BOX: { return 3u; }
        case SHAPE_CYLINDER: { return 2u; }
        default: { return 1u; }
    }
}

fn faces_surface(axis: u32, half: f32, p: vec3f) -> Surface {
    var normal = vec3f(0.0);
    normal[axis] = select(-1.0, 1.0, p[axis] < 0.0);
    return Surface(normal, half - abs(p[axis]));
}

fn tube_surface(radius: f32, p: vec3f) -> Surface {
    let axis = around_axis(p);
    return Surface(vec3f(-axis.away.x, 0.0, -axis.away.y), radius - axis.distance);
}

// Distance inwards from one of the sides of a body that has several, as if it were the only one, and the normal away
// from the side. A pair of opposite faces counts as one side.
fn side_surface(kind: u32, side: u32, size: vec3f, p: vec3f) -> Surface {
#if CYLINDERS
    if (kind & ~INVERTED) == SHAPE_CYLINDER {
        if side == 0u {
            return tube_surface(size.x, p);
        }
        return faces_surface(1u, size.y, p);
    }
#endif
    return faces_surface(side, size[side], p);
}

// The same for a container's walls, of which there may be only one.
fn wall_surface(kind: u32, wall: u32, size: vec3f, p: vec3f) -> Surface {
    if wall_count(kind) > 1u {
        return side_surface(kind, wall, size, p);
    }
    return surface(kind, size, p);
}
#endif
