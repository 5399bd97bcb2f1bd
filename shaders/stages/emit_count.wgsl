// Counts the free slots, group by group. Twin: src/stages/emit_count.rs.
#import layout
#import slots
#import scan

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> vacancies: array<u32>;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    for (var g = group.x; g < constants.slot_groups; g += groups.x) {
        let free = sums(lane, free_slots((g * GROUP + lane) * SLOTS));
        if lane == 0u {
            vacancies[g] = free.total;
        }
    }
}
