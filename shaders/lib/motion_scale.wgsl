// Scale of the nodes' motion in the sums that the solve's changes are compared with: of what particles bring to nodes, or
// gravity's kick, about 1 remains. Twin: src/cpu/solve.rs. Needs force_scale and the bindings constants and counters.
fn motion_scale() -> f32 {
    let kick = abs(constants.kick);
    let largest = bitcast<f32>(atomicLoad(&counters.largest_motion));
    return inverse(max(largest, max(max(kick.x, kick.y), kick.z)), LEAST_MOTION);
}
