// The background, and the last pass: four samples to a pixel, with hollows darkened.

@group(1) @binding(0) var scene: texture_2d<f32>;
@group(1) @binding(1) var depths: texture_depth_2d;

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

// How hollow (> 0) or bulging (< 0) the picture is around a sample. Reversed depth is affine over the image of a plane,
// so that planes get 0 at any slant. A jump to another surface fades out instead of casting a halo.
fn hollow(at: vec2i, depth: f32, radius: f32, gain: f32) -> f32 {
    let last = vec2i(textureDimensions(depths)) - 1;
    var sum = 0.0;
    for (var k = 0; k < 4; k++) {
        let step = vec2i(round(AXES[k] * radius));
        let a = textureLoad(depths, clamp(at + step, vec2i(0), last), 0);
        let b = textureLoad(depths, clamp(at - step, vec2i(0), last), 0);
        let bend = gain * (0.5 * (a + b) / depth - 1.0);
        sum += bend / (1.0 + bend * bend);
    }
    return sum * 0.25;
}

@fragment
fn fs_resolve(in: Screen) -> @location(0) vec4f {
    let samples = i32(textureDimensions(scene).x) / i32(frame.lo.w);
    let first = vec2i(in.clip.xy) * samples;
    var sum = vec3f(0.0);
    for (var y = 0; y < samples; y++) {
        for (var x = 0; x < samples; x++) {
            let at = first + vec2i(x, y);
            let depth = textureLoad(depths, at, 0);
            var shade = 1.0;
            if depth > 0.0 {
                let near = hollow(at, depth, 2.0 * frame.hi.w, 120.0);
                let wide = hollow(at, depth, 10.0 * frame.hi.w, 40.0);
                shade = exp(-0.9 * near - 1.0 * wide);
            }
            sum += textureLoad(scene, at, 0).rgb * shade;
        }
    }
    return vec4f(sum / f32(samples * samples), 1.0);
}
