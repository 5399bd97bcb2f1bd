// How nodes are held beyond the bodies' own normals: where bodies touch, where faces of a box meet, and where bodies
// are so thin that nodes behind them hold matter that lies before them. Twin: src/stages/seam.rs. Needs the binding
// colliders, and kernel and contact.

// The surfaces of the last body that the node lies in or on and of the one before; the normal is 0 if there is none.
var<private> within: Surface;
var<private> within_before: Surface;
// Largest gaps to another surface at which these count as touching, in cells.
var<private> slack_within: f32;
var<private> slack_before: f32;
// The share of the node's surroundings that bodies are known to fill: half for a body on whose face it lies, a quarter
// for one at whose edge.
var<private> filled: f32;
// Whether the node is at a seam.
var<private> at_seam: bool;
// Whether this is the first visit to the bodies.
var<private> first_look: bool;

// A node at the seam of two bodies.
struct Seam {
    between: bool, // whether the node is at a seam
    enclosed: bool, // whether bodies enclose it on all sides
}

// Whether two surfaces at the node face each other and touch, with a gap of at most `slack`.
fn touches(a: Surface, b: Surface, slack: f32) -> bool {
    return dot3(a.normal, b.normal) < FACING && abs(a.distance + b.distance) <= slack;
}

// The share of the surroundings of a node in a convex body that it fills: 1, and half of that for each side that the
// node lies on.
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

// Whether a node lies at the seam of a body, with this surface, and a touching one that it is `within`. The share of
// its surroundings that the body fills has been added before.
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

// Whether the node has been found in or beside more than one body: the effect of one body on it depends on what is
// known of the others.
fn is_in_several() -> bool {
    return at_seam || any(within_before.normal != vec3f(0.0));
}

// Whether the node holds no more than can come from matter before a face at the distance `far`.
fn holds_nothing_else(far: f32) -> bool {
    let share = 1.0 - share_before(far);
    return fill <= share * NOTHING_ELSE;
}

#if MESHES
// As `behind_thin`, for a mesh and a node at `p` in its frame before this surface. A point as far through the part as
// kernels reach is outside again by some distance; the face before is nearer by that distance.
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
// Whether the node also lies in or on another body, with a normal unlike this one.
fn in_another(normal: vec3f, other: Surface) -> bool {
    return dot3(other.normal, other.normal) > 0.0 && dot3(normal, other.normal) < ALIKE;
}

#if GAPS
// The normal of the face of a box before which solids at a node on its edge lie, among those that meet there, which the
// node is `beyond`; 0 if none.
fn face_before(c: u32, p: vec3f, beyond: vec3f) -> vec3f {
    let axes = colliders[c].axes;
    let axis = min(face_axis, 2u);
    let along = abs(vec3f(axes[0][axis], axes[1][axis], axes[2][axis]));
    let out = select(vec3f(1.0), vec3f(-1.0), p < vec3f(0.0));
    return transform(axes, select(vec3f(0.0), out, (vec3f(0.0) < beyond) & (vec3f(FACE_ON) <= along)));
}
#endif

// How a body stops a nearby node.
struct Side {
    normal: vec3f,
    // By which normal other bodies face it there: on an edge that between its faces.
    seen: vec3f,
    // By how much the node may come nearer than it otherwise might: beyond two faces of a box, on its way around the
    // edge.
    around: f32,
}

// The normal `between` a box's faces without its part against other bodies that a node on the edge lies in or on; the
// `exact` one where that leaves nothing.
fn cleared(between: vec3f, exact: vec3f) -> vec3f {
    var rest = between - within.normal * min(dot3(between, within.normal), 0.0);
    rest = rest - within_before.normal * min(dot3(rest, within_before.normal), 0.0);
    let square = dot3(rest, rest);
    return select(rest * (1.0 / sqrt(max(square, LEAST_LEFT))), exact, square < LEAST_LEFT);
}

// At the edges of a box the normal is that of the face before which solids lie, or lies between those of the faces that
// meet there; beside an edge, the exact one if the node also lies in or on another body. `relative` is the node's motion
// relative to this one.
fn node_side(c: u32, p: vec3f, at: Surface, relative: vec3f) -> Side {
    let kind = colliders[c].kind;
    let plain = Side(at.normal, at.normal, 0.0);
    if kind != SHAPE_BOX || at.distance >= EARLY {
        return plain;
    }
    let size = colliders[c].size;
    let bevel = min(BEVEL, min(min(size.x, size.y), size.z));
    let inner = size - bevel;
    let beyond = abs(p) - inner;
    // Beyond two of the faces of a box whose faces lie farther in by the bevel.
    let past = max(min(beyond.x, beyond.y), min(max(beyond.x, beyond.y), beyond.z));
    if past <= 0.0 {
        return plain;
    }
    let between = surface(kind, inner, p).normal;
    let on_edge = at.distance <= BEVEL;
    var seen = at.normal;
    if on_edge {
        seen = cleared(transform(colliders[c].axes, between), at.normal);
    }
#if GAPS
    if face_axis < 3u && on_edge {
        let face = face_before(c, p, beyond);
        if any(face != vec3f(0.0)) {
            return Side(face, seen, 0.0);
        }
    }
#endif
    if in_another(at.normal, within) || in_another(at.normal, within_before) {
        return Side(seen, seen, 0.0);
    }
    var around = 0.0;
    if bevel < past && parts {
        let way = transform_transposed(colliders[c].axes, relative);
        around = max(way_around(p, beyond, between, way) - at_rest(), 0.0);
    }
    if !on_edge {
        return Side(transform(colliders[c].axes, between), seen, around);
    }
    return Side(seen, seen, around);
}

// By how much the motion `way` of a node, which is `beyond` some of a box's faces, nears it to its edge, against the
// normal `between` those faces, if it is without what moves the node towards all of these faces.
fn way_around(p: vec3f, beyond: vec3f, between: vec3f, way: vec3f) -> f32 {
    let faces = vec3f(0.0) < beyond;
    let outward = select(way, -way, p < vec3f(0.0));
    let least = select(vec3f(-FAR), outward, faces);
    let to_all = min(max(max(least.x, least.y), least.z), 0.0);
    let nearer = select(vec3f(0.0), (to_all - outward) * abs(between), faces);
    return nearer.x + nearer.y + nearer.z;
}

// The motion that counts as rest beside edges.
fn at_rest() -> f32 {
    return sqrt(2.0 * AT_REST * sqrt(dot3(constants.kick, constants.kick)));
}

// The direction away from a box thinner than the reach of kernels, for a node behind it that holds matter that lies
// before it; 0 for other nodes.
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
    // Up to rounding, which may differ from that of the distance.
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
