// Advances volume ratio and position, keeps particles out of bodies and inside the domain.
// Twin: src/stages/integrate.rs.
#import layout
#import gradient
#import takes_part
#import stretch
#import linear
#import bound
#import halt
#import sound
#if SOLIDS
#import exponential
#import svd
#import solid
#endif
#if COLLIDERS
#import kernel
#import sdf
#import contact
#endif
#import room
#if WALLS
#import walls
#endif
#if FACES
#import faces
#endif
#if CORRECTS
#import corrected
#import correction
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
#if COLLIDERS
@group(0) @binding(4) var<colliders> colliders: Colliders;
@group(0) @binding(5) var<storage, read> cull: array<u32>;
#endif
@group(0) @binding(6) var<storage, read> order: array<u32>;
@group(0) @binding(7) var<storage, read> chunks: array<Chunk>;
@group(0) @binding(8) var<storage, read_write> counters: Counters;
#if KINDS
@group(0) @binding(9) var<uniform> materials: array<Material, MATERIALS>;
#endif
#if DEFORMS
@group(0) @binding(10) var<storage, read_write> deformation: array<Deformation>;
#endif
#if MESHES
@group(0) @binding(11) var<uniform> distance_grids: array<DistanceGrid, MESHES>;
@group(0) @binding(12) var distances: texture_2d<f32>;
#endif

fn remembered(ratio: f32) -> f32 {
    return min(max(ratio, MIN_VOLUME_RATIO), MAX_VOLUME_RATIO);
}

fn volume_ratio(carried: f32, excess: f32, bound: f32) -> f32 {
    return min(carried * (1.0 / (1.0 + constants.volume_gain * excess)), bound);
}

// det(1 + D) of the columns of D.
fn volume_change(x: vec3f, y: vec3f, z: vec3f) -> f32 {
    return dot3(vec3f(1.0 + x.x, x.y, x.z), cross3(vec3f(y.x, 1.0 + y.y, y.z), vec3f(z.x, z.y, 1.0 + z.z)));
}

#if PERIODIC
// The same place between periodic sides.
fn folded(x: vec3f) -> vec3f {
    let end = vec3f(FIRST_BETWEEN) + constants.period;
    let moved = x + constants.period;
    // Rounding may lead to the end itself, which is the beginning.
    let up = select(moved, vec3f(FIRST_BETWEEN), moved >= end);
    let down = select(x, x - constants.period, x >= end);
    return select(x, select(down, up, x < vec3f(FIRST_BETWEEN)), constants.period > vec3f(0.0));
}
#endif

fn escapes(x: vec3f) -> bool {
    let open = (vec3u(constants.open_sides) >> vec3u(0u, 2u, 4u)) & vec3u(3u);
    let below = (open & vec3u(1u)) != vec3u(0u);
    let above = (open & vec3u(2u)) != vec3u(0u);
    return any((below & (x < constants.lo)) | (above & (x > constants.hi)));
}

#if COLLIDERS
// Where a particle gets from `x` by its motion, pushed out of bodies at their places at the end of the step. The push
// is bounded and never becomes velocity.
fn push_out(block: u32, x: vec3f, motion: vec3f) -> vec3f {
    var to = x + motion;
    var reach = reach_from(block, 0u);
    // Most particles are clear of all bodies.
    if reach.bits == 0u || sqrt(dot3(motion, motion)) + ROUNDING < clearance {
        return to;
    }
    loop {
        let c = first_in(reach);
        let at = surface_after(c, to);
        // Clamped matter stays where it is.
        if at.distance < 0.0 && colliders[c].friction < FIXED {
            to += at.normal * min(CLEARANCE - at.distance, constants.push_out);
        }
        reach = without_first(block, reach);
        if reach.bits == 0u {
            break;
        }
    }
    return to;
}
#endif

#if CORRECTS
// Stores the correction for a particle that has come to `x`.
fn keep_correction(p: u32, model: u32, block: u32, x: vec3f) {
    let liquid = model == MODEL_LIQUID;
#if STICKS
    let sees_all = model == MODEL_SAND;
#else
    let sees_all = model == MODEL_SAND || liquid;
#endif
    if sees_all {
        return;
    }
    let next = correction(block, x, liquid);
    if liquid {
        let beside = vec4f(next.ahead, f32(next.body), 0.0, next.m.y);
        deformation[p] = Deformation(vec4f(next.turned, next.m.x), beside, vec4f(next.lacks, next.m.z));
        return;
    }
    deformation[p].x.w = next.m.x;
    deformation[p].y.w = next.m.y;
    deformation[p].z.w = next.m.z;
}
#endif

#if STICKS
// Adds to what a liquid gathers the part that held nodes withhold.
fn add_lacking(p: u32, block: u32) {
    let f = deformation[p];
    let m = kept_correction(f);
    let square = dot3(m, m);
    if square <= 0.0 {
        return;
    }
    let g = gradient[p];
    var rate = transform(mat3x3f(g.x, g.y, g.z), m) - turned_correction(f);
    rate = rate - m * (dot3(rate, m) * (1.0 / square));
    let d = outer_product(rate, f.z.xyz);
    let u = rate * f.y.x;
    displacement[p] = vec4f(displacement[p].xyz + u, displacement[p].w);
    gradient[p] = Gradient(g.x + d[0], g.mass, g.y + d[1], g.material, g.z + d[2], g.pressure);
#if LOADS
    let body = u32(f.y.y);
    if colliders[body].load != NO_LOAD {
        load_weight = g.mass * constants.load_scale;
        note_lacking(body, block, position[p].xyz, u, d);
    }
#endif
}
#endif

