// Prepares the solve of the implicit scheme: viscosity, the stress that each particle carries over from the step
// before, and the strain to be taken back beyond what this stress accounts for. Twin: src/stages/press.rs.
#import layout
#import gradient
#import bounded
#import search
#if SLEEP
#import bins
#endif
#import linear
#import bound_gradient
#import largest_motion
#import halt
#import sum64
#import totals
#if CORRECTS
#import corrected
#endif
#import viscosity
#import compliance
#if WALLS
#import walls
#endif
#if SOLIDS
#import exponential
#import svd
#import solid
#endif
#if TENSORS
#import symmetric
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<uniform> materials: array<Material, MATERIALS>;
@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> gradient: array<Gradient>;
#if SCALARS
@group(0) @binding(5) var<storage, read_write> search: array<Search>;
#endif
#if DEFORMS
@group(0) @binding(4) var<storage, read> deformation: array<Deformation>;
#endif
#if TENSORS
@group(0) @binding(5) var<storage, read_write> search: array<StressSearch>;
#endif
@group(0) @binding(6) var<storage, read_write> solve: Solve;
@group(0) @binding(7) var<storage, read_write> counters: Counters;
#if SLEEP
@group(0) @binding(8) var<storage, read> bin: array<Place>;
#endif

@group(0) @binding(9) var<storage, read> displacement: array<vec4f>;

// The divergence that takes back a liquid's error in volume.
fn compression(ratio: f32, compliance: f32) -> f32 {
    return bounded(1.0 - ratio, MAX_ERROR + MAX_LOAD * compliance);
}

// The largest divergence that a liquid's pressure may correspond to.
fn most_of_liquid(ratio: f32, compliance: vec2f) -> f32 {
    return select(max(MAX_DIVERGENCE, compression(ratio, compliance.x)), MAX_DIVERGENCE, compliance.y > 0.0);
}

// The pressure that a particle carries over, bounded.
fn brought(pressure: f32, compliance: f32, limit: f32) -> f32 {
    if compliance <= 0.0 {
        return 0.0;
    }
    return bounded(pressure, min(limit * (1.0 / compliance), MAX_PRESSURE));
}

// The compliance of a particle to a change of the volume of its whole block.
fn with_block(m: Material, compliance: f32) -> f32 {
#if SHARES_PRESSURE
    if m.model == MODEL_LIQUID && compliance > 0.0 {
        return compliance_with_block(m);
    }
#endif
    return compliance;
}

fn trace(d: mat3x3f) -> f32 {
    return d[0][0] + d[1][1] + d[2][2];
}

// Compliances of a particle: 0 to pressure where it has come apart and does not close up.
fn particle_compliances(m: Material, ratio: f32, divergence: f32) -> vec2f {
    let apart = m.model == MODEL_LIQUID && ratio + ratio * divergence > constants.tension_limit;
    let all = compliances(m);
    return vec2f(select(all.x, 0.0, apart), all.y);
}

// The effect of a particle's pressure on its displacement gradient, given its compliance to shear.
fn push_of(q: f32, to_shear: f32, x: vec3f, material: f32) -> mat3x3f {
#if WALLS
    if to_shear <= 0.0 {
        let push = q * wall_factors(x, material);
        return diagonal_of(push);
    }
#endif
    return diagonal_of(vec3f(q));
}

// An invocation's maxima over its particles.
var<private> largest: array<f32, LARGEST>;

fn keep_largest(which: u32, value: f32) {
    largest[which] = max(largest[which], value);
}

// Notes that a particle takes part in the solve with this compliance, and the strain that it is to take back.
fn note_compliant(compliance: f32, residual: f32) {
    if compliance > 0.0 {
        keep_largest(COMPLIANCE, compliance);
        keep_largest(RESPONSE, response(compliance));
        keep_largest(ANSWER, residual);
    }
}

// A particle's displacement gradient with the effect of its stress, and its pressure.
struct Pressed {
    d: mat3x3f,
    pressure: f32,
}

#if SCALARS
// Prepares a particle's search; returns the gradient with the effect of the pressure that it carries over.
fn pressed(p: u32, m: Material, ratio: f32, kept: mat3x3f, d: mat3x3f, pressure: f32) -> Pressed {
    let both = particle_compliances(m, ratio, trace(d));
    let compliance = both.x;
    let q = brought(pressure, with_block(m, compliance), most_of_liquid(ratio, both));
    search[p] = Search(0.0, compression(ratio, compliance) - compliance * q, 0.0, compliance);
    keep_largest(PRESSURE, abs(q));
    note_compliant(compliance, abs(search[p].residual));
    return Pressed(d + push_of(q, both.y, position[p].xyz, gradient[p].material), q);
}
#endif

#if SOLIDS
// How many times softer to shear yielding matter counts: if it goes on as in the step before, its stress stays on the
// yield surface.
fn softening(m: Material, strain: mat3x3f, d: mat3x3f) -> f32 {
    if m.model != MODEL_VISCOPLASTIC {
        return 1.0;
    }
    let trial = sum_of(deviator(strain), deviator(d));
    return min(max(sqrt(product(trial, trial)) * (1.0 / max(m.yield_limit, 1e-6)), 1.0), MAX_SOFTENING);
}

