// Contact with colliders, shared by the grid and the particles. Twin: src/stages/contact.rs. Needs the bindings
// constants, colliders and cull, the libraries kernel, linear and sdf, and where SEES_ROOM also room.
#if LOADS
#import load
#endif
#if HOLDS
#import hold
#endif
#import matter
#import seam
#import corner
#if BOXES
#import joint
#endif
#if EDGES
#import sides
#endif
#if MESHES
#import footing
#import swept
#endif

// Which friction a contact exerts: that of bodies that matter slips along (Coulomb's), only that of bodies to which
// matter sticks, or that of every body.
const FRICTION_RUBBING = 0u;
const FRICTION_STICKING = 1u;
const FRICTION_FULL = 2u;

// Farther than any body in reach.
const FAR = 3e38;

// No body.
const NONE_TOUCHED = 0xffffffffu;

fn friction_of(c: u32, kind: u32) -> f32 {
    let coefficient = colliders[c].friction;
    let exerted = kind == FRICTION_FULL || (kind == FRICTION_STICKING) == (coefficient >= STICKING);
    return select(0.0, coefficient, exerted);
}

// The body's rotation in the step minus the identity.
fn turn_of(c: u32) -> mat3x3f {
    return mat3x3f(colliders[c].turn_x, colliders[c].turn_y, colliders[c].turn_z);
}

// Where a point at `x` is in the body's frame at the start of the step.
fn frame(c: u32, x: vec3f) -> vec3f {
    return transform_transposed(colliders[c].axes, x - colliders[c].position);
}

// Distance and outward normal, in the world, of a point at `p` in the body's frame.
fn surface_at(c: u32, p: vec3f) -> Surface {
    let local = surface(colliders[c].kind, colliders[c].size, p);
    return Surface(transform(colliders[c].axes, local.normal), local.distance);
}

// Distance and outward normal at the end of the step.
fn surface_after(c: u32, x: vec3f) -> Surface {
    let r = x - colliders[c].position - colliders[c].shift;
    let turn = turn_of(c);
    let turned = surface_at(c, transform_transposed(colliders[c].axes, transform_transposed(turn, r) + r));
    return Surface(transform(turn, turned.normal) + turned.normal, turned.distance);
}

// Displacement of the body's material at `x` in the step.
fn body_motion(c: u32, x: vec3f) -> vec3f {
    return colliders[c].shift + transform(turn_of(c), x - colliders[c].position);
}

// The effect of a body on a point.
struct Resolved {
    u: vec3f,
    touched: bool,
    // Whether it sticks to the body.
    stuck: bool,
}

// A point that moves by less than this neither meets the body visited last nor ends inside it. For convex bodies; 0 for
// others.
var<private> margin: f32;
// The least of all bodies in reach.
var<private> clearance: f32;

// Whether a node does not slip, even where it leaves the body: for a body that matter sticks to, a node within its
// `sticky` distance.
fn sticks(distance: f32, friction: f32) -> bool {
    return fill >= 0.0 && friction >= STICKING && distance <= sticky;
}

// The friction outside a body. Nodes stick by their distance alone (`sticks`), but those of sand and clay also where
// they are pressed.
fn friction_outside(friction: f32) -> f32 {
    return select(friction, 0.0, fill >= 0.0 && friction >= STICKING && !grips);
}

// What friction leaves of a tangential motion, where `stopped` was removed from the motion along the normal.
fn rubbed(tangent: vec3f, stopped: f32, friction: f32) -> vec3f {
    if friction > 0.0 {
        let slip = sqrt(dot3(tangent, tangent));
        return tangent * select(0.0, 1.0 - friction * stopped / slip, slip > friction * stopped);
    }
    return tangent;
}

