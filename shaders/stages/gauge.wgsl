// Finds the largest motion that particles bring to nodes. Twin: src/stages/gauge.rs.
#import layout
#if SLEEP
#import bins
#endif
#import halt
#import linear
#import bound_gradient
#import largest_motion

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read_write> counters: Counters;
#if SLEEP
@group(0) @binding(5) var<storage, read> bin: array<Place>;
#endif

@compute @workgroup_size(GROUP)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_motion(lane);
    let count = select(constants.particle_count, 0u, halted());
    for (var p = id.x; p < count; p += groups.x * GROUP) {
#if SLEEP
        if (bin[p].rest & ASLEEP) != 0u {
            continue;
        }
#endif
        if position[p].w > 0.0 {
            let g = gradient[p];
            let bounded = bounded_gradient(mat3x3f(g.x, g.y, g.z));
            // Few gradients exceed the bound; the others need not be written.
            if bounded.square >= constants.max_gradient * constants.max_gradient {
                gradient[p].x = bounded.d[0];
                gradient[p].y = bounded.d[1];
                gradient[p].z = bounded.d[2];
            }
            note_motion(displacement[p].xyz, bounded.d);
        }
    }
    end_motion(lane);
}
