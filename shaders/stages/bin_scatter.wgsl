// Writes the particles of each block into its range.
// Twin: src/stages/bin_scatter.rs.
#import layout
#import bins
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> bin: array<Place>;
@group(0) @binding(2) var<storage, read> table: array<TableEntryView>;
@group(0) @binding(3) var<storage, read> blocks: array<Block>;
@group(0) @binding(4) var<storage, read_write> order: array<u32>;
@group(0) @binding(5) var<storage, read_write> counters: Counters;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    for (var p = id.x; p < constants.particle_count; p += groups.x * GROUP) {
        let place = bin[p];
        if place.entry != NONE {
            order[blocks[table[place.entry].block].start + place.rank] = p;
        }
    }
}