#if CONTAINERS
// In a container, a particle may end no nearer to any of the walls than its level (`level_of`), and a node may move no
// farther along the normal.
fn resolve_inside(c: u32, x: vec3f, u: vec3f, friction: f32) -> Resolved {
    let kind = colliders[c].kind;
    let size = colliders[c].size;
    let axes = colliders[c].axes;
    let turn = turn_of(c);
    let r = x - colliders[c].position;
    let start = transform_transposed(axes, r);
    let of_node = fill >= 0.0;
    var relative = vec3f();
    if of_node {
        relative = transform_transposed(axes, u - body_motion(c, x));
    } else {
        let to = r + (u - colliders[c].shift);
        relative = transform_transposed(axes, transform_transposed(turn, to) + to) - start;
    }
    var touched = false;
    var stuck = false;
    for (var wall = 0u; wall < wall_count(kind); wall++) {
        let before = wall_surface(kind, wall, size, start);
        var normal = before.normal;
        var along = dot3(relative, normal);
        var after = before.distance + along;
        if !of_node {
            let end = wall_surface(kind, wall, size, start + relative);
            normal = end.normal;
            along = dot3(relative, normal);
            after = end.distance;
        }
        let level = level_of(before.distance);
        let stopped = level - after;
        if stopped > 0.0 {
            let tangent = rubbed(relative - normal * along, stopped, friction_outside(friction));
            relative = tangent + normal * (along + stopped);
            touched = true;
        }
        if sticks(before.distance, friction) {
            relative = normal * max(along, level - before.distance);
            touched = true;
            stuck = true;
        }
    }
    if !touched {
        return Resolved(u, false, false);
    }
    let turned = transform(axes, relative);
    if of_node {
        return Resolved(body_motion(c, x) + turned, true, stuck);
    }
    return Resolved(body_motion(c, x) + (transform(turn, turned) + turned), true, stuck);
}
#endif

// Relative to the body, a point may move against the normal up to its level (`level_of`), a node on its way around an
// edge beyond that.
fn resolve(block: u32, c: u32, x: vec3f, u: vec3f, friction: f32) -> Resolved {
#if MESHES
    if is_grid(colliders[c].kind) {
        margin = 0.0;
        return resolve_swept(block, c, x, u, friction);
    }
#endif
#if CONTAINERS
    if is_inverted(colliders[c].kind) {
        margin = 0.0;
        return resolve_inside(c, x, u, friction);
    }
#endif
    var p = frame(c, x);
#if BOXES
    var beyond = false;
    if colliders[c].joints != 0u {
        let beside = joint(c, p);
        p = beside.at;
        beyond = beside.beyond;
    }
#endif
    var at = surface_at(c, p);
    let body = body_motion(c, x);
    margin = at.distance - sqrt(dot3(body, body));
#if BOXES
    if beyond {
        at.distance = FAR_BEHIND;
    }
#endif
    if friction >= FIXED {
        let inside = at.distance <= ON_SURFACE;
        return Resolved(select(u, body, inside), inside, inside);
    }
    var normal = at.normal;
    var seen = normal;
    var level = level_of(at.distance);
    var seam = Seam(false, false);
    if fill >= 0.0 {
#if BOXES
        let side = node_side(c, p, at, u - body);
        normal = side.normal;
        seen = side.seen;
        level = max(level - side.around, min(level, 0.0));
#endif
        if first_look && at.distance <= SEAM {
            filled += fills(c, p, at.distance);
        }
        seam = seam_at(Surface(seen, at.distance), SEAM);
    }
    var relative = u - body;
    let along = dot3(relative, normal);
    let gap = at.distance - level;
    let stopped = -gap - along;
    var touched = stopped > 0.0;
    if touched {
        relative = rubbed(relative - normal * along, stopped, friction_outside(friction)) - normal * gap;
    }
    var stuck = sticks(at.distance, friction);
    if stuck {
        relative = normal * max(along, -gap);
        touched = true;
    }
#if EDGES
    if fill >= 0.0 && (at.distance < -ON_SURFACE || seam.between) && wall_count(colliders[c].kind) > 1u {
        let beside = resolve_sides(c, p, at.distance, seam, gap, relative, friction);
        relative = select(relative, beside.u, beside.touched);
        touched |= beside.touched;
        stuck |= beside.stuck;
    }
#endif
#if BOXES
    if fill >= 0.0 && parts {
        let away = behind_thin(c, p, at.distance);
        let leaving = dot3(relative, away);
        if leaving > 0.0 {
            relative = relative - away * leaving;
            touched = true;
        }
    }
#endif
    if !touched {
        return Resolved(u, false, false);
    }
    return Resolved(body + relative, true, stuck);
}

