// What liquids before the domain's closed sides see of a strain across them. Twin: src/stages/walls.rs.
// Needs the binding constants.

// The inverses of the shares that a particle sees along the axes: 2 (½ + d)² (1 − d) at a distance d < ½ from a side.
fn wall_factors(at: vec3f) -> vec3f {
    let open = vec3u(constants.open_sides) >> vec3u(0u, 2u, 4u);
    let lo = floor(constants.lo + 0.5);
    let hi = floor(constants.hi + 0.5);
    let between = abs(hi - constants.hi) > vec3f(ON_NODES);
    let below = select(at - lo, vec3f(1.0), (open & vec3u(1u)) != vec3u(0u));
    let above = select(hi - at, vec3f(1.0), ((open & vec3u(2u)) != vec3u(0u)) | between);
    let distance = max(min(below, above), vec3f(0.0));
    let reach = 0.5 + distance;
    let near = distance < vec3f(0.5);
    let seen = 2.0 * reach * reach * (1.0 - distance);
    return select(vec3f(1.0), 1.0 / select(vec3f(1.0), seen, near), near);
}
