// Shared by every pipeline of the picture. Lengths are in cells; depth is reversed and infinite: near / distance.

struct Frame {
    clip_from_cells: mat4x4f,
    eye: vec4f,     // w: near plane
    forward: vec4f, // w: 0 material, 1 speed, 2 compression
    up: vec4f,      // w: displacement per step at the end of the speed ramp
    sun: vec4f,     // towards it; w: cells between two lines of the floor's grid
    lo: vec4f,      // corners of the domain
    hi: vec4f,
    screen: vec4f,  // samples along a pixel's side, samples a 720th of the height, angle between two samples
}

struct Body {
    axes: array<vec4f, 3>, // unit axes; w: half the edge along it
    centre: vec4f,         // w: radius of a sphere
    color: vec4f,          // w: 1 with the floor's grid
    faces: vec4u,          // masks of the faces (bit 2·axis + side) that are drawn solid (x) and see-through (y);
                           // z: a shape that rays are sent at, in the box of the axes; w: 1 where it is a container
}

@group(0) @binding(0) var<uniform> frame: Frame;
// rgb: colour; w: density relative to the densest material.
@group(0) @binding(1) var<uniform> materials: array<vec4f, 256>;
@group(0) @binding(2) var<storage, read> bodies: array<Body>;

const SKY = vec3f(0.66, 0.76, 0.90);
const GROUND = vec3f(0.30, 0.27, 0.25);

// Two triangles over −1 … 1.
fn quad_corner(vertex: u32) -> vec2f {
    let id = vertex - select(0u, 2u, vertex > 2u); // 0 1 2, 1 2 3
    return vec2f(vec2u(id & 1u, id >> 1u)) * 2.0 - 1.0;
}

fn depth_of(from_eye: vec3f) -> f32 {
    return frame.eye.w / dot(from_eye, frame.forward.xyz);
}

fn clip_of(from_eye: vec3f) -> vec4f {
    return frame.clip_from_cells * vec4f(frame.eye.xyz + from_eye, 1.0);
}

// A corner, seen from the eye, of the quad that just covers a ball at `centre`; the ball must not hold the eye.
fn ball_corner(centre: vec3f, radius: f32, corner: vec2f) -> vec3f {
    let d2 = dot(centre, centre);
    let axis = centre * inverseSqrt(d2);
    let right = normalize(cross(axis, frame.up.xyz));
    let reach = radius * sqrt(d2 / max(d2 - radius * radius, 1e-4 * d2));
    return centre + reach * (corner.x * right + corner.y * cross(right, axis));
}

// Where the ray from the eye first meets the ball, or the zero vector.
fn ball_hit(ray: vec3f, centre: vec3f, radius: f32) -> vec3f {
    let dir = normalize(ray);
    let along = dot(dir, centre);
    let off = centre - along * dir; // not |centre|² − along²: that cancels for far balls
    let h2 = radius * radius - dot(off, off);
    return select(vec3f(0.0), dir * (along - sqrt(max(h2, 0.0))), h2 >= 0.0 && along > 0.0);
}

fn lit(albedo: vec3f, n: vec3f, to_eye: vec3f, gloss: f32) -> vec3f {
    let wrapped = dot(n, frame.sun.xyz) * 0.5 + 0.5;
    let ambient = mix(GROUND, SKY, n.y * 0.5 + 0.5);
    let facing = saturate(dot(n, to_eye));
    let shine = pow(saturate(dot(n, normalize(frame.sun.xyz + to_eye))), 48.0);
    let rim = pow(1.0 - facing, 4.0);
    let diffuse = albedo * (0.85 * wrapped * wrapped + 0.42 * ambient);
    return mix(diffuse, SKY * ambient, 0.35 * gloss * rim) + 0.22 * gloss * shine;
}