// The strain of a solid to be taken back, as divergence and deviator, plus the share of the last step's change of it;
// see `weights`.
struct Wrong {
    divergence: f32,
    shear: Symmetric,
}

fn solid_error(m: Material, strain: mat3x3f, d: mat3x3f, compliance: f32) -> Wrong {
    let parts = weights(m);
    let now = 1.0 / parts.x;
    let shear = difference(times(deviator(d), parts.y), times(deviator(strain), now));
    return Wrong(parts.y * trace(d) - now * trace(strain), times(shear, elastic_share(m, compliance)));
}
#endif

#if TENSORS
// The deviator of stress that a particle carries over, rotated with it. New particles, which have no pressure, and
// matter that has come apart have none.
fn turned_stress(stress: Symmetric, pressure: f32, d: mat3x3f, compliance: f32) -> Symmetric {
    if compliance <= 0.0 || pressure == 0.0 {
        return Symmetric(vec3f(0.0), vec3f(0.0));
    }
    let most = min(MAX_SHEAR * (1.0 / compliance), MAX_PRESSURE);
    return shortened(turned(stress, d), most);
}

// Prepares a particle's search; returns the gradient with the effect of the stress that it carries over.
fn pressed(p: u32, m: Material, ratio: f32, kept: mat3x3f, d: mat3x3f, pressure: f32) -> Pressed {
    var compliance = particle_compliances(m, ratio, trace(d));
    let none = Symmetric(vec3f(0.0), vec3f(0.0));
    var correction = vec3f(0.0);
    var wanted = compression(ratio, compliance.x);
    var wrong = none;
#if STICKS
    if m.model == MODEL_LIQUID {
        let f = deformation[p];
        correction = kept_correction(f);
        if compliance.y > 0.0 {
            wrong = deviator(outer_product(turned_correction(f), correction));
        }
    }
#endif
#if SOLIDS
    if m.model != MODEL_LIQUID {
        let strain = logarithmic_strain(deformation[p]);
        compliance.y = compliance.y * softening(m, strain, kept);
        var seen = kept;
#if CORRECTS
        correction = kept_correction(deformation[p]);
        seen = corrected(kept, correction);
#endif
        let error = solid_error(m, strain, seen, compliance.y);
        wanted = error.divergence;
        wrong = error.shear;
    }
#endif
    var q = brought(pressure, with_block(m, compliance.x), select(MAX_SHEAR, most_of_liquid(ratio, compliance), m.model == MODEL_LIQUID));
    var stress = turned_stress(search[p].shear.brought, q, kept, compliance.y);
    keep_largest(PRESSURE, abs(q) + sqrt(product(stress, stress)));
    var ahead = 0.0;
    var shear_ahead = none;
    // What is the first direction of search does not act from the start.
#if RESUMES
    ahead = q;
    q = 0.0;
    shear_ahead = stress;
    stress = none;
#endif
    let shear = difference(wrong, times(stress, compliance.y));
    let mean = Search(0.0, wanted - compliance.x * q, ahead, compliance.x);
    let found = Shear(stress, none, shear, shear_ahead, compliance.y, correction.x, correction.y, correction.z);
    search[p] = StressSearch(mean, found);
    note_compliant(compliance.x, abs(mean.residual));
    note_compliant(compliance.y, sqrt(product(shear, shear)));
    var moved = (d + push_of(q, compliance.y, position[p].xyz, gradient[p].material)) + columns(stress);
#if CORRECTS
    // For a liquid only the viscous stress is corrected.
    let pushes = select(q, 0.0, m.model == MODEL_LIQUID);
    moved += missed(columns(Symmetric(stress.diagonal + pushes, stress.off)), correction);
#endif
    return Pressed(moved, q);
}
#endif

// The first of an invocation's particles from `p` on that is awake. A loop, since some devices also run code in
// branches that are not taken.
fn next_particle(p: u32, step: u32, count: u32) -> u32 {
    var next = p;
#if SLEEP
    while next < count && (bin[next].rest & ASLEEP) != 0u {
        next += step;
    }
#endif
    return next;
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_totals(lane);
    begin_motion(lane);
    let count = select(constants.particle_count, 0u, halted());
    let step = groups.x * GROUP;
    for (var p = next_particle(id.x, step, count); p < count; p = next_particle(p + step, step, count)) {
        let ratio = position[p].w;
        if ratio > 0.0 {
            let g = gradient[p];
            let m = materials[material_of(g.material)];
            let kept = bounded_gradient(mat3x3f(g.x, g.y, g.z));
            let d = take_shear(viscous_share(m), kept.d);
            let moved = pressed(p, m, ratio, kept.d, d, g.pressure);
            gradient[p] = Gradient(moved.d[0], g.mass, moved.d[1], g.material, moved.d[2], moved.pressure);
            keep_largest(RATE, kept.square);
            note_motion(displacement[p].xyz, moved.d);
        }
    }
    note_largest(PRESSURE, largest[PRESSURE]);
    note_largest(RATE, largest[RATE]);
    note_largest(COMPLIANCE, largest[COMPLIANCE]);
    note_largest(RESPONSE, largest[RESPONSE]);
    note_largest(ANSWER, largest[ANSWER]);
    end_totals(lane);
    end_motion(lane);
}
