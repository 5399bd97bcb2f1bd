// Advances the conjugate gradients by one step along the direction of search, and sums the effect of the next on the
// nodes. Twin: src/stages/seek.rs.
#import layout
#import gradient
#import bounded
#import takes_part
#import stretch
#import kernel
#import bins
#import cells
#import shares
#import gather
#import scatter
#import meet
#if TILES
#import gather_tile
#import scatter_tile
#else
#import rows
#import gather_grid
#import scatter_grid
#endif
#import add_force
#import force_scale
#import scales
#import sum64
#import totals
#import search
#import linear
#if TENSORS
#import symmetric
#endif
#if WALLS
#import walls
#endif
#if SOLIDS
#import compliance
#endif
#if CORRECTS_STRESS
#import corrected
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read_write> search: array<Sought>;
#if TELLS_MATERIALS
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
#endif
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(7) var<storage, read> field: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> force: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read_write> solve: Solve;

// Whether this is the first pass of a step, and whether it is the last, which sums the effect of the pressures
// themselves.
override FIRST: bool = false;
override LAST: bool = false;
// Pressures bring no mass.
const CHANNELS = 3u;

// The results of line, read once by each invocation.
struct Found {
    bound: f32,
    last_bound: f32,
    step: f32,
    mix: f32,
    count: u32,
}
var<private> line: Found;

// An invocation's sums and maxima over its particles.
var<private> square: vec2u;
var<private> answers: vec2u;
var<private> directions: vec2u;
var<private> both: vec2u;
var<private> largest_answer: f32;
var<private> largest_direction: f32;
var<private> largest_found: f32;

// The preconditioned residual: about the pressure that would cancel it.
fn answer(s: Search) -> f32 {
    return s.residual * response(s.compliance);
}

// The new part of the next direction of search, before the bound.
fn wanted(s: Search) -> f32 {
#if RESUMES
    if FIRST {
        return s.direction;
    }
#endif
    return answer(s);
}

// Takes the step along the direction of search, which changes the divergence by `divergence`; the first time, that is
// the divergence of the predicted motion.
fn sought(before: Search, divergence: f32) -> Search {
    var s = before;
    var image = divergence;
    var step = 1.0;
    if !FIRST {
        if line.count > RESUMED {
            s.direction = bounded(answer(s), line.last_bound) + s.direction * line.mix;
        }
        s.pressure += s.direction * line.step;
        image = divergence + s.compliance * s.direction;
        step = line.step;
    }
    // Particles that take no part have no compliance.
    s.residual = select(0.0, s.residual - image * step, s.compliance > 0.0);
    return s;
}

// A particle's parts of the sums, without its mass, and its largest numbers.
struct Parts {
    square: f32, // residual times answer
    compliant: vec3f, // compliance times the squares of answer, direction and both
    // Answer, direction and change found. The answer is the one before the bound, so that a cut one can be detected.
    most: vec3f,
}

fn parts(s: Search) -> Parts {
    let whole = wanted(s);
    let next = bounded(whole, line.bound);
    let all = vec3f(next, s.direction, next + s.direction);
    return Parts(s.residual * next, s.compliance * (all * all), abs(vec3f(whole, s.direction, s.pressure)));
}

#if TENSORS
fn shear_answer(s: Shear) -> Symmetric {
    return times(s.residual, response(s.compliance));
}

fn wanted_shear(s: Shear) -> Symmetric {
#if RESUMES
    if FIRST {
        return s.direction;
    }
#endif
    return shear_answer(s);
}

fn sheared(before: Shear, change: Symmetric) -> Shear {
    var s = before;
    var image = change;
    var step = 1.0;
    if !FIRST {
        if line.count > RESUMED {
            s.direction = sum_of(shortened(shear_answer(s), line.last_bound), times(s.direction, line.mix));
        }
        s.found = sum_of(s.found, times(s.direction, line.step));
        image = sum_of(change, times(s.direction, s.compliance));
        step = line.step;
    }
    s.residual = difference(s.residual, times(image, step));
    return s;
}

