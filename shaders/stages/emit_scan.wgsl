// Gives the particles that may appear and the free slots their numbers. Twin: src/stages/emit_scan.rs.
//
// In place: whether a candidate may appear becomes how many may up to and with it, the free slots of a group become those
// of the groups before it. One workgroup does all; each invocation has a stretch of its own.
#import layout
#import halt
#import scan

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> accepted: array<u32>;
@group(0) @binding(2) var<storage, read_write> vacancies: array<u32>;
@group(0) @binding(3) var<storage, read_write> counters: Counters;

// The lane's stretch of `count` items.
fn stretch(lane: u32, count: u32) -> vec2u {
    let share = (count + GROUP - 1u) / GROUP;
    return min(vec2u(lane, lane + 1u) * share, vec2u(count));
}

fn number_accepted(lane: u32) -> u32 {
    let range = stretch(lane, constants.candidate_count) + constants.candidate_first;
    var own = 0u;
    for (var c = range.x; c < range.y; c++) {
        own += accepted[c];
    }
    let all = sums(lane, own);
    var number = all.before;
    for (var c = range.x; c < range.y; c++) {
        number += accepted[c];
        accepted[c] = number;
    }
    return all.total;
}

fn number_vacancies(lane: u32) -> u32 {
    let range = stretch(lane, constants.slot_groups);
    var own = 0u;
    for (var g = range.x; g < range.y; g++) {
        own += vacancies[g];
    }
    let all = sums(lane, own);
    var number = all.before;
    for (var g = range.x; g < range.y; g++) {
        let free = vacancies[g];
        vacancies[g] = number;
        number += free;
    }
    return all.total;
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
