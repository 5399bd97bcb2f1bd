// Boxes that lie flush beside other bodies. Twin: src/stages/joint.rs. Needs the binding colliders.

// A point beside the joints of a box: where it is in its frame, as far as the box is concerned, and whether the box does
// not act on it.
struct Joint {
    at: vec3f,
    beyond: bool,
}

// The bit of a face, or of the edge between two.
fn face_bit(joints: u32, axis: u32, upper: vec3<bool>) -> bool {
    return ((joints >> (2u * axis + u32(upper[axis]))) & 1u) == 1u;
}

fn edge_bit(joints: u32, a: u32, b: u32, upper: vec3<bool>) -> bool {
    let first = min(a, b);
    let second = max(a, b);
    let edge = 4u * (first + second - 1u) + 2u * u32(upper[first]) + u32(upper[second]);
    return ((joints >> (FIRST_EDGE + edge)) & 1u) == 1u;
}

// Whether a point beside the face on its side along `a` is nearer to a flush surface than to others. `open` says how far
// it is before the faces on its side that nothing covers; `b` and `c` are the other axes.
fn is_flush(joints: u32, a: u32, b: u32, c: u32, upper: vec3<bool>, open: vec3f) -> bool {
    let flush = select(edge_bit(joints, a, b, upper), edge_bit(joints, a, c, upper), open[b] < open[c]);
    return flush && max(open[b], open[c]) > -FAR_BEHIND;
}

// A point that is `at` this place in the frame of a box with joints.
fn joint(body: u32, at: vec3f) -> Joint {
    let joints = colliders[body].joints;
    let size = colliders[body].size;
    let upper = at >= vec3f(0.0);
    let before = abs(at) - size;
    let covered = vec3<bool>(face_bit(joints, 0u, upper), face_bit(joints, 1u, upper), face_bit(joints, 2u, upper));
    let open = select(before, vec3f(-FAR_BEHIND), covered);
    let flush = vec3<bool>(
        is_flush(joints, 0u, 1u, 2u, upper, open),
        is_flush(joints, 1u, 2u, 0u, upper, open),
        is_flush(joints, 2u, 0u, 1u, upper, open),
    );
    let here = covered & flush & (abs(before) <= vec3f(KERNEL_REACH));
    let deep = max(size - JOINT_DEPTH, vec3f(0.0));
    return Joint(select(at, select(-deep, deep, upper), here), any(here & (before > vec3f(0.0))));
}
