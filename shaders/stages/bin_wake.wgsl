// Notes which blocks are awake: those with particles that have not been at rest for long enough, those around them, and
// those that something disturbs. Twin: src/stages/bin_wake.rs.
//
// A workgroup takes a block, and wakes those around it where it is restless: that takes few look-ups where most rest.
#import layout
#import active
#import stretch
#import bins
#import neighbours
#import lookup
#import around
#import halt

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> disturbances: array<Disturbance, DISTURBANCES>;
@group(0) @binding(2) var<storage, read> blocks: array<Block>;
@group(0) @binding(3) var<storage, read_write> table: array<SharedTableEntry>;
@group(0) @binding(4) var<storage, read_write> counters: Counters;

fn disturbed(at: vec3u) -> bool {
    var found = false;
    for (var i = 0u; i < disturbances[0].count; i++) {
        let lo = disturbances[i].lo;
        let hi = disturbances[i].hi;
        // Where `lo` lies above `hi`, they go on at the other end of a periodic axis.
        found |= all(select((lo <= at) & (at <= hi), (lo <= at) | (at <= hi), hi < lo));
    }
    return found;
}

fn wake(entry: u32) {
    if entry != NONE && table[entry].count != 0u {
        atomicOr(&table[entry].unrest, WOKEN);
    }
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    if halted() {
        return;
    }
    let occupied = atomicLoad(&counters.occupied);
    let mine = stretch(group.x, groups.x, active_blocks(constants.max_blocks));
    for (var b = mine.first; b < min(mine.end, occupied); b++) {
        let entry = blocks[b].entry;
        let at = block_coordinates(blocks[b].key);
        if lane == 0u && disturbed(at) {
            atomicOr(&table[entry].unrest, WOKEN | DISTURBED);
        }
        let restless = (atomicLoad(&table[entry].unrest) & RESTLESS) != 0u;
        for (var n = lane; restless && n < AROUND; n += LANES) {
            wake(entry_around(at, n));
        }
    }
}
