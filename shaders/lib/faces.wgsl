// Before which faces of bodies a particle lies. Twin: src/stages/faces.rs. Needs the bindings colliders and cull, and the
// library contact.

// What is noted for a particle at `x`, in 64ths beside the number of its material.
fn faces_beside(block: u32, x: vec3f) -> f32 {
    let nearest = floor(x + 0.5);
    var found = vec3u(0u);
    var reach = reach_from(block, 0u);
    loop {
        if reach.bits == 0u {
            break;
        }
        let c = first_in(reach);
        if colliders[c].faces != 0u {
            let axes = colliders[c].axes;
            let size = colliders[c].size;
            let position = colliders[c].position;
            let half = abs(axes[0]) * size.x + abs(axes[1]) * size.y + abs(axes[2]) * size.z;
            let lo = position - half;
            let hi = position + half;
            let inside = colliders[c].kind == (SHAPE_BOX | INVERTED);
            let above = select(hi, lo, inside);
            let below = select(lo, hi, inside);
            let beside = select(vec3<bool>(true), (lo <= x) & (x <= hi), colliders[c].kind == SHAPE_BOX);
            let squarely = beside.yzx & beside.zxy;
            let faces = (vec3u(colliders[c].faces) >> vec3u(0u, 2u, 4u)) & vec3u(ABOVE_FACE | BELOW_FACE);
            let on = squarely & ((faces & vec3u(ABOVE_FACE)) != vec3u(0u)) & (floor(above + 0.5) == nearest) & (above <= x);
            found = select(found, vec3u(ABOVE_FACE), on);
            let under = squarely & ((faces & vec3u(BELOW_FACE)) != vec3u(0u)) & (floor(below + 0.5) == nearest) & (x <= below);
            found = select(found, vec3u(BELOW_FACE), under);
        }
        reach = without_first(block, reach);
    }
    return f32(found.x | (found.y << 2u) | (found.z << 4u)) * (1.0 / 64.0);
}
