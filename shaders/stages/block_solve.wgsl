// Finds the pressures of blocks, by conjugate gradients. Twin: src/stages/block_solve.rs.
#import layout
#import active
#import bins
#import force_scale
#import wide

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> couplings: array<Coupling>;
@group(0) @binding(2) var<storage, read_write> block_pressures: array<BlockPressureView>;
@group(0) @binding(3) var<storage, read_write> chunks: array<Chunk>;
@group(0) @binding(4) var<storage, read_write> solve: Solve;
@group(0) @binding(5) var<storage, read_write> counters: Counters;

var<workgroup> largest: atomic<u32>;
var<workgroup> sums: array<atomic<u32>, 2>;
var<workgroup> known: f32;

// The largest number that this invocation has seen, and its part of a sum.
var<private> most: f32;
var<private> part: vec2u;

fn begin_largest(lane: u32) {
    workgroupBarrier();
    if lane == 0u {
        atomicStore(&largest, 0u);
        atomicStore(&sums[0], 0u);
        atomicStore(&sums[1], 0u);
    }
    most = 0.0;
    part = vec2u(0u);
    workgroupBarrier();
}

// The largest number that any invocation has seen.
fn end_largest(lane: u32) -> f32 {
    atomicMax(&largest, bitcast<u32>(most));
    workgroupBarrier();
    if lane == 0u {
        known = bitcast<f32>(atomicLoad(&largest));
    }
    return workgroupUniformLoad(&known);
}

fn add_term(term: f32, unit: f32) {
    let whole = wide(term * unit * 0x1p31f);
    part = vec2u(part.x + whole.x, part.y + carried(part.x, whole));
}

fn end_sum(lane: u32, unit: f32) -> f32 {
    let high = carried(atomicAdd(&sums[0], part.x), part);
    if high != 0u {
        atomicAdd(&sums[1], high);
    }
    workgroupBarrier();
    if lane == 0u {
        known = unscaled(atomicLoad(&sums[0]), atomicLoad(&sums[1])) * 0x1p-31f * (1.0 / unit);
    }
    return workgroupUniformLoad(&known);
}

fn sum_at(block: u32, which: u32) -> f32 {
    return unscaled(block_pressures[block].sums[2u * which], block_pressures[block].sums[2u * which + 1u])
        * (1.0 / BLOCK_SCALE);
}

// The initial state of the solve for a block, without the effect of motion.
fn begin(b: u32, highest: f32) {
    let mass = sum_at(b, 0u);
    let ratio = sum_at(b, 1u);
    let raised = sum_at(b, 2u) * (1.0 / inverse(highest, LEAST_PRESSURE));
    let softest = bitcast<f32>(block_pressures[b].softest);
    let firmest = bitcast<f32>(block_pressures[b].firmest);
    for (var i = 0u; i < 6u; i++) {
        block_pressures[b].sums[i] = 0u;
    }
    block_pressures[b].softest = 0u;
    block_pressures[b].firmest = 0u;
    block_pressures[b].mass = 0.0;
    block_pressures[b].load = 0.0;
    block_pressures[b].most = 0.0;
    block_pressures[b].found = 0.0;
    block_pressures[b].residual = 0.0;
    block_pressures[b].direction = 0.0;
    block_pressures[b].compliance = 0.0;
    block_pressures[b].inverse = 0.0;
    if mass <= 0.0 || firmest <= 0.0 {
        return;
    }
    let compliance = 1.0 / firmest;
    let mean = ratio * (1.0 / mass);
    let excess = min(max(FILLED - mean, 0.0), MAX_ERROR + MAX_LOAD * compliance);
    let pressure = raised * (1.0 / mass) - highest;
    let share = softest * firmest;
    let carried_on = max(pressure - SLACK / softest, 0.0) * (share * (1.0 / (share + 1.0)));
    let bound = max(mean - PRESSED, 0.0) * (1.0 / softest);
    let load = min(carried_on, bound);
    if excess <= 0.0 && load <= 0.0 {
        return;
    }
    block_pressures[b].mass = mass;
    block_pressures[b].load = load;
    block_pressures[b].most = bound;
    block_pressures[b].residual = mass * (excess - compliance * load);
    block_pressures[b].compliance = mass * compliance;
}

fn motion(b: u32) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < 8u; k++) {
        sum += couplings[block_pressures[b].links[k]].motion[k];
    }
    return 4.0 * sum;
}

fn diagonal(b: u32) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < 8u; k++) {
        sum += couplings[block_pressures[b].links[k]].matrix[9u * k];
    }
    return 4.0 * sum;
}

fn image(b: u32) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < 8u; k++) {
        sum += couplings[block_pressures[b].links[k]].image[k];
    }
    return 4.0 * sum;
}

fn direction(source: u32) -> f32 {
    if source == NONE {
        return 0.0;
    }
    return block_pressures[source].direction;
}

