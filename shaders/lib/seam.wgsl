// What holds nodes where bodies touch each other, or are so thin that nodes behind them hold what lies before. Twin: src/stages/seam.rs.
// Needs the binding colliders, and kernel and contact.

// The surfaces of the last body that the node lies in, or on, and of the one before; a normal of 0 where there is none.
var<private> within: Surface;
var<private> within_before: Surface;
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

// Whether two surfaces at the node face each other and touch.
fn touches(a: Surface, b: Surface) -> bool {
    return dot3(a.normal, b.normal) < FACING && abs(a.distance + b.distance) <= SEAM;
}

// What a node is to the seam of a body, in whose frame it is at `p`, and one that it is `within`, which touch.
fn seam_at(c: u32, p: vec3f, at: Surface) -> Seam {
    let between = (touches(at, within) || touches(at, within_before)) && at.distance <= BESIDE_SEAM;
    at_seam |= between;
    let inside = at.distance <= SEAM;
    if first_look && inside {
        var fills = select(0.5, 1.0, at.distance < -SEAM);
#if EDGES
        if wall_count(colliders[c].kind) > 1u {
            fills = 1.0;
            for (var side = 0u; side < MOST_WALLS; side++) {
                if side >= wall_count(colliders[c].kind) {
                    continue;
                }
                if side_surface(colliders[c].kind, side, colliders[c].size, p).distance <= SEAM {
                    fills = fills * 0.5;
                }
            }
        }
#endif
        filled += fills;
    }
    let enclosed = between && filled >= 1.0;
    if inside {
        within_before = within;
        within = at;
    }
    return Seam(between, enclosed);
}

// Whether the node has been found in, or beside, more than one body: what one does to it depends on what is known of others.
fn is_in_several() -> bool {
    return at_seam || any(within_before.normal != vec3f(0.0));
}

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
    let share = 1.0 - share_before(far);
    // But for rounding, which need not be that of the distance.
    let nearest = distance <= outside + SEAM;
    let alone = fill <= share * NOTHING_ELSE && distance <= BESIDE_SEAM;
    if !select(alone, nearest, outside < 0.0) {
        return vec3f(0.0);
    }
    var normal = vec3f(0.0);
    normal[axis] = select(1.0, -1.0, p[axis] < 0.0);
    return transform(colliders[c].axes, normal);
}
#endif
