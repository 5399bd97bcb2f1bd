//! The effect of tools on the motion of a node. Twin: `shaders/lib/tool.wgsl`.

use crate::cpu::constants::ToolConstants;
use crate::math::linear::{add, add_cross, dot, scale, sub};
use crate::math::real::{Lanes, Real};

/// The square of the distance from the centre, in radii, within which attraction fades, since it has no direction at
/// the centre.
pub(crate) const CORE: f64 = 0.01;

/// The displacements `u` of four points at `x` after the tools of a step have acted on them, one after the other.
#[inline(always)]
pub(super) fn wielded<R: Real>(tools: &[ToolConstants<R>], x: [R::V; 3], mut u: [R::V; 3]) -> [R::V; 3] {
    let all = |x: f64| R::V::all(R::of(x));
    let (zero, one) = (all(0.0), all(1.0));
    for tool in tools {
        let [start, way, push, spin] = [tool.start, tool.way, tool.push, tool.spin].map(|v| v.map(R::V::all));
        // From the nearest point of the tool's way.
        let r = sub(x, start);
        let along = (dot(r, way) * R::V::all(tool.inverse_way)).max(zero).min(one);
        let r = sub(r, scale(way, along));
        let squared = dot(r, r) * R::V::all(tool.inverse_radius);
        let near = one - squared;
        let reached = zero.below(near);
        if !reached.any() {
            continue;
        }
        let pull = R::V::all(tool.pull) * (one / (squared + all(CORE)).sqrt());
        let taken = add_cross(sub(way, u), spin, r);
        let change = add(sub(push, scale(r, pull)), scale(taken, R::V::all(tool.share)));
        let moved = add(u, scale(change, near * near));
        u = [0, 1, 2].map(|a| reached.pick(moved[a], u[a]));
    }
    u
}
