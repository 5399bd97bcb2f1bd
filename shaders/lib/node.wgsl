// A node's displacement from its sums, without boundaries. Twin: `Free` in src/stages/grid_update.rs. Needs linear,
// bins, bound and the bindings constants, blocks, counters, tools.
#import node_position
#if TOOLS
#import tool
#endif

// Displacement and mass of a node that has mass. Gravity and tools act if they `enter`.
fn free_node(sum: vec4u, block: u32, node: u32, scale: f32, enter: bool) -> vec4f {
    let mass = f32(sum.w);
    if (sum.w & 0x80000000u) != 0u {
        atomicAdd(&counters.saturated_nodes, 1u);
    }
    let unit = constants.mass_scale / scale / mass;
    var u = vec3f(bitcast<vec3i>(sum.xyz)) * unit;
    if enter {
        u += constants.kick;
#if TOOLS
        u = wielded(node_position(block, node), u);
#endif
    }
    return vec4f(u, mass / constants.mass_scale);
}
