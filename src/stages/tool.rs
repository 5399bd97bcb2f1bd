//! What tools do to the motion of a node. Twin: `shaders/lib/tool.wgsl`.

use crate::cpu::state::ToolConstants;
use crate::math::linear::{add, cross, dot, scale, sub};
use crate::math::real::Real;

/// The square of the distance from the centre, in radii, within which attraction fades: at the centre it has no direction.
const CORE: f64 = 0.01;

/// The displacement `u` of a point at `x` after the tools of a step have acted on it, one after the other.
#[inline(always)]
pub(super) fn wielded<R: Real>(tools: &[ToolConstants<R>], x: [R; 3], mut u: [R; 3]) -> [R; 3] {
    let zero = R::of(0.0);
    for tool in tools {
        // From the nearest point of the way.
        let r = sub(x, tool.start);
        let along = (dot(r, tool.way) * tool.inverse_way).max(zero).min(R::of(1.0));
        let r = sub(r, scale(tool.way, along));
        let squared = dot(r, r) * tool.inverse_radius;
        let near = R::of(1.0) - squared;
        if near <= zero {
            continue;
        }
        let pull = tool.pull * (R::of(1.0) / (squared + R::of(CORE)).sqrt());
        let taken = sub(add(tool.way, cross(tool.spin, r)), u);
        let change = add(sub(tool.push, scale(r, pull)), scale(taken, tool.share));
        u = add(u, scale(change, near * near));
    }
    u
}
