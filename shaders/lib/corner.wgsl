// Nodes that are stopped by two bodies which meet at an angle. Twin: src/stages/corner.rs. Needs linear.

// The effect of a body without friction on a node.
struct Stop {
    // Whether it has stopped the node.
    known: bool,
    normal: vec3f,
    by: f32,
    // The least motion along the normal that it allows.
    allowed: f32,
    body: u32,
}

// The effect of two bodies on a node together.
struct Corner {
    // Whether both stop the node.
    at: bool,
    u: vec3f,
    // How much the first stops in addition, along its normal, and how much the second stops.
    more: f32,
    second: f32,
}

// The effect of a body that has changed the motion `before` into `after`.
fn stop_of(body: u32, before: vec3f, after: vec3f) -> Stop {
    let change = after - before;
    let by = sqrt(dot3(change, change));
    let least = max(sqrt(dot3(after, after)) * LEAST_SHARE, LEAST_CHANGE);
    let normal = change * (1.0 / max(by, LEAST_CHANGE));
    return Stop(least < by, normal, by, dot3(normal, after), body);
}

// The effect of both on a node with the motion `u`, which `first` has stopped already and `second` is about to stop.
fn corner(u: vec3f, first: Stop, second: Stop) -> Corner {
    let cosine = dot3(first.normal, second.normal);
    let square = 1.0 - cosine * cosine;
    let at = first.known && second.known && TOGETHER < cosine && APART < square;
    let free = u - first.normal * first.by;
    let a = first.allowed - dot3(first.normal, free);
    let b = second.allowed - dot3(second.normal, free);
    let inverse = 1.0 / max(square, APART);
    let both_a = (a - cosine * b) * inverse;
    let both_b = (b - cosine * a) * inverse;
    // Where one of them would have to pull, the other acts alone.
    let only_a = both_b <= 0.0;
    let only_b = both_a <= 0.0;
    let by_a = select(select(both_a, max(a, 0.0), only_a), 0.0, only_b);
    let by_b = select(select(both_b, max(b, 0.0), only_b), 0.0, only_a);
    let together = free + first.normal * by_a + second.normal * by_b;
    return Corner(at, together, by_a - first.by, by_b);
}
