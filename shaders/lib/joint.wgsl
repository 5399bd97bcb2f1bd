// Boxes that lie flush beside other bodies. Twin: src/stages/joint.rs. Needs the binding colliders.

// A point beside the joints of a box: where it is in its frame, as far as the box is concerned, and whether the box does
// not act on it.
struct Joint {
    at: vec3f,
    beyond: bool,
}

// The bit of a face, or of the edge between two.
fn face_bit(joints: u32, axis: u32, upper: vec3<bool>) -> bool {
    return (joints >> (2u * axis + u32(upper[axis])) & 1u) == 1u;
}

fn edge_bit(joints: u32, a: u32, b: u32, upper: vec3<bool>) -> bool {
    let first = min(a, b);
    let second = max(a, b);
    let edge = 4u * (first + second - 1u) + 2u * u32(upper[first]) + u32(upper[second]);
    return (joints >> (FIRST_EDGE + edge) & 1u) == 1u;
}

// Whether a point is beside the covered face on its side along `a`, and nearer to a flush surface than to others. `before`
// says how far it is before the faces on its side, `open` before those that nothing covers; `b` and `c` are the other
// axes.
fn beside_face(joints: u32, a: u32, b: u32, c: u32, upper: vec3<bool>, before: vec3f, open: vec3f) -> bool {
    let flush = select(edge_bit(joints, a, b, upper), edge_bit(joints, a, c, upper), open[b] < open[c]);
    let any_open = max(open[b], open[c]) > -FAR_BEHIND;
    return face_bit(joints, a, upper) && flush && any_open && abs(before[a]) <= KERNEL_REACH;
}

// A point that is `at` this place in the frame of a box with joints.
fn joint(body: u32, at: vec3f) -> Joint {
    let joints = colliders[body].joints;
    let size = colliders[body].size;
    let upper = at >= vec3f(0.0);
    let before = abs(at) - size;
    let covered = vec3<bool>(face_bit(joints, 0u, upper), face_bit(joints, 1u, upper), face_bit(joints, 2u, upper));
    let open = select(before, vec3f(-FAR_BEHIND), covered);
    let here = vec3<bool>(
        beside_face(joints, 0u, 1u, 2u, upper, before, open),
        beside_face(joints, 1u, 2u, 0u, upper, before, open),
        beside_face(joints, 2u, 0u, 1u, upper, before, open),
    );
    let deep = max(size - JOINT_DEPTH, vec3f(0.0));
    return Joint(select(at, select(-deep, deep, upper), here), any(here & (before > vec3f(0.0))));
}
