// Puts each particle that appears into the free slot of the same number. Twin: src/stages/emit_place.rs.
#import layout
#import halt
#import slots
#import scan

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> candidates: array<Candidate>;
@group(0) @binding(2) var<storage, read> accepted: array<u32>;
@group(0) @binding(3) var<storage, read> vacancies: array<u32>;
@group(0) @binding(4) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> gradient: array<Gradient>;
#if DEFORMS
@group(0) @binding(7) var<storage, read_write> deformation: array<Deformation>;
#endif
@group(0) @binding(8) var<storage, read_write> counters: Counters;

// The accepted candidate with this number: the first of its group with this count, in the last group that has fewer
// before it.
fn candidate_of(number: u32) -> u32 {
    let count = constants.candidate_count;
    var first = 0u;
    var last = (count - 1u) / GROUP;
    while first < last {
        let middle = (first + last + 1u) / 2u;
        if vacancies[constants.slot_groups + middle] < number {
            first = middle;
        } else {
            last = middle - 1u;
        }
    }
    let in_group = number - vacancies[constants.slot_groups + first];
    var lower = constants.candidate_first + first * GROUP;
    var upper = constants.candidate_first + min(first * GROUP + GROUP, count) - 1u;
    while lower < upper {
        let middle = (lower + upper) / 2u;
        if accepted[middle] < in_group {
            lower = middle + 1u;
        } else {
            upper = middle;
        }
    }
    return lower;
}

fn place(candidate: u32, slot: u32) {
    let c = candidates[candidate];
    let t = c.turn;
    position[slot] = vec4f(c.position, 1.0);
    displacement[slot] = vec4f(c.displacement, 0.0);
    // Spin: the gradient of turn × position.
    gradient[slot] = Gradient(
        vec3f(0.0, t.z, 0.0 - t.y), c.mass,
        vec3f(0.0 - t.z, 0.0, t.x), c.material,
        vec3f(t.y, 0.0 - t.x, 0.0), 0.0,
    );
#if DEFORMS
    deformation[slot] =
        Deformation(vec4f(1.0, 0.0, 0.0, 0.0), vec4f(0.0, 1.0, 0.0, 0.0), vec4f(0.0, 0.0, 1.0, 0.0));
#endif
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let last = constants.candidate_count - 1u;
    let all = vacancies[constants.slot_groups + last / GROUP] + accepted[constants.candidate_first + last];
    let may_appear = select(all, 0u, halted());
    for (var g = group.x; g < constants.slot_groups; g += groups.x) {
        let first = (g * GROUP + lane) * SLOTS;
        var number = vacancies[g] + sums(lane, free_slots(first)).before;
        for (var slot = first; slot < first + SLOTS && number < may_appear; slot++) {
            if is_free(slot) {
                number += 1u;
                place(candidate_of(number), slot);
            }
        }
    }
}
