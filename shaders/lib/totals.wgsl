// A stage's sums and maxima for the solve, in workgroup memory first, so that few add to the same words at a time.
// Twin: `Totals` and `Largest` in src/cpu/par.rs. Needs sum64 and the binding solve. The whole workgroup must call begin
// and end.

var<workgroup> group_largest: array<atomic<u32>, LARGEST>;
var<workgroup> group_sums: array<atomic<u32>, SUM_WORDS>;

// The first word of the sums that an invocation looks after: there are as few as FEWEST_LANES.
fn first_word(lane: u32) -> u32 {
    return select(SUM_WORDS, 2u * lane, lane < FEWEST_LANES);
}

fn begin_totals(lane: u32) {
    if lane < LARGEST {
        atomicStore(&group_largest[lane], 0u);
    }
    for (var word = first_word(lane); word < SUM_WORDS; word += 2u * FEWEST_LANES) {
        atomicStore(&group_sums[word], 0u);
        atomicStore(&group_sums[word + 1u], 0u);
    }
    workgroupBarrier();
}

// The bits of non-negative numbers are in the order of the numbers.
fn note_largest(which: u32, value: f32) {
    atomicMax(&group_largest[which], bitcast<u32>(value));
}

fn note_sum(which: u32, sum: vec2u) {
    let high = carried(atomicAdd(&group_sums[which], sum.x), sum);
    if high != 0u {
        atomicAdd(&group_sums[which + 1u], high);
    }
}

fn end_totals(lane: u32) {
    workgroupBarrier();
    if lane < LARGEST {
        let value = atomicLoad(&group_largest[lane]);
        // Most stages note few of the maxima; 0 changes nothing.
        if value != 0u {
            atomicMax(&solve.largest[lane], value);
        }
    }
    for (var word = first_word(lane); word < SUM_WORDS; word += 2u * FEWEST_LANES) {
        let sum = vec2u(atomicLoad(&group_sums[word]), atomicLoad(&group_sums[word + 1u]));
        if any(sum != vec2u(0u)) {
            let high = carried(atomicAdd(&solve.sums[word], sum.x), sum);
            if high != 0u {
                atomicAdd(&solve.sums[word + 1u], high);
            }
        }
    }
}
