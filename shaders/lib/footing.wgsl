// How meshes stand on other bodies: beside these, a mesh is queried from a place as far off them as the rounding of its
// edges reaches. Twin: src/stages/footing.rs. Needs the bindings colliders and distance_grids, and contact.

// The place, in the world, from which a point at `x` in a block queries the mesh `c`.
fn off_others(block: u32, c: u32, x: vec3f) -> vec3f {
    let spacing = distance_grids[u32(colliders[c].size.x)].spacing;
    let off = min(ROUNDED * spacing, FARTHEST_OFF);
    let most = off + off;
    var by = vec3f(0.0);
    var reach = reach_from(block, 0u);
    while reach.bits != 0u {
        let other = first_in(reach);
        reach = without_first(block, reach);
        if other != c {
            let at = surface_at(other, frame(other, x));
            by += at.normal * min(max(off - at.distance, 0.0), most);
        }
    }
    return x + max(min(by, vec3f(most)), vec3f(-most));
}
