// Particles as round, shaded dots, between the state before the last step and the state after it.

struct View {
    clip_from_cells: mat4x4f,
    right: vec4f, // of the picture; w: radius of a dot, cells
    up: vec4f,    // of the picture; w: blend
}

@group(0) @binding(0) var<uniform> view: View;

struct Dot {
    @builtin(position) clip: vec4f,
    @location(0) at: vec2f,
    @location(1) color: vec3f,
}

@vertex
fn vs(
    @builtin(vertex_index) vertex: u32,
    @location(0) position: vec4f,
    @location(1) displacement: vec4f,
) -> Dot {
    let at = vec2f(vec2u(vertex & 1u, vertex >> 1u)) * 2.0 - 1.0;
    let centre = position.xyz - (1.0 - view.up.w) * displacement.xyz;
    let corner = centre + (at.x * view.right.xyz + at.y * view.up.xyz) * view.right.w;
    var out: Dot;
    out.at = at;
    // A particle that is out of the simulation has no volume ratio above 0; this moves it out of the picture.
    out.clip = select(vec4f(2.0, 2.0, 2.0, 1.0), view.clip_from_cells * vec4f(corner, 1.0), position.w > 0.0);
    out.color = mix(vec3f(0.02, 0.15, 0.5), vec3f(0.8, 0.95, 1.0), saturate(length(displacement.xyz)));
    return out;
}

@fragment
fn fs(in: Dot) -> @location(0) vec4f {
    let off = dot(in.at, in.at);
    if off > 1.0 {
        discard;
    }
    let normal = vec3f(in.at, sqrt(1.0 - off));
    let light = 0.35 + 0.65 * saturate(dot(normal, vec3f(0.4, 0.7, 0.6)));
    return vec4f(in.color * light, 1.0);
}