fn with_shear(mean: Parts, s: Shear) -> Parts {
    let whole = wanted_shear(s);
    let next = shortened(whole, line.bound);
    let both = sum_of(next, s.direction);
    let squares = vec3f(product(next, next), product(s.direction, s.direction), product(both, both));
    let sizes = sqrt(vec3f(product(whole, whole), product(s.direction, s.direction), product(s.found, s.found)));
    return Parts(mean.square + product(s.residual, next), mean.compliant + s.compliance * squares, max(mean.most, sizes));
}
#endif

fn note(parts: Parts, mass: f32, square_scale: f32, compliant_scale: f32) {
    let descent = mass * square_scale * parts.square;
    square = plus(square, descent);
    let compliant = mass * compliant_scale * parts.compliant;
    answers = plus(answers, compliant.x);
    directions = plus(directions, compliant.y);
    var last = compliant.z;
#if RESUMES
    // The stress carried over may go up, too: that is summed apart, as sums have no sign, in place of one that counts
    // only once directions mix.
    if FIRST {
        last = -descent;
    }
#endif
    both = plus(both, last);
    largest_answer = max(largest_answer, parts.most.x);
    largest_direction = max(largest_direction, parts.most.y);
    largest_found = max(largest_found, parts.most.z);
}

// Whether a particle is liquid, where not all are.
fn is_liquid(p: u32) -> bool {
#if SOLIDS
    return materials[material_of(gradient[p].material)].model == MODEL_LIQUID;
#else
    return true;
#endif
}

#if SHARES_PRESSURE
// A liquid's share of the pressure of its block.
fn lightness(p: u32) -> f32 {
#if TELLS_MATERIALS
    return materials[material_of(gradient[p].material)].lightness;
#else
    return 1.0;
#endif
}
#endif

#if CORRECTS_STRESS
// Whether only a particle's viscous stress is corrected, not its pressure: for a liquid.
fn pressure_apart(p: u32) -> bool {
#if STICKS
    return is_liquid(p);
#else
    return false;
#endif
}

fn correction(s: Shear) -> vec3f {
    return vec3f(s.correction_x, s.correction_y, s.correction_z);
}
#endif

// How many times more of a strain along the axes there is than particle `p` at `x` sees, where volume is concerned.
fn unseen(s: Sought, x: vec3f, p: u32) -> vec3f {
#if WALLS
#if TENSORS
    if s.shear.compliance > 0.0 {
        return vec3f(1.0);
    }
#endif
    return wall_factors(x, gradient[p].material);
#else
    return vec3f(1.0);
#endif
}

// A particle's search, the first time with the pressure that its block shares.
fn begun(before: Search, p: u32, c: u32) -> Search {
    var s = before;
#if SHARES_PRESSURE
    if FIRST && s.compliance > 0.0 && is_liquid(p) {
        let share = lightness(p);
        s.residual += s.compliance * (share * chunks[c].load);
        s.pressure = share * chunks[c].found;
    }
#endif
    return s;
}

// Takes the step for a particle, with what is `found` there of the velocities along the last direction.
fn stepped(before: Sought, found: Gathered, p: u32, c: u32, factors: vec3f, scales: vec2f) -> Sought {
    var s = before;
#if SCALARS
    let divergence = dot3(vec3f(found.x.x, found.y.y, found.z.z), factors);
#endif
#if TENSORS
    let d = mat3x3f(found.x.xyz, found.y.xyz, found.z.xyz);
    var strain = symmetric(d);
    let plain = strain.diagonal;
#if CORRECTS_STRESS
    strain = sum_of(strain, symmetric(missed(d, correction(s.shear))));
#endif
    var divergence = symmetric_trace(strain);
    if is_liquid(p) {
        divergence = dot3(plain, factors);
    }
#endif
    s.mean = sought(begun(s.mean, p, c), divergence);
    var all = parts(s.mean);
#if TENSORS
    if s.shear.compliance > 0.0 {
        s.shear = sheared(s.shear, traceless(strain));
        all = with_shear(all, s.shear);
    }
#endif
    note(all, gradient[p].mass, scales.x, scales.y);
    return s;
}

// Adds the deviator found to the one carried over; of viscoplastic solids, as much as the yield surface admits.
fn admitted(before: Sought, p: u32) -> Sought {
    var s = before;
#if TENSORS
    var after = sum_of(s.shear.brought, s.shear.found);
#if SOLIDS
    let m = materials[material_of(gradient[p].material)];
    if m.model == MODEL_VISCOPLASTIC {
        after = shortened(after, m.yield_limit * (1.0 / compliances(m).y));
        s.shear.found = difference(after, s.shear.brought);
    }
#endif
    s.shear.brought = after;
#endif
    return s;
}

