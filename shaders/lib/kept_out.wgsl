// Contact of nodes with bodies, and their drag. Twin: `contact_and_drag` in src/stages/grid_update.rs. Needs contact,
// what that needs, node_position, and where viscous liquids stick to bodies the binding materials.
#if STICKS
#import drag
#endif

// The displacement `u` of a node of this mass, kept out of the bodies in reach of its block.
fn kept_out(block: u32, node: u32, mass: f32, u: vec3f, friction: u32) -> vec3f {
    let x = node_position(block, node);
    fill_node(block, node, x, mass);
    var kept = resolve_all(block, x, u, friction);
#if STICKS
    let slower = braked(block, x, kept);
    if is_braked {
        // The drag of one body may push the node into another.
        kept = resolve_all(block, x, slower, friction);
    }
#endif
    return kept;
}
