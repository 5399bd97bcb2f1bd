// Solid bodies, the domain's edges and the background.

struct Face {
    @builtin(position) clip: vec4f,
    @location(0) from_eye: vec3f,
    @location(1) on_face: vec2f,
    @location(2) @interpolate(flat, either) half: vec2f,
    @location(3) @interpolate(flat, either) normal: vec3f,
    @location(4) @interpolate(flat, either) color: vec4f,
}

const HIDDEN = vec4f(0.0, 0.0, -1.0, 1.0);

fn face(body: Body, mask: u32, vertex: u32) -> Face {
    let id = vertex / 6u;
    let axis = id >> 1u;
    let side = f32(id & 1u) * 2.0 - 1.0;
    let u = body.axes[(axis + 1u) % 3u];
    let v = body.axes[(axis + 2u) % 3u];
    let w = body.axes[axis];
    let corner = quad_corner(vertex % 6u) * vec2f(u.w, v.w);
    var out: Face;
    out.normal = side * w.xyz;
    let middle = body.centre.xyz - frame.eye.xyz + out.normal * w.w;
    out.from_eye = middle + u.xyz * corner.x + v.xyz * corner.y;
    out.on_face = corner;
    out.half = vec2f(u.w, v.w);
    out.color = body.color;
    out.clip = clip_of(out.from_eye);
    // Faces turned away from the eye are left out, so that one can look through the back of a wall.
    if (mask >> id & 1u) == 0u || dot(out.normal, middle) >= 0.0 {
        out.clip = HIDDEN;
    }
    return out;
}

@vertex
fn vs_solid(@builtin(vertex_index) vertex: u32, @builtin(instance_index) i: u32) -> Face {
    return face(bodies[i], bodies[i].faces.x, vertex);
}

@vertex
fn vs_ghost(@builtin(vertex_index) vertex: u32, @builtin(instance_index) i: u32) -> Face {
    return face(bodies[i], bodies[i].faces.y, vertex);
}

// 1 on the lines of `width` pixels at distance 0, where one pixel is `pixel` wide; lines fade when they crowd.
fn line_near(distance: vec2f, pixel: vec2f, width: f32) -> vec2f {
    return saturate((width + 1.0) * 0.5 - distance / max(pixel, vec2f(1e-6)));
}

fn face_color(in: Face) -> vec4f {
    let pixel = fwidth(in.on_face);
    let edge = line_near(in.half - abs(in.on_face), pixel, 3.0);
    let pitch = frame.sun.w;
    let to_line = abs(fract(in.on_face / pitch - 0.5) - 0.5) * pitch;
    let fade = saturate(pitch / max(pixel, vec2f(1e-6)) / 6.0 - 0.5);
    let grid = line_near(to_line, pixel, 2.0) * fade;
    let square = floor(in.on_face / pitch);
    let checker = (fract((square.x + square.y) * 0.5) * 2.0 - 0.5) * min(fade.x, fade.y);
    let tone = 1.0 + in.color.w * (0.05 * checker - 0.16 * max(grid.x, grid.y));
    let lines = max(edge.x, edge.y) * (1.0 - in.color.w);
    let color = lit(in.color.rgb * tone, in.normal, -normalize(in.from_eye), 0.15);
    return vec4f(color * (1.0 - 0.55 * lines), lines);
}

@fragment
fn fs_solid(in: Face) -> @location(0) vec4f {
    return vec4f(face_color(in).rgb, 1.0);
}

@fragment
fn fs_ghost(in: Face) -> @location(0) vec4f {
    let color = face_color(in);
    return vec4f(color.rgb, 0.13 + 0.35 * color.w);
}

struct Ball {
    @builtin(position) clip: vec4f,
    @location(0) ray: vec3f,
    @location(1) @interpolate(flat, either) centre: vec4f,
    @location(2) @interpolate(flat, either) color: vec3f,
}

@vertex
fn vs_ball(@builtin(vertex_index) vertex: u32, @builtin(instance_index) i: u32) -> Ball {
    let radius = bodies[i].centre.w;
    let centre = bodies[i].centre.xyz - frame.eye.xyz;
    var out: Ball;
    out.clip = HIDDEN;
    if radius <= 0.0 || dot(centre, centre) <= radius * radius * 1.001 {
        return out;
    }
    out.centre = vec4f(centre, radius);
    out.ray = ball_corner(centre, radius, quad_corner(vertex));
    out.clip = clip_of(out.ray);
    out.color = bodies[i].color.rgb;
    return out;
}

struct Shaded {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fs_ball(in: Ball) -> Shaded {
    let hit = ball_hit(in.ray, in.centre.xyz, in.centre.w);
    if all(hit == vec3f(0.0)) {
        discard;
    }
    let n = (hit - in.centre.xyz) / in.centre.w;
    return Shaded(vec4f(lit(in.color, n, -normalize(hit), 0.3), 1.0), depth_of(hit));
}

// The twelve edges of the domain: four along each axis.
@vertex
fn vs_edge(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4f {
    let line = vertex >> 1u;
    let axis = line >> 2u;
    var at = vec3f(0.0);
    at[axis] = f32(vertex & 1u);
    at[(axis + 1u) % 3u] = f32(line & 1u);
    at[(axis + 2u) % 3u] = f32(line >> 1u & 1u);
    return clip_of(mix(frame.lo.xyz, frame.hi.xyz, at) - frame.eye.xyz);
}

@fragment
fn fs_edge() -> @location(0) vec4f {
    return vec4f(0.02, 0.03, 0.05, 0.35);
}
