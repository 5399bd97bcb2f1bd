// Clears the table of blocks; their list is cleared by its count, in step_end. Twin: src/stages/bin_clear.rs.
#import layout
#import active

@group(0) @binding(0) var<storage, read> blocks: array<Block>;
@group(0) @binding(1) var<storage, read_write> table: array<TableEntryView>;
@group(0) @binding(2) var<storage, read_write> counters: Counters;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let count = active_blocks(arrayLength(&blocks));
    for (var b = id.x; b < count; b += groups.x * GROUP) {
        table[blocks[b].entry] = TableEntryView();
    }
}
