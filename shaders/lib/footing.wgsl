// How meshes stand on other bodies: their edges, which are rounded, are looked at from as far off the others as the rounding reaches.
// Twin: src/stages/footing.rs. Needs the bindings colliders and distance_grids, and contact.

// Where a point at `x` in a block looks at the mesh `c`, in the world.
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
