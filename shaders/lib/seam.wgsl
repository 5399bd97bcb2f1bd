// What holds nodes where bodies touch each other, or are so thin that nodes behind them hold what lies before. Twin: src/stages/seam.rs.
// Needs the binding colliders, and kernel and contact.

// The surfaces of the last body that the node lies in, or on, and of the one before; a normal of 0 where there is none.
var<private> within: Surface;
var<private> within_before: Surface;
// Up to how much room there is none between these and others.
var<private> slack_within: f32;
var<private> slack_before: f32;
// How much of what is around the node bodies fill, as far as is known: half by one on whose face it lies, a quarter by one at whose edge.
var<private> filled: f32;
// Whether the node is at a seam.
var<private> at_seam: bool;
// Whether bodies are looked at for the first time.
var<private> first_look: bool;

// A node at the seam of two bodies.
struct Seam {
    between: bool, // it is one
    enclosed: bool, // and has bodies all around
}

// Whether two surfaces at the node face each other and touch, up to that much room.
fn touches(a: Surface, b: Surface, slack: f32) -> bool {
    return dot3(a.normal, b.normal) < FACING && abs(a.distance + b.distance) <= slack;
}

// How much of what is around a node in a convex body, or on its face, it fills: of one without edges, and at an edge.
fn fills(c: u32, p: vec3f, distance: f32) -> f32 {
#if EDGES
    if wall_count(colliders[c].kind) > 1u {
        var filled = 1.0;
        for (var side = 0u; side < MOST_WALLS; side++) {
            if side >= wall_count(colliders[c].kind) {
                continue;
            }
            if side_surface(colliders[c].kind, side, colliders[c].size, p).distance <= SEAM {
                filled = filled * 0.5;
            }
        }
        return filled;
    }
#endif
    return select(0.5, 1.0, distance < -SEAM);
}

// What a node is to the seam of a body, which has this surface there, and one that it is `within`, which touch. How much of what is around the node
// the body fills has been noted.
fn seam_at(at: Surface, slack: f32) -> Seam {
    let touching = touches(at, within, max(slack, slack_within)) || touches(at, within_before, max(slack, slack_before));
    let between = touching && at.distance <= BESIDE_SEAM;
    at_seam |= between;
    let enclosed = between && filled >= 1.0;
    if at.distance <= slack {
        within_before = within;
        slack_before = slack_within;
        within = at;
        slack_within = slack;
    }
    return Seam(between, enclosed);
}

// Whether the node has been found in, or beside, more than one body: what one does to it depends on what is known of others.
fn is_in_several() -> bool {
    return at_seam || any(within_before.normal != vec3f(0.0));
}

// Whether the node holds no more than can be of what lies before a face that is so `far`.
fn holds_nothing_else(far: f32) -> bool {
    let share = 1.0 - share_before(far);
    return fill <= share * NOTHING_ELSE;
}

#if MESHES
// Of a node that holds, behind a part of a mesh thinner than kernels reach, matter that lies before it, the normal there; of others 0. The node is at
// `p` in the mesh's frame, in which this surface is.
fn behind_thin_mesh(c: u32, p: vec3f, at: Surface) -> vec3f {
    if !parts || at.distance > BESIDE_SEAM {
        return vec3f(0.0);
    }
    let through = p - at.normal * KERNEL_REACH;
    let far = KERNEL_REACH - surface(colliders[c].kind, colliders[c].size, through).distance;
    if far >= KERNEL_REACH || (at.distance >= 0.0 && !holds_nothing_else(far)) {
        return vec3f(0.0);
    }
    return transform(colliders[c].axes, at.normal);
}
#endif

#if BOXES
// Whether the node lies in, or on, another body than one that has this normal there.
fn in_another(normal: vec3f, other: Surface) -> bool {
    return dot3(other.normal, other.normal) > 0.0 && dot3(normal, other.normal) < ALIKE;
}

// The normal along which a body stops a node that is at `p` in its frame, if it is near: of a box, at its edges, between those of the faces that
// meet there.
fn node_normal(c: u32, p: vec3f, at: Surface) -> vec3f {
    let kind = colliders[c].kind;
    if kind != SHAPE_BOX || at.distance >= EARLY || in_another(at.normal, within) || in_another(at.normal, within_before) {
        return at.normal;
    }
    let size = colliders[c].size;
    let inner = size - min(BEVEL, min(min(size.x, size.y), size.z));
    let beyond = abs(p) - inner;
    // Not beyond two of the faces that lie that much farther in.
    if max(min(beyond.x, beyond.y), min(max(beyond.x, beyond.y), beyond.z)) <= 0.0 {
        return at.normal;
    }
    return transform(colliders[c].axes, surface(kind, inner, p).normal);
}

// Of a node that holds, behind a box that is thinner than kernels reach, matter that lies before it, the normal there; of others 0.
fn behind_thin(c: u32, p: vec3f, distance: f32) -> vec3f {
    let size = colliders[c].size;
    var axis = select(2u, 1u, size.y <= size.z);
    if size.x <= min(size.y, size.z) {
        axis = 0u;
    }
    if colliders[c].kind != SHAPE_BOX || size[axis] >= KERNEL_REACH {
        return vec3f(0.0);
    }
    let outside = abs(p[axis]) - size[axis];
    let far = abs(p[axis]) + size[axis];
    var beside = abs(p) - size;
    beside[axis] = 0.0;
    if max(max(beside.x, beside.y), beside.z) > 0.0 || far >= KERNEL_REACH {
        return vec3f(0.0);
    }
    // But for rounding, which need not be that of the distance.
    let nearest = distance <= outside + SEAM;
    let alone = holds_nothing_else(far) && distance <= BESIDE_SEAM;
    if !select(alone, nearest, outside < 0.0) {
        return vec3f(0.0);
    }
    var normal = vec3f(0.0);
    normal[axis] = select(1.0, -1.0, p[axis] < 0.0);
    return transform(colliders[c].axes, normal);
}
#endif
