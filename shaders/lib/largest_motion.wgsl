// The largest displacement that a particle brings to a node, found in workgroup memory first. Twin: `largest` in
// src/stages/motion.rs. Needs linear and the bindings constants and counters. The whole workgroup must call begin and
// end.

var<private> largest_motion: f32;
var<workgroup> group_largest_motion: atomic<u32>;

fn begin_motion(lane: u32) {
    if lane == 0u {
        atomicStore(&group_largest_motion, 0u);
    }
    workgroupBarrier();
}

fn note_motion(u: vec3f, d: mat3x3f) {
    let speed = min(sqrt(dot3(u, u)), constants.max_displacement);
    let norm = dot3(d[0], d[0]) + dot3(d[1], d[1]) + dot3(d[2], d[2]);
    largest_motion = max(largest_motion, speed + FARTHEST * sqrt(norm));
}

// The bits of non-negative numbers are in the order of the numbers.
fn end_motion(lane: u32) {
    atomicMax(&group_largest_motion, bitcast<u32>(largest_motion));
    workgroupBarrier();
    if lane == 0u {
        atomicMax(&counters.largest_motion, atomicLoad(&group_largest_motion));
    }
}
