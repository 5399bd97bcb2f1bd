// Adds momentum to a node, apart from its mass. For scatter_tile and scatter_grid. Needs the binding force.

fn add_to_node(node: u32, sum: vec4i) {
    let word = 4u * node;
    atomicAdd(&force[word], u32(sum.x));
    atomicAdd(&force[word + 1u], u32(sum.y));
    atomicAdd(&force[word + 2u], u32(sum.z));
}
