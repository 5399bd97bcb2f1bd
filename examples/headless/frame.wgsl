// The background, and the last pass: particles lit as one liquid, hollows darkened, samples averaged to pixels.

@group(1) @binding(0) var scene: texture_2d<f32>;
@group(1) @binding(1) var normals: texture_2d<f32>;
@group(1) @binding(2) var depths: texture_2d<f32>; // of a depth format; OpenGL cannot load from a texture_depth_2d

struct Screen {
    @builtin(position) clip: vec4f,
    @location(0) at: vec2f, // 0 … 1 from the bottom left
}

@vertex
fn vs(@builtin(vertex_index) vertex: u32) -> Screen {
    let at = vec2f(vec2u(vertex & 1u, vertex >> 1u)) * 2.0;
    return Screen(vec4f(at * 2.0 - 1.0, 0.0, 1.0), at);
}

@fragment
fn fs_background(in: Screen) -> @location(0) vec4f {
    let off = in.at - vec2f(0.5, 0.55);
    let sky = mix(vec3f(0.20, 0.22, 0.25), vec3f(0.52, 0.57, 0.63), smoothstep(0.0, 1.0, in.at.y));
    return vec4f(sky * (1.0 - 0.45 * dot(off, off)), 1.0);
}

const AXES = array<vec2f, 4>(vec2f(1.0, 0.0), vec2f(0.707, 0.707), vec2f(0.0, 1.0), vec2f(-0.707, 0.707));

fn depth_at(at: vec2i) -> f32 {
    return textureLoad(depths, clamp(at, vec2i(0), vec2i(textureDimensions(depths)) - 1), 0).x;
}

// How hollow (> 0) or bulging (< 0) the picture is around a sample. Reversed depth is affine over the image of a plane,
// so that planes get 0 at any slant. A jump to another surface fades out instead of casting a halo.
fn hollow(at: vec2i, depth: f32, radius: f32, gain: f32) -> f32 {
    var sum = 0.0;
    for (var k = 0; k < 4; k++) {
        let step = vec2i(round(AXES[k] * radius));
        let bend = gain * (0.5 * (depth_at(at + step) + depth_at(at - step)) / depth - 1.0);
        sum += bend / (1.0 + bend * bend);
    }
    return sum * 0.25;
}

// The liquid's normal: that of the plane through the depths around the sample, over a few particles, so that they read
// as one surface. Pairs that leave the surface count little; where most do, as on a drop, the sphere's own normal
// stays.
fn surface_normal(at: vec2i, depth: f32, own: vec3f, radius: f32) -> vec3f {
    var moments = vec3f(0.0); // of x², xy, y²
    var slopes = vec2f(0.0);
    var weights = 0.0;
    let bend_scale = 0.4 / (depth * radius * frame.screen.z);
    for (var k = 0; k < 12; k++) {
        let ring = f32(k >> 2u) + 1.0;
        let step = vec2i(round(AXES[k & 3] * radius * ring * 0.9));
        let a = depth_at(at + step);
        let b = depth_at(at - step);
        let bend = (0.5 * (a + b) - depth) * bend_scale;
        let weight = 1.0 / (1.0 + bend * bend * bend * bend);
        let offset = vec2f(step);
        moments += weight * vec3f(offset.x * offset.x, offset.x * offset.y, offset.y * offset.y);
        slopes += weight * 0.5 * (a - b) * offset;
        weights += weight;
    }
    let det = moments.x * moments.z - moments.y * moments.y;
    if det <= 1e-3 * moments.x * moments.z {
        return own;
    }
    let slope = vec2f(moments.z * slopes.x - moments.y * slopes.y, moments.x * slopes.y - moments.y * slopes.x) / det;
    // Depth is near/z = gx·X + gy·Y + g for the ray (X, Y, 1), and (gx, gy, g) points into the surface.
    let size = vec2f(textureDimensions(depths));
    let from_middle = vec2f(at) + 0.5 - size * 0.5;
    let right = cross(frame.forward.xyz, frame.up.xyz);
    let into = (slope.x * right - slope.y * frame.up.xyz) / frame.screen.z
        + (depth - dot(slope, from_middle)) * frame.forward.xyz;
    let trust = smoothstep(0.3, 0.8, weights / 12.0);
    return normalize(mix(own, -normalize(into), 0.88 * trust));
}

fn to_eye(at: vec2i) -> vec3f {
    let size = vec2f(textureDimensions(depths));
    let offset = (vec2f(at) + 0.5 - size * 0.5) * frame.screen.z;
    let right = cross(frame.forward.xyz, frame.up.xyz);
    return -normalize(frame.forward.xyz + offset.x * right - offset.y * frame.up.xyz);
}

fn sample(at: vec2i) -> vec3f {
    let color = textureLoad(scene, at, 0).rgb;
    let depth = textureLoad(depths, at, 0).x;
    let matter = textureLoad(normals, at, 0);
    if depth <= 0.0 {
        return color;
    }
    if matter.w <= 0.0 {
        let near = hollow(at, depth, 2.0 * frame.screen.y, 120.0);
        let wide = hollow(at, depth, 10.0 * frame.screen.y, 40.0);
        return color * exp(-0.9 * near - 0.9 * max(wide, 0.0));
    }
    let radius = matter.w * 64.0;
    let gain = 1.0 / (radius * frame.screen.z);
    let n = surface_normal(at, depth, normalize(matter.xyz * 2.0 - 1.0), max(radius, 1.0));
    let near = hollow(at, depth, max(0.8 * radius, 1.0), gain);
    let wide = hollow(at, depth, 5.0 * radius, 0.4 * gain);
    return lit(color, n, to_eye(at), 1.0) * exp(-0.6 * near - 0.9 * wide);
}

@fragment
fn fs_resolve(in: Screen) -> @location(0) vec4f {
    let samples = i32(frame.screen.x);
    let first = vec2i(in.clip.xy) * samples;
    var sum = vec3f(0.0);
    for (var y = 0; y < samples; y++) {
        for (var x = 0; x < samples; x++) {
            sum += sample(first + vec2i(x, y));
        }
    }
    return vec4f(sum / f32(samples * samples), 1.0);
}
