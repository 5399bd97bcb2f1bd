// How bodies that viscous liquids stick to brake the nodes before them. Twin: src/stages/drag.rs. Needs the binding
// materials, and kernel and contact.
#import viscosity
#if TENSORS
#import compliance
#endif

// The kinematic viscosity with which bodies drag, in cells² per step.
var<private> wall_viscosity: f32;

fn begin_drag() {
    var times = 0.0;
    for (var i = 0u; i < MATERIALS; i++) {
        let m = materials[i];
        if m.model == MODEL_LIQUID {
            var share = viscous_share(m);
#if TENSORS
            share = max(share, viscous_stiffness(m));
#endif
            times = max(times, share);
        }
    }
    wall_viscosity = times * 0.125;
}

// The share of its motion along a wall at a distance d that a node loses in a step.
fn taken(d: f32) -> f32 {
    let square = d * d;
    let rest = KERNEL_REACH - d;
    let far = rest * (rest * rest) * (0.25 + 0.5 * d);
    let wall = select(0.8125 - square * (1.5 - square), far, d > 0.5) * wall_viscosity;
    return min(wall * (1.0 / (wall + d * share_before(d))), MOST_BRAKED);
}

// Whether a body brakes the node.
var<private> is_braked: bool;

// The displacement `u` of a node at `x`, braked by the nearest body that it sticks to.
fn braked(block: u32, x: vec3f, u: vec3f) -> vec3f {
    is_braked = false;
    // Solids are held fully or not at all.
    if !parts {
        return u;
    }
    var body = 0u;
    var nearest = Surface(vec3f(0.0), KERNEL_REACH);
    var reach = reach_from(block, 0u);
    while reach.bits != 0u {
        let c = first_in(reach);
        if colliders[c].friction >= STICKING {
            let at = surface_at(c, frame(c, x));
            if at.distance < nearest.distance {
                body = c;
                nearest = at;
            }
        }
        reach = without_first(block, reach);
    }
    if nearest.distance <= ON_SURFACE || nearest.distance >= KERNEL_REACH {
        return u;
    }
    let share = taken(nearest.distance);
    if share <= 0.0 {
        return u;
    }
    is_braked = true;
    let relative = u - body_motion(body, x);
    let tangent = relative - nearest.normal * dot3(relative, nearest.normal);
    let kept = u - tangent * share;
#if LOADS
    if colliders[body].load != NO_LOAD {
        note_load(body, block, x, u - kept);
    }
#endif
#if HOLDS
    brake(share, nearest.normal);
#endif
    return kept;
}
