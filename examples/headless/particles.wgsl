// Particles as spheres, straight from the solver's buffers; the last pass lights them.

@group(1) @binding(0) var<storage, read> positions: array<vec4f>;
@group(1) @binding(1) var<storage, read> displacements: array<vec4f>;
@group(1) @binding(2) var<storage, read> gradients: array<array<vec4f, 3>>;

struct Ball {
    @builtin(position) clip: vec4f,
    @location(0) ray: vec3f,
    @location(1) @interpolate(flat, either) centre: vec4f,
    @location(2) @interpolate(flat, either) color: vec3f,
}

fn speed_color(share: f32) -> vec3f {
    let t = sqrt(saturate(share)) * 3.0; // most of the matter is slow
    let slow = mix(vec3f(0.012, 0.05, 0.24), vec3f(0.03, 0.22, 0.66), saturate(t));
    return mix(mix(slow, vec3f(0.24, 0.62, 0.92), saturate(t - 1.0)), vec3f(1.0), saturate(t - 2.0));
}

fn compression_color(compression: f32) -> vec3f {
    let t = clamp(compression * 10.0, -1.0, 1.0); // full colour at 10 %
    let far = select(vec3f(0.80, 0.06, 0.04), vec3f(0.05, 0.16, 0.80), t < 0.0);
    return mix(vec3f(0.9), far, sqrt(abs(t)));
}

@vertex
fn vs(@builtin(vertex_index) vertex: u32, @builtin(instance_index) i: u32) -> Ball {
    let position = positions[i];
    let material = materials[min(u32(gradients[i][1].w), 255u)];
    let volume = gradients[i][0].w / material.w;
    let radius = 0.55 * pow(max(volume, 1e-12), 1.0 / 3.0); // a little overlap closes the gaps of a lattice
    let centre = position.xyz - frame.eye.xyz;
    var out: Ball;
    out.clip = vec4f(0.0, 0.0, -1.0, 1.0); // not drawn
    if !(position.w > 0.0) || dot(centre, frame.forward.xyz) < radius + frame.eye.w {
        return out;
    }
    out.centre = vec4f(centre, radius);
    out.ray = ball_corner(centre, radius, quad_corner(vertex));
    out.clip = clip_of(out.ray);
    out.color = 0.02 + 0.78 * material.rgb; // pure primaries would leave no room for light
    if frame.forward.w == 1.0 {
        out.color = speed_color(length(displacements[i].xyz) / frame.up.w);
    } else if frame.forward.w == 2.0 {
        out.color = compression_color(1.0 - position.w);
    }
    return out;
}

struct Matter {
    @location(0) color: vec4f,
    @location(1) normal: vec4f, // 0 … 1; w: the sphere's radius in the picture, 255ths of 64 samples
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs(in: Ball) -> Matter {
    let hit = ball_hit(in.ray, in.centre.xyz, in.centre.w);
    if all(hit == vec3f(0.0)) {
        discard;
    }
    let n = (hit - in.centre.xyz) / in.centre.w;
    let samples = in.centre.w / (dot(in.centre.xyz, frame.forward.xyz) * frame.screen.z);
    return Matter(vec4f(in.color, 1.0), vec4f(n * 0.5 + 0.5, clamp(samples / 64.0, 1.0 / 255.0, 1.0)), depth_of(hit));
}
