// What liquids before the domain's closed sides, and before faces of bodies, see of a strain across them. Twin:
// src/stages/walls.rs.
// Needs the binding constants and the library gradient.

// The inverses of the shares that a particle sees along the axes: 2 (½ + d)² (1 − d) at a distance d < ½ from a side
// or a face. `material` is the number of the particle's material, with the faces noted beside it.
fn wall_factors(at: vec3f, material: f32) -> vec3f {
    let open = vec3u(constants.open_sides) >> vec3u(0u, 2u, 4u);
    let lo = floor(constants.lo + 0.5);
    let hi = floor(constants.hi + 0.5);
    let between = abs(hi - constants.hi) > vec3f(ON_NODES);
    var below = select(at - lo, vec3f(1.0), (open & vec3u(1u)) != vec3u(0u));
    var above = select(hi - at, vec3f(1.0), ((open & vec3u(2u)) != vec3u(0u)) | between);
#if FACES
    let faces = (vec3u(u32(beside_of(material) * 64.0)) >> vec3u(0u, 2u, 4u)) & vec3u(ABOVE_FACE | BELOW_FACE);
    let node = floor(at + 0.5);
    below = select(below, min(below, at - node), faces == vec3u(ABOVE_FACE));
    above = select(above, min(above, node - at), faces == vec3u(BELOW_FACE));
#endif
    let distance = max(min(below, above), vec3f(0.0));
    let reach = 0.5 + distance;
    let near = distance < vec3f(0.5);
    let seen = 2.0 * reach * reach * (1.0 - distance);
    return select(vec3f(1.0), 1.0 / select(vec3f(1.0), seen, near), near);
}
