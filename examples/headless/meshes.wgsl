// Bodies that are triangles. Of a container the far side is drawn solid, seen from inside, and the near one
// see-through.

struct Corner {
    position: vec4f, // in the body's frame, in cells; w: which body
    normal: vec4f,
}

@group(1) @binding(0) var<storage, read> corners: array<Corner>;

struct Facet {
    @builtin(position) clip: vec4f,
    @location(0) from_eye: vec3f,
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat, either) color: vec3f,
}

const HIDDEN = vec4f(0.0, 0.0, -1.0, 1.0);

fn facet(vertex: u32, glass: bool) -> Facet {
    let body = bodies[u32(corners[vertex].position.w)];
    let axes = mat3x3f(body.axes[0].xyz, body.axes[1].xyz, body.axes[2].xyz);
    let first = vertex - vertex % 3u;
    let a = corners[first].position.xyz;
    let flat = axes * cross(corners[first + 1u].position.xyz - a, corners[first + 2u].position.xyz - a);
    let container = body.faces.w != 0u;
    var out: Facet;
    out.from_eye = axes * corners[vertex].position.xyz + body.centre.xyz - frame.eye.xyz;
    out.normal = axes * corners[vertex].normal.xyz;
    out.color = body.color.rgb;
    out.clip = clip_of(out.from_eye);
    // Of a triangle the same for all corners.
    let facing = dot(flat, axes * a + body.centre.xyz - frame.eye.xyz) < 0.0;
    if container && !facing {
        out.normal = -out.normal;
    }
    if select(glass, facing != glass, container) {
        out.clip = HIDDEN;
    }
    return out;
}

@vertex
fn vs_solid(@builtin(vertex_index) vertex: u32) -> Facet {
    return facet(vertex, false);
}

@vertex
fn vs_glass(@builtin(vertex_index) vertex: u32) -> Facet {
    return facet(vertex, true);
}

@fragment
fn fs_solid(in: Facet) -> @location(0) vec4f {
    return vec4f(lit(in.color, normalize(in.normal), -normalize(in.from_eye), 0.3), 1.0);
}

@fragment
fn fs_glass(in: Facet) -> @location(0) vec4f {
    let to_eye = -normalize(in.from_eye);
    let normal = normalize(in.normal);
    let rim = pow(1.0 - saturate(dot(normal, to_eye)), 3.0);
    return vec4f(lit(in.color, normal, to_eye, 1.0), 0.12 + 0.5 * rim);
}
