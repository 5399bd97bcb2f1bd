// Products of small vectors and matrices, with the fixed order of additions of the CPU path; the built-in ones may use
// any. Twin: src/math/linear.rs.

fn dot3(a: vec3f, b: vec3f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

fn cross3(a: vec3f, b: vec3f) -> vec3f {
    return vec3f(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// v + a × b, summed from the left: drivers may reorder the sum of two products and a third in that way.
fn add_cross3(v: vec3f, a: vec3f, b: vec3f) -> vec3f {
    return vec3f(v.x + a.y * b.z - a.z * b.y, v.y + a.z * b.x - a.x * b.z, v.z + a.x * b.y - a.y * b.x);
}

// The diagonal matrix with these entries.
fn diagonal_of(v: vec3f) -> mat3x3f {
    return mat3x3f(v.x, 0.0, 0.0, 0.0, v.y, 0.0, 0.0, 0.0, v.z);
}

fn transform(m: mat3x3f, v: vec3f) -> vec3f {
    return m[0] * v.x + m[1] * v.y + m[2] * v.z;
}

fn transform_transposed(m: mat3x3f, v: vec3f) -> vec3f {
    return vec3f(dot3(m[0], v), dot3(m[1], v), dot3(m[2], v));
}