// Bodies in reach of a block that have not been visited: the bits of one word, and whether there are any in later
// words. None are left where no bit is set.
struct Reach {
    word: u32,
    bits: u32,
}

// The first word of a block, from this one on, that has any.
fn reach_from(block: u32, word: u32) -> Reach {
    var reach = Reach(word, cull_word(block * constants.cull_words + word));
    while reach.bits == MORE {
        reach.word++;
        reach.bits = cull_word(block * constants.cull_words + reach.word);
    }
    return reach;
}

fn first_in(reach: Reach) -> u32 {
    return reach.word * BODIES_PER_WORD + firstTrailingBit(reach.bits);
}

fn without_first(block: u32, reach: Reach) -> Reach {
    let bits = reach.bits & (reach.bits - 1u);
    if bits == MORE {
        return reach_from(block, reach.word + 1u);
    }
    return Reach(reach.word, bits);
}

// Points are pushed out of a mesh piece by piece, so that one visit may not suffice.
fn is_by_pieces(c: u32) -> bool {
#if MESHES
    return is_grid(colliders[c].kind);
#else
    return false;
#endif
}

// `u` kept out of all bodies in reach of `block`.
fn resolve_all(block: u32, x: vec3f, start: vec3f, friction: u32) -> vec3f {
    var u = start;
    clearance = FAR;
    within = Surface(vec3f(0.0), 0.0);
    within_before = within;
    slack_within = 0.0;
    slack_before = 0.0;
    filled = 0.0;
    first_look = true;
    at_seam = false;
    let all = reach_from(block, 0u);
    if all.bits == 0u {
        return u;
    }
    var first = Stop(false, vec3f(0.0), 0.0, 0.0, 0u);
    // Full nodes and nodes at a seam are held up to this distance from bodies.
    let ahead = select(ROUNDING + CLEARANCE, BESIDE_SEAM, fill >= 0.0);
    // Bodies of the first word that the point may touch once others have changed its motion; `beyond` is the least
    // margin of the rest.
    var close = 0u;
    var beyond = FAR;
    var last = NONE_TOUCHED;
    var touched = false;
    var sweep = 0u;
    var reach = all;
    loop {
        let c = first_in(reach);
        let resolved = resolve(block, c, x, u, friction_of(c, friction));
#if SEES_ROOM
        see_room(c, x);
#endif
        let before = u;
        // What this body alone leaves.
        var kept = resolved.u;
        u = resolved.u;
        if resolved.touched && fill >= 0.0 && !is_by_pieces(c) && friction_of(c, friction) <= 0.0 {
            let second = stop_of(c, before, u);
            let together = corner(before, first, second);
            if together.at {
                u = together.u;
                kept = before + second.normal * together.second;
#if LOADS
                if colliders[first.body].load != NO_LOAD {
                    note_load(first.body, block, x, before - (before + first.normal * together.more));
                }
#endif
            }
            if second.known {
                first = second;
            }
        }
#if LOADS
        if resolved.touched && colliders[c].load != NO_LOAD {
            note_load(c, block, x, before - kept);
        }
#endif
#if HOLDS
        if resolved.touched {
            hold(c, kept - before, kept, kept - body_motion(c, x), resolved.stuck);
        }
#endif
        let speed = sqrt(dot3(u, u)) + ahead;
        clearance = min(clearance, margin);
        if margin <= speed {
            close |= reach.bits & (~reach.bits + 1u);
        } else {
            beyond = min(beyond, margin);
        }
        if resolved.touched {
            touched = true;
            last = select(c, NONE_TOUCHED, is_by_pieces(c));
        }
        reach = without_first(block, reach);
        if reach.bits == 0u && (touched || at_seam) && sweep + 1u < SWEEPS {
            sweep++;
            touched = false;
            first_look = false;
            reach = all;
            if all.bits < MORE && speed < beyond {
                reach.bits = close;
            }
        }
        // Nothing has changed since the body was last visited.
        let unchanged = first_in(reach) == last && !is_in_several();
        if reach.bits == 0u || unchanged {
            break;
        }
    }
    return u;
}
