// The effect of tools on the motion of a node. Twin: src/stages/tool.rs. Needs the bindings constants, tools.

// The displacement of a point at `x` after the tools of a step have acted on it, one after the other.
fn wielded(x: vec3f, start: vec3f) -> vec3f {
    var u = start;
    for (var t = 0u; t < constants.tool_count; t++) {
        let tool = tools[t];
        // From the nearest point of the tool's way.
        let from_start = x - tool.start;
        let along = min(max(dot3(from_start, tool.way) * tool.inverse_way, 0.0), 1.0);
        let r = from_start - tool.way * along;
        let squared = dot3(r, r) * tool.inverse_radius;
        let near = 1.0 - squared;
        if near <= 0.0 {
            continue;
        }
        let pull = tool.pull * (1.0 / sqrt(squared + CORE));
        let taken = add_cross3(tool.way - u, tool.spin, r);
        let change = tool.push - r * pull + taken * tool.share;
        u += change * (near * near);
    }
    return u;
}