// Square of the largest displacement of an invocation's particles, and the bits of the workgroup's.
var<private> largest_square: f32;
var<workgroup> group_largest_square: atomic<u32>;

fn integrate(p: u32, block: u32) {
    let x = position[p];
#if STICKS
#if SOLIDS
    let is_liquid = materials[material_of(gradient[p].material)].model == MODEL_LIQUID;
#else
    let is_liquid = true;
#endif
    if is_liquid && sound(x, displacement[p], gradient[p]) {
        add_lacking(p, block);
    }
#endif
    let u = displacement[p];
    let d = gradient[p];
    if !sound(x, u, d) {
        position[p].w = QUARANTINED;
        atomicAdd(&counters.quarantined, 1u);
        return;
    }
    var fraction = abs(u.w);
    // Beside solids liquids draw in until gaps are filled, and loose ones under pressure do.
    var draws = false;
    if u.w <= -LOOSE {
        fraction -= LOOSE;
        draws = x.w < UNDER_PRESSURE;
    }
#if MIXES
    else if u.w <= -BESIDE_SOLIDS {
        fraction -= BESIDE_SOLIDS;
        draws = true;
    }
#endif
    let bound = max(x.w, select(1.0, constants.tension_limit, draws));
#if LOADS
    load_weight = d.mass * constants.load_scale;
#endif
    begin_room(x.xyz);
    var motion = slowed(u.xyz);
#if COLLIDERS
    // The grid has applied the friction of what it has stopped. What is stopped here has its own: single grains before a
    // body between nodes are borne by it alone. The visit of the bodies also gives the room.
    motion = slowed(resolve_all(block, x.xyz, motion, FRICTION_RUBBING));
#endif
    let most = room.most + MEASURE_MARGIN;
    let more = max(fraction * x.w - most, 0.0);
    // A negative fraction is a deficit that is believed, of loose matter if bodies and walls do not account for it.
    let lacking = min(fraction * x.w - (room.least - SHORTFALL), 0.0);
    let of_itself = OF_ITSELF * (1.0 - fraction * x.w) <= -lacking;
    let less = select(0.0, lacking, select(u.w < 0.0, of_itself, u.w <= -LOOSE));
#if WALLS
    var factors = wall_factors(x.xyz, d.material);
#if KINDS
    if materials[material_of(d.material)].solved_viscosity > 0.0 {
        factors = vec3f(1.0);
    }
#endif
    let change = volume_change(d.x * vec3f(factors.x, 1.0, 1.0), d.y * vec3f(1.0, factors.y, 1.0), d.z * vec3f(1.0, 1.0, factors.z));
#else
    let change = volume_change(d.x, d.y, d.z);
#endif
    var ratio = volume_ratio(x.w, more + less, bound) * change;
    var clamped = ratio < MIN_VOLUME_RATIO;
#if SOLIDS
    let m = materials[material_of(d.material)];
    if m.model != MODEL_LIQUID {
        let dense = fraction > most;
        var strained = mat3x3f(d.x, d.y, d.z);
#if CORRECTS
        if m.model != MODEL_SAND {
            strained = corrected(strained, kept_correction(deformation[p]));
        }
#endif
        let solid = advance_solid(m, deformation[p], strained, dense, -less * (constants.volume_gain * LOOSENING));
        deformation[p] = solid.deformation;
        ratio = solid.volume_ratio;
        clamped = solid.clamped;
    }
#endif
    ratio = remembered(ratio);
    if clamped {
        atomicAdd(&counters.strain_clamped, 1u);
    }
#if COLLIDERS
    let to = push_out(block, x.xyz, motion);
#else
    let to = x.xyz + motion;
#endif
    if escapes(to) {
        ratio = ESCAPED;
        atomicAdd(&counters.escaped, 1u);
    } else {
        largest_square = max(largest_square, dot3(motion, motion));
    }
    let placed = min(max(to, constants.lo), constants.hi);
    displacement[p] = vec4f(motion, fraction);
#if PERIODIC
    position[p] = vec4f(folded(placed), ratio);
#else
    position[p] = vec4f(placed, ratio);
#endif
#if FACES
    // Most particles are clear of all bodies, those before a face within half a cell of it.
    var faces = 0.0;
    if sqrt(dot3(motion, motion)) + 0.6 >= clearance {
        faces = faces_beside(block, placed);
    }
    gradient[p].material = with_beside(d.material, faces);
#endif
#if CORRECTS
#if SOLIDS
    keep_correction(p, m.model, block, placed);
#else
    keep_correction(p, MODEL_LIQUID, block, placed);
#endif
#endif
}

@compute @workgroup_size(LANES)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        atomicStore(&group_largest_square, 0u);
    }
    workgroupBarrier();
    let count = select(atomicLoad(&counters.chunks), 0u, halted());
    let mine = stretch(group.x, groups.x, count);
    for (var c = awake_from(mine.first, mine.end); c < mine.end; c = awake_from(c + 1u, mine.end)) {
        let end = chunks[c].start + chunks[c].count;
        var i = chunks[c].start + lane;
        loop {
            if i < end {
                integrate(order[i], chunks[c].block);
            }
            i += LANES;
            if i >= end {
                break;
            }
        }
    }
    // The bits of non-negative numbers are in the order of the numbers.
    atomicMax(&group_largest_square, bitcast<u32>(largest_square));
    workgroupBarrier();
    if lane == 0u {
        atomicMax(&counters.largest_square, atomicLoad(&group_largest_square));
    }
}
