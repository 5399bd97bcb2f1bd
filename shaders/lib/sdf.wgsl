// Signed distance and outward normal of the collider shapes, in the shape's own frame. Twin: src/math/sdf.rs.

struct Surface {
    normal: vec3f,
    distance: f32,
}

fn sign_of(x: vec3f) -> vec3f {
    return select(vec3f(1.0), vec3f(-1.0), x < vec3f(0.0));
}

fn box_surface(half: vec3f, p: vec3f) -> Surface {
    let q = abs(p) - half;
    let out = max(q, vec3f(0.0));
    let distance = sqrt(out.x * out.x + out.y * out.y + out.z * out.z);
    let side = sign_of(p);
    if distance > 0.0 {
        return Surface(side * out * (1.0 / distance), distance);
    }
    // Inside: the nearest face, the first axis of equals.
    if q.x >= q.y && q.x >= q.z {
        return Surface(vec3f(side.x, 0.0, 0.0), q.x);
    }
    if q.y >= q.z {
        return Surface(vec3f(0.0, side.y, 0.0), q.y);
    }
    return Surface(vec3f(0.0, 0.0, side.z), q.z);
}

fn sphere_surface(radius: f32, p: vec3f) -> Surface {
    let length = sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    if length > 1e-12 {
        return Surface(p * (1.0 / length), length - radius);
    }
    return Surface(vec3f(0.0, 1.0, 0.0), -radius);
}

fn surface(kind: u32, size: vec3f, p: vec3f) -> Surface {
    switch kind {
        case SHAPE_BOX: { return box_surface(size, p); }
        case SHAPE_SPHERE: { return sphere_surface(size.x, p); }
        default: { return Surface(vec3f(0.0, 1.0, 0.0), p.y); }
    }
}
