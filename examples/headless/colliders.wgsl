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

// Bodies that rays are sent at: round ones, and containers of every shape. Of a container the far side is drawn solid,
// seen from inside, and the near one see-through.
struct Round {
    @builtin(position) clip: vec4f,
    @location(0) ray: vec3f,
    @location(1) @interpolate(flat, either) body: u32,
}

// The far faces of the box around the body, which cover it once, wherever the eye is.
@vertex
fn vs_round(@builtin(vertex_index) vertex: u32, @builtin(instance_index) i: u32) -> Round {
    let body = bodies[i];
    let id = vertex / 6u;
    let axis = id >> 1u;
    let side = f32(id & 1u) * 2.0 - 1.0;
    let corner = quad_corner(vertex % 6u);
    let u = body.axes[(axis + 1u) % 3u];
    let v = body.axes[(axis + 2u) % 3u];
    let w = body.axes[axis];
    let middle = body.centre.xyz - frame.eye.xyz + side * w.xyz * w.w;
    var out: Round;
    out.ray = middle + u.xyz * u.w * corner.x + v.xyz * v.w * corner.y;
    out.body = i;
    out.clip = clip_of(out.ray);
    if body.faces.z == SOLID_FACES || dot(w.xyz, middle) * side < 0.0 {
        out.clip = HIDDEN;
    }
    return out;
}

const SOLID_FACES = 0u;
const BOX = 1u;
const BALL = 2u;
const CAPSULE = 3u;
const CYLINDER = 4u;

// Part of a ray inside of a convex body, and the outward normals where it begins and ends.
struct Span {
    near: f32,
    far: f32,
    near_normal: vec3f,
    far_normal: vec3f,
}

const NOWHERE = Span(1.0, -1.0, vec3f(0.0), vec3f(0.0));
const FAR = 1e9;

fn ball_span(o: vec3f, d: vec3f, centre: vec3f, radius: f32) -> Span {
    let along = dot(d, centre - o);
    let off = o + d * along - centre;
    let h2 = radius * radius - dot(off, off);
    if h2 <= 0.0 {
        return NOWHERE;
    }
    let h = sqrt(h2);
    return Span(along - h, along + h, (off - d * h) / radius, (off + d * h) / radius);
}

fn tube_span(o: vec3f, d: vec3f, radius: f32) -> Span {
    let a = dot(d.xz, d.xz);
    if a < 1e-12 {
        let inside = dot(o.xz, o.xz) < radius * radius;
        return Span(select(1.0, -FAR, inside), select(-1.0, FAR, inside), vec3f(0.0), vec3f(0.0));
    }
    let along = -dot(d.xz, o.xz) / a;
    let off = o.xz + d.xz * along;
    let h2 = (radius * radius - dot(off, off)) / a;
    if h2 <= 0.0 {
        return NOWHERE;
    }
    let h = sqrt(h2);
    let near = (off - d.xz * h) / radius;
    let far = (off + d.xz * h) / radius;
    return Span(along - h, along + h, vec3f(near.x, 0.0, near.y), vec3f(far.x, 0.0, far.y));
}

fn slab_span(o: vec3f, d: vec3f, axis: u32, half: f32) -> Span {
    let speed = select(d[axis], 1e-9, abs(d[axis]) < 1e-9);
    var normal = vec3f(0.0);
    normal[axis] = sign(speed);
    let middle = -o[axis] / speed;
    let reach = half / abs(speed);
    return Span(middle - reach, middle + reach, -normal, normal);
}

fn both(a: Span, b: Span) -> Span {
    var out = a;
    if b.near > a.near {
        out.near = b.near;
        out.near_normal = b.near_normal;
    }
    if b.far < a.far {
        out.far = b.far;
        out.far_normal = b.far_normal;
    }
    return out;
}

fn span_of(body: Body, o: vec3f, d: vec3f) -> Span {
    let half = vec3f(body.axes[0].w, body.axes[1].w, body.axes[2].w);
    let ends = slab_span(o, d, 1u, half.y);
    switch body.faces.z {
        case BOX: { return both(both(slab_span(o, d, 0u, half.x), ends), slab_span(o, d, 2u, half.z)); }
        case BALL: { return ball_span(o, d, vec3f(0.0), half.x); }
        case CYLINDER: { return both(tube_span(o, d, half.x), ends); }
        default: {
            // A convex body's span begins where the first and ends where the last of its parts' does.
            let to_ball = vec3f(0.0, half.y - half.x, 0.0);
            let parts = array(
                both(tube_span(o, d, half.x), slab_span(o, d, 1u, to_ball.y)),
                ball_span(o, d, to_ball, half.x),
                ball_span(o, d, -to_ball, half.x),
            );
            var out = Span(FAR, -FAR, vec3f(0.0), vec3f(0.0));
            for (var i = 0; i < 3; i++) {
                let part = parts[i];
                if part.near > part.far {
                    continue;
                }
                if part.near < out.near {
                    out.near = part.near;
                    out.near_normal = part.near_normal;
                }
                if part.far > out.far {
                    out.far = part.far;
                    out.far_normal = part.far_normal;
                }
            }
            return out;
        }
    }
}

struct Met {
    at: vec3f, // seen from the eye
    normal: vec3f,
    found: bool,
}

fn meet(in: Round, far_side: bool) -> Met {
    let body = bodies[in.body];
    let axes = mat3x3f(body.axes[0].xyz, body.axes[1].xyz, body.axes[2].xyz);
    let d = normalize(in.ray);
    let span = span_of(body, (frame.eye.xyz - body.centre.xyz) * axes, d * axes);
    let t = select(span.near, span.far, far_side);
    let normal = axes * select(span.near_normal, -span.far_normal, far_side);
    return Met(d * t, normal, span.near < span.far && t * dot(d, frame.forward.xyz) > frame.eye.w);
}

@fragment
fn fs_round(in: Round) -> Shaded {
    let container = bodies[in.body].faces.w != 0u;
    let met = meet(in, container);
    if !met.found {
        discard;
    }
    let color = lit(bodies[in.body].color.rgb, met.normal, -normalize(met.at), select(0.3, 0.1, container));
    return Shaded(vec4f(color, 1.0), depth_of(met.at));
}

@fragment
fn fs_glass(in: Round) -> Shaded {
    let met = meet(in, false);
    if bodies[in.body].faces.w == 0u || !met.found {
        discard;
    }
    let to_eye = -normalize(met.at);
    let rim = pow(1.0 - saturate(dot(met.normal, to_eye)), 3.0);
    let color = lit(bodies[in.body].color.rgb, met.normal, to_eye, 1.0);
    return Shaded(vec4f(color, 0.12 + 0.5 * rim), depth_of(met.at));
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
