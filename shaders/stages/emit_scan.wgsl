// Gives the particles that may appear and the free slots their numbers. Twin: src/stages/emit_scan.rs.
//
// In place: whether a candidate may appear becomes how many may up to and with it, the free slots of a group become those
// of the groups before it. One workgroup does all, a tile at a time: neighbours read and write neighbouring words, and each invocation
// has a stretch of its own in the tile.
#import layout
#import halt
#import scan

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> accepted: array<u32>;
@group(0) @binding(2) var<storage, read_write> vacancies: array<u32>;
@group(0) @binding(3) var<storage, read_write> counters: Counters;

// Odd, so that invocations at the same place of their stretches are in different banks of the memory.
const STRETCH = 17u;
const TILE = STRETCH * GROUP;

var<workgroup> tile: array<u32, TILE>;

// Makes of the tile's numbers the sums up to each, with it or without; gives the sum of all. The whole workgroup has to ask.
fn number_tile(lane: u32, before: u32, with_own: bool) -> u32 {
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
        tile[i] = number + select(0u, found, with_own);
        number += found;
    }
    workgroupBarrier();
    return all.total;
}

fn number_accepted(lane: u32) -> u32 {
    let count = constants.candidate_count;
    var total = 0u;
    for (var first = 0u; first < count; first += TILE) {
        for (var i = lane; i < TILE; i += GROUP) {
            tile[i] = 0u;
            if first + i < count {
                tile[i] = accepted[constants.candidate_first + first + i];
            }
        }
        total += number_tile(lane, total, true);
        for (var i = lane; i < TILE && first + i < count; i += GROUP) {
            accepted[constants.candidate_first + first + i] = tile[i];
        }
    }
    return total;
}

fn number_vacancies(lane: u32) -> u32 {
    let count = constants.slot_groups;
    var total = 0u;
    for (var first = 0u; first < count; first += TILE) {
        for (var i = lane; i < TILE; i += GROUP) {
            tile[i] = 0u;
            if first + i < count {
                tile[i] = vacancies[first + i];
            }
        }
        total += number_tile(lane, total, false);
        for (var i = lane; i < TILE && first + i < count; i += GROUP) {
            vacancies[first + i] = tile[i];
        }
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn main(@builtin(local_invocation_index) lane: u32) {
    let may_appear = number_accepted(lane);
    let emitted = min(may_appear, number_vacancies(lane));
    if lane == 0u && !halted() {
        atomicAdd(&counters.emitted, emitted);
        atomicAdd(&counters.refused, may_appear - emitted);
        atomicAdd(&counters.withheld, constants.candidate_count - may_appear);
    }
}
