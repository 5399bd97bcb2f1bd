// Finds the pressures of blocks, by conjugate gradients. Twin: src/stages/block_solve.rs.
#import layout
#import active
#import idle
#import bins
#import force_scale
#import sum64
#import couplings

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> couplings: array<vec4u>;
@group(0) @binding(2) var<storage, read_write> block_sums: array<BlockSumsView>;
@group(0) @binding(3) var<storage, read_write> block_pressures: array<BlockPressure>;
@group(0) @binding(4) var<storage, read_write> chunks: array<Chunk>;
@group(0) @binding(5) var<storage, read_write> solve: Solve;
@group(0) @binding(6) var<storage, read_write> counters: Counters;
#if SLEEP
@group(0) @binding(7) var<storage, read> blocks: array<Block>;
#endif

// The invocations of the workgroup meet in this many places, and then in one: all at the same would take turns.
const PLACES = 32u;

var<workgroup> largest: array<atomic<u32>, PLACES + 1u>;
var<workgroup> sums_low: array<atomic<u32>, PLACES + 1u>;
var<workgroup> sums_high: array<atomic<u32>, PLACES + 1u>;
var<workgroup> known: f32;

// The largest number that this invocation has seen, and its part of a sum.
var<private> most: f32;
var<private> part: vec2u;

fn begin_largest(lane: u32) {
    workgroupBarrier();
    for (var i = lane; i <= PLACES; i += LANES) {
        atomicStore(&largest[i], 0u);
        atomicStore(&sums_low[i], 0u);
        atomicStore(&sums_high[i], 0u);
    }
    most = 0.0;
    part = vec2u(0u);
    workgroupBarrier();
}

// The largest number that any invocation has seen.
fn end_largest(lane: u32) -> f32 {
    atomicMax(&largest[lane % PLACES], bitcast<u32>(most));
    workgroupBarrier();
    for (var i = lane; i < PLACES; i += LANES) {
        atomicMax(&largest[PLACES], atomicLoad(&largest[i]));
    }
    workgroupBarrier();
    if lane == 0u {
        known = bitcast<f32>(atomicLoad(&largest[PLACES]));
    }
    return workgroupUniformLoad(&known);
}

fn add_term(term: f32, unit: f32) {
    let whole = wide(term * unit * PRECISION);
    part = vec2u(part.x + whole.x, part.y + carried(part.x, whole));
}

fn add_part(place: u32, value: vec2u) {
    let high = carried(atomicAdd(&sums_low[place], value.x), value);
    if high != 0u {
        atomicAdd(&sums_high[place], high);
    }
}

fn end_sum(lane: u32, unit: f32) -> f32 {
    add_part(lane % PLACES, part);
    workgroupBarrier();
    for (var i = lane; i < PLACES; i += LANES) {
        add_part(PLACES, vec2u(atomicLoad(&sums_low[i]), atomicLoad(&sums_high[i])));
    }
    workgroupBarrier();
    if lane == 0u {
        let sum = unscaled(atomicLoad(&sums_low[PLACES]), atomicLoad(&sums_high[PLACES]));
        known = sum * (1.0 / PRECISION) * (1.0 / unit);
    }
    return workgroupUniformLoad(&known);
}

fn sum_at(block: u32, which: u32) -> f32 {
    return unscaled(block_sums[block].sums[2u * which], block_sums[block].sums[2u * which + 1u])
        * (1.0 / BLOCK_SCALE);
}

// The initial state of the solve for a block, without the effect of motion.
fn begun(b: u32, highest: f32) -> BlockPressure {
    let volume = sum_at(b, 0u);
    let ratio = sum_at(b, 1u);
    let raised = sum_at(b, 2u) * (1.0 / inverse(highest, LEAST_PRESSURE));
    let softest = bitcast<f32>(block_sums[b].softest);
    let firmest = bitcast<f32>(block_sums[b].firmest);
    for (var i = 0u; i < 6u; i++) {
        block_sums[b].sums[i] = 0u;
    }
    block_sums[b].softest = 0u;
    block_sums[b].firmest = 0u;
    if volume <= 0.0 || firmest <= 0.0 {
        return BlockPressure();
    }
    let compliance = 1.0 / firmest;
    let mean = ratio * (1.0 / volume);
    let excess = min(max(FILLED - mean, 0.0), MAX_ERROR + MAX_LOAD * compliance);
    let pressure = raised * (1.0 / volume) - highest;
    let share = softest * firmest;
    let carried_on = max(pressure - SLACK / softest, 0.0) * (share * (1.0 / (share + 1.0)));
    let bound = max(mean - PRESSED, 0.0) * (1.0 / softest);
    let load = min(carried_on, bound);
    if excess <= 0.0 && load <= 0.0 {
        return BlockPressure();
    }
    let residual = volume * (excess - compliance * load);
    return BlockPressure(residual, 0.0, 0.0, volume * compliance, 0.0, load, bound, volume);
}

fn coupled(n: u32, which: u32) -> vec4f {
    return bitcast<vec4f>(couplings[coupling_vector(n, which)]);
}

// Four times the sum of one number from each of the eight blocks of nodes that the tile of `b` reaches, which are
// spread over the vectors from `first` on.
fn sum_of_eight(b: u32, first: u32) -> f32 {
    let links = block_sums[b].links;
    var sum = coupled(links[0], first).x;
    sum += coupled(links[1], first).y;
    sum += coupled(links[2], first).z;
    sum += coupled(links[3], first).w;
    sum += coupled(links[4], first + 1u).x;
    sum += coupled(links[5], first + 1u).y;
    sum += coupled(links[6], first + 1u).z;
    sum += coupled(links[7], first + 1u).w;
    return 4.0 * sum;
}