// Computes the effect of the directions at the nodes of a block.
fn join(n: u32) {
    var directions: array<f32, 8>;
    for (var k = 0u; k < 8u; k++) {
        directions[k] = direction(couplings[n].sources[k]);
    }
    var work = 0.0;
    for (var row = 0u; row < 8u; row++) {
        var sum = 0.0;
        for (var k = 0u; k < 8u; k++) {
            sum += couplings[n].matrix[8u * row + k] * directions[k];
        }
        couplings[n].image[row] = sum;
        work += sum * directions[row];
    }
    couplings[n].work = 4.0 * max(work, 0.0);
}

fn squared(b: u32) -> f32 {
    return block_pressures[b].residual * (block_pressures[b].residual * block_pressures[b].inverse);
}

fn own(b: u32) -> f32 {
    return block_pressures[b].compliance * (block_pressures[b].direction * block_pressures[b].direction);
}

// The square of the residual.
fn square_of(lane: u32, occupied: u32) -> f32 {
    begin_largest(lane);
    for (var b = lane; b < occupied; b += LANES) {
        most = max(most, squared(b));
    }
    let highest = end_largest(lane);
    let unit = inverse(highest, LEAST_SQUARE);
    for (var b = lane; b < occupied; b += LANES) {
        add_term(squared(b), unit);
    }
    let sum = end_sum(lane, unit);
    return select(sum, 0.0, highest <= LEAST_SQUARE);
}

// The curvature along the directions of search: their product with their effect.
fn curvature_of(lane: u32, occupied: u32, present: u32) -> f32 {
    begin_largest(lane);
    for (var n = lane; n < present; n += LANES) {
        join(n);
        most = max(most, couplings[n].work);
    }
    for (var b = lane; b < occupied; b += LANES) {
        most = max(most, own(b));
    }
    let highest = end_largest(lane);
    let unit = inverse(highest, LEAST_SQUARE);
    for (var n = lane; n < present; n += LANES) {
        add_term(couplings[n].work, unit);
    }
    for (var b = lane; b < occupied; b += LANES) {
        add_term(own(b), unit);
    }
    let sum = end_sum(lane, unit);
    return select(sum, 0.0, highest <= LEAST_SQUARE);
}

var<workgroup> counts: array<u32, 3>;

@compute @workgroup_size(LANES)
fn main(@builtin(local_invocation_index) lane: u32) {
    if lane == 0u {
        // In a step that is not taken there is nothing to do.
        let going_on = solve.going_on != 0u;
        counts[0] = select(0u, atomicLoad(&counters.occupied), going_on);
        counts[1] = select(0u, active_blocks(constants.max_blocks), going_on);
        counts[2] = select(0u, solve.chunks, going_on);
    }
    let occupied = workgroupUniformLoad(&counts[0]);
    let present = workgroupUniformLoad(&counts[1]);
    let highest = bitcast<f32>(atomicLoad(&solve.largest[PRESSURE]));
    for (var b = lane; b < occupied; b += LANES) {
        begin(b, highest);
        if block_pressures[b].mass > 0.0 {
            let residual = block_pressures[b].residual - motion(b);
            let inverse = 1.0 / (diagonal(b) + block_pressures[b].compliance);
            block_pressures[b].residual = residual;
            block_pressures[b].inverse = inverse;
            block_pressures[b].direction = residual * inverse;
        }
    }
    storageBarrier();
    var square = square_of(lane, occupied);
    let least = square * LEFT;
    for (var round = 0u; round < ROUNDS; round++) {
        if square <= least {
            break;
        }
        let curvature = curvature_of(lane, occupied, present);
        if curvature <= 0.0 {
            break;
        }
        let step = square * (1.0 / curvature);
        storageBarrier();
        for (var b = lane; b < occupied; b += LANES) {
            if block_pressures[b].mass > 0.0 {
                let moved = image(b) + block_pressures[b].compliance * block_pressures[b].direction;
                block_pressures[b].found += step * block_pressures[b].direction;
                block_pressures[b].residual -= step * moved;
            }
        }
        let next = square_of(lane, occupied);
        let mix = next * (1.0 / square);
        square = next;
        for (var b = lane; b < occupied; b += LANES) {
            block_pressures[b].direction =
                block_pressures[b].residual * block_pressures[b].inverse + mix * block_pressures[b].direction;
        }
        storageBarrier();
    }
    begin_largest(lane);
    for (var b = lane; b < occupied; b += LANES) {
        let load = block_pressures[b].load;
        let whole = max(min(load + block_pressures[b].found, block_pressures[b].most), 0.0);
        block_pressures[b].found = whole - load;
        most = max(most, abs(whole - load));
    }
    let found = end_largest(lane);
    if lane == 0u {
        solve.pressure_bound = found;
    }
    storageBarrier();
    for (var c = lane; c < counts[2]; c += LANES) {
        chunks[c].load = block_pressures[chunks[c].block].load;
        chunks[c].found = block_pressures[chunks[c].block].found;
    }
}
