// Numbers the particles that may appear and the free slots, by groups. Twin: src/stages/emit_scan.rs.
//
// In place: the count of each group becomes the count of all groups before it. One workgroup does all, a tile at a
// time: neighbours read and write neighbouring words, and each invocation has a stretch of its own in the tile.
#import layout
#import halt
#import scan

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> vacancies: array<u32>;
@group(0) @binding(2) var<storage, read_write> counters: Counters;

// Odd, so that invocations at the same place of their stretches access different banks of the memory.
const STRETCH = 17u;
const TILE = STRETCH * GROUP;

var<workgroup> tile: array<u32, TILE>;

// Replaces the tile's numbers by the sums before each; returns the sum of all. The whole workgroup must call this.
fn number_tile(lane: u32, before: u32) -> u32 {
    workgroupBarrier();
    let first = lane * STRETCH;
    var own = 0u;
    for (var i = first; i < first + STRETCH; i++) {
        own += tile[i];
    }
    let all = sums(lane, own);
    var number = before + all.before;
    for (var i = first; i < first + STRETCH; i++) {
        let found = tile[i];
        tile[i] = number;
        number += found;
    }
    workgroupBarrier();
    return all.total;
}

// The same for `count` groups from `start` on.
fn number_groups(lane: u32, start: u32, count: u32) -> u32 {
    var total = 0u;
    for (var first = 0u; first < count; first += TILE) {
        for (var i = lane; i < TILE; i += GROUP) {
            tile[i] = 0u;
            if first + i < count {
                tile[i] = vacancies[start + first + i];
            }
        }
        total += number_tile(lane, total);
        for (var i = lane; i < TILE && first + i < count; i += GROUP) {
            vacancies[start + first + i] = tile[i];
        }
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(local_invocation_index) lane: u32) {
    let candidate_groups = (constants.candidate_count + GROUP - 1u) / GROUP;
    let may_appear = number_groups(lane, constants.slot_groups, candidate_groups);
    let emitted = min(may_appear, number_groups(lane, 0u, constants.slot_groups));
    if lane == 0u && !halted() {
        atomicAdd(&counters.emitted, emitted);
        atomicAdd(&counters.refused, may_appear - emitted);
        atomicAdd(&counters.withheld, constants.candidate_count - may_appear);
    }
}