// The effect of the particle's stress on its displacement gradient.
fn sought_gradient(s: Sought, p: u32, factors: vec3f, bound: f32, unit: f32) -> mat3x3f {
    let pressure = factors * select(bounded(wanted(s.mean), bound), s.mean.pressure, LAST);
#if SCALARS
    let q = pressure * unit;
    return diagonal_of(q);
#endif
#if TENSORS
    var shear = s.shear.found;
    if !LAST {
        shear = shortened(wanted_shear(s.shear), bound);
    }
#if CORRECTS_STRESS
    let apart = pressure_apart(p);
    let brings = columns(times(Symmetric(shear.diagonal + select(pressure, vec3f(0.0), apart), shear.off), unit));
    let q = select(vec3f(0.0), pressure, apart) * unit;
    return corrected(brings, correction(s.shear)) + diagonal_of(q);
#else
    return columns(times(Symmetric(shear.diagonal + pressure, shear.off), unit));
#endif
#endif
}

// What is the same for all particles.
struct Fixed {
    // Of sums of squares, and of those times compliances.
    scales: vec2f,
    // Largest stress that is sought.
    bound: f32,
    // Of what stresses add to the nodes.
    scale: f32,
}
var<private> fixed: Fixed;

// The particles of a share are all of one cell.
fn take_cell(c: u32, cell: Cell, going_on: bool) {
    var nodes: Nodes;
    if going_on {
        nodes = cell_nodes(c, cell.at);
    }
    var sums = no_sums(cell.at);
    var i = cell.first;
    loop {
        let p = order[i];
        let x = position[p].xyz;
        var s = search[p];
        let factors = unseen(s, x, p);
        if going_on {
            s = stepped(s, gathered(&nodes, x), p, c, factors, fixed.scales);
        }
        if LAST {
            s = admitted(s, p);
            gradient[p].pressure += s.mean.pressure;
        }
        search[p].mean = s.mean;
#if TENSORS
        if LAST || s.shear.compliance > 0.0 {
            search[p].shear = s.shear;
        }
#endif
        let d = sought_gradient(s, p, factors, fixed.bound, gradient[p].mass * fixed.scale);
        add_affine(&sums, x, vec4f(0.0), vec4f(d[0], 0.0), vec4f(d[1], 0.0), vec4f(d[2], 0.0));
        i++;
        if i == cell.end {
            break;
        }
    }
    add_cell(&sums, c, cell.at);
}

fn stored_node(i: u32) -> vec4f {
    return field[i];
}

var<workgroup> chunk_count: u32;

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_totals(lane);
    if lane == 0u {
        chunk_count = solve.chunks;
    }
    let count = workgroupUniformLoad(&chunk_count);
    let going_on = solve.going_on != 0u;
    line = Found(solve.bound, solve.last_bound, solve.step, solve.mix, solve.count);
    let largest_compliance = bitcast<f32>(atomicLoad(&solve.largest[COMPLIANCE]));
    let scales = vec2f(square_scale(largest_compliance), compliant_scale(largest_compliance));
    let bound = select(line.bound, solve.pressure_bound, LAST);
    fixed = Fixed(scales, bound, force_scale(bound));
    let mine = stretch(group.x, groups.x, count);
    for (var c = awake_from(mine.first, mine.end); c < mine.end; c = awake_from(c + 1u, mine.end)) {
        begin_scatter(lane);
        begin_gather(c, lane);
        meet();
        let all = shares(c);
        var k = lane;
        loop {
            if k < all {
                take_cell(c, share_of(c, k), going_on);
            }
            k += LANES;
            if k >= all {
                break;
            }
        }
        meet();
        end_scatter(c, lane);
        meet();
    }
    note_sum(SQUARE, square);
    note_sum(ANSWERS, answers);
    note_sum(DIRECTIONS, directions);
    note_sum(BOTH, both);
    note_largest(ANSWER, largest_answer);
    note_largest(DIRECTION, largest_direction);
    note_largest(FOUND, largest_found);
    end_totals(lane);
}
