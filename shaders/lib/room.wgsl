// The room: the volume fraction that the grid measures at a point amid matter at rest. It is 1 less the share that
// walls and bodies hide (occlude). Twin: src/stages/room.rs. Needs the binding constants; where there are colliders,
// also colliders and cull, and the libraries linear, sdf and contact.

// The room at a point: less matter than `least` counts as a deficit, more than `most` as compression.
struct Room {
    least: f32,
    most: f32,
}

// The share of a kernel that lies behind a plane at a distance.
fn behind(distance: f32) -> f32 {
    return select(far_behind(distance), 0.5 - distance * FADING, distance < 0.5);
}

// The same from half a cell on.
fn far_behind(distance: f32) -> f32 {
    let far = max(2.5 - distance, 0.0);
    let near = max(1.5 - distance, 0.0);
    return far * (far * (1.0 / 96.0)) + near * (near * (7.0 / 32.0));
}

// The room that the domain's closed sides leave.
fn before_walls(at: vec3f) -> f32 {
    var room = 1.0;
    for (var a = 0u; a < 3u; a++) {
        let sides = constants.open_sides >> (2u * a);
        if (sides & 1u) == 0u {
            room *= 1.0 - behind(at[a] - constants.lo[a]);
        }
        if (sides & 2u) == 0u {
            room *= 1.0 - behind(constants.hi[a] - at[a]);
        }
    }
    return room;
}

#if COLLIDERS
// The share that lies before a plane, for points on either side.
fn before(distance: f32) -> f32 {
    let share = far_behind(abs(distance));
    let apart = select(1.0 - share, share, distance < 0.0);
    return select(apart, 0.5 + distance * FADING, abs(distance) < 0.5);
}

// The share between two planes at the distance `half` to either side of the middle.
fn between(half: f32, x: f32) -> f32 {
    let way = abs(x);
    return before(half - way) - behind(half + way);
}

fn in_box(extent: vec3f, p: vec3f) -> f32 {
    return between(extent.x, p.x) * between(extent.y, p.y) * between(extent.z, p.z);
}

// The share that a body hides at a point.
fn hidden_by(c: u32, at: vec3f) -> f32 {
    let kind = colliders[c].kind;
    let size = colliders[c].size;
    let p = frame(c, at);
    let flat = before(-surface(kind, size, p).distance);
    switch kind {
        case SHAPE_BOX: { return min(flat, in_box(size, p)); }
        case SHAPE_SPHERE: { return min(flat, in_box(vec3f(size.x), p)); }
        case SHAPE_CAPSULE: { return min(flat, in_box(vec3f(size.x, size.y + size.x, size.x), p)); }
        case SHAPE_CYLINDER: { return min(flat, in_box(vec3f(size.x, size.y, size.x), p)); }
#if MESHES
        case SHAPE_GRID: {
            let grid = u32(size.x);
            return min(flat, in_box(distance_grids[grid].extent, p - distance_grids[grid].middle));
        }
#endif
        default: { return flat; }
    }
}
#endif

// The room at the point that contact is resolved for.
var<private> room: Room;

// Begins with the room that the domain's sides leave.
fn begin_room(at: vec3f) {
    let walls = before_walls(at);
    room = Room(walls, walls);
}

#if COLLIDERS
// Takes account of a body. Of several, the one that hides most counts.
fn see_room(c: u32, at: vec3f) {
    // The domain's sides are the first of the colliders.
    if c >= 6u - countOneBits(constants.open_sides) {
        let hidden = hidden_by(c, at);
        room.least = min(room.least, 1.0 - hidden);
        room.most = min(room.most, 1.0 - hidden * HIDDEN);
    }
}
#endif
