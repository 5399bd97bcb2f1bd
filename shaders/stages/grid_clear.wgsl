// Zeroes the nodes of the active blocks. Twin: src/stages/grid_clear.rs.
#import layout
#import active
#import stretch

@group(0) @binding(0) var<storage, read_write> grid: array<vec4u>;
@group(0) @binding(1) var<storage, read_write> counters: Counters;

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let count = active_blocks(arrayLength(&grid) / NODES);
    let mine = stretch(group.x, groups.x, count);
    for (var b = mine.first; b < mine.end; b++) {
        for (var node = lane; node < NODES; node += LANES) {
            grid[b * NODES + node] = vec4u(0u);
        }
    }
}