// The same of the matrices' diagonals.
fn diagonal(b: u32) -> f32 {
    let links = block_sums[b].links;
    var sum = coupled(links[0], MATRIX).x;
    sum += coupled(links[1], MATRIX + 2u).x;
    sum += coupled(links[2], MATRIX + 3u).w;
    sum += coupled(links[3], MATRIX + 5u).y;
    sum += coupled(links[4], MATRIX + 6u).z;
    sum += coupled(links[5], MATRIX + 7u).z;
    sum += coupled(links[6], MATRIX + 8u).y;
    sum += coupled(links[7], MATRIX + 8u).w;
    return 4.0 * sum;
}

fn direction(source: u32) -> f32 {
    if source == NONE {
        return 0.0;
    }
    return block_pressures[source].direction;
}

fn directions(n: u32, which: u32) -> vec4f {
    let sources = couplings[coupling_vector(n, which)];
    return vec4f(direction(sources.x), direction(sources.y), direction(sources.z), direction(sources.w));
}

// A row of a matrix times a vector, both in two halves.
fn product(r: vec4f, s: vec4f, a: vec4f, b: vec4f) -> f32 {
    var sum = r.x * a.x;
    sum += r.y * a.y;
    sum += r.z * a.z;
    sum += r.w * a.w;
    sum += s.x * b.x;
    sum += s.y * b.y;
    sum += s.z * b.z;
    sum += s.w * b.w;
    return sum;
}

// Computes the effect of the directions at the nodes of a block; returns its product with them.
fn join(n: u32) -> f32 {
    let a = directions(n, SOURCES);
    let b = directions(n, SOURCES + 1u);
    let m0 = coupled(n, MATRIX);
    let m1 = coupled(n, MATRIX + 1u);
    let m2 = coupled(n, MATRIX + 2u);
    let m3 = coupled(n, MATRIX + 3u);
    let m4 = coupled(n, MATRIX + 4u);
    let m5 = coupled(n, MATRIX + 5u);
    let m6 = coupled(n, MATRIX + 6u);
    let m7 = coupled(n, MATRIX + 7u);
    let m8 = coupled(n, MATRIX + 8u);
    let low = vec4f(
        product(m0, m1, a, b),
        product(vec4f(m0.y, m2.xyz), vec4f(m2.w, m3.xyz), a, b),
        product(vec4f(m0.z, m2.y, m3.w, m4.x), vec4f(m4.yzw, m5.x), a, b),
        product(vec4f(m0.w, m2.z, m4.x, m5.y), vec4f(m5.zw, m6.xy), a, b),
    );
    let high = vec4f(
        product(vec4f(m1.x, m2.w, m4.y, m5.z), vec4f(m6.zw, m7.xy), a, b),
        product(vec4f(m1.y, m3.x, m4.z, m5.w), vec4f(m6.w, m7.zw, m8.x), a, b),
        product(vec4f(m1.z, m3.y, m4.w, m6.x), vec4f(m7.x, m7.w, m8.yz), a, b),
        product(vec4f(m1.w, m3.z, m5.x, m6.y), vec4f(m7.y, m8.x, m8.zw), a, b),
    );
    couplings[coupling_vector(n, IMAGES)] = bitcast<vec4u>(low);
    couplings[coupling_vector(n, IMAGES + 1u)] = bitcast<vec4u>(high);
    let work = 4.0 * max(product(low, high, a, b), 0.0);
    couplings[coupling_vector(n, WORK)].x = bitcast<u32>(work);
    return work;
}

fn squared(p: BlockPressure) -> f32 {
    return p.residual * (p.residual * p.inverse);
}

fn own(b: u32) -> f32 {
    return block_pressures[b].compliance * (block_pressures[b].direction * block_pressures[b].direction);
}

// The square of the residual, whose largest term is in `most`.
fn square_of(lane: u32, occupied: u32) -> f32 {
    let highest = end_largest(lane);
    let unit = inverse(highest, LEAST_SQUARE);
    for (var b = lane; b < occupied; b += LANES) {
        add_term(squared(block_pressures[b]), unit);
    }
    let sum = end_sum(lane, unit);
    return select(sum, 0.0, highest <= LEAST_SQUARE);
}

// The first block of nodes with mass of an invocation, from `n` on. Those passed over have no effect.
fn busy(n: u32, present: u32) -> u32 {
    return busy_among(n, present, LANES);
}

// The curvature along the directions of search: their product with their effect.
fn curvature_of(lane: u32, occupied: u32, present: u32) -> f32 {
    begin_largest(lane);
    for (var n = busy(lane, present); n < present; n = busy(n + LANES, present)) {
        most = max(most, join(n));
    }
    for (var b = lane; b < occupied; b += LANES) {
        most = max(most, own(b));
    }
    let highest = end_largest(lane);
    let unit = inverse(highest, LEAST_SQUARE);
    for (var n = busy(lane, present); n < present; n = busy(n + LANES, present)) {
        add_term(coupled(n, WORK).x, unit);
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
    begin_largest(lane);
    for (var b = lane; b < occupied; b += LANES) {
        var p = begun(b, highest);
        if p.volume > 0.0 {
            p.residual -= sum_of_eight(b, MOTIONS);
            p.inverse = 1.0 / (diagonal(b) + p.compliance);
            p.direction = p.residual * p.inverse;
        }
        block_pressures[b] = p;
        most = max(most, squared(p));
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
        begin_largest(lane);
        for (var b = lane; b < occupied; b += LANES) {
            var p = block_pressures[b];
            if p.volume > 0.0 {
                p.found += step * p.direction;
                p.residual -= step * (sum_of_eight(b, IMAGES) + p.compliance * p.direction);
                block_pressures[b].found = p.found;
                block_pressures[b].residual = p.residual;
            }
            most = max(most, squared(p));
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
