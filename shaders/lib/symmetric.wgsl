// Symmetric matrices: stresses and strains. Twin: src/math/symmetric.rs. Needs linear.

// The symmetric part of a matrix.
fn symmetric(m: mat3x3f) -> Symmetric {
    return Symmetric(
        vec3f(m[0][0], m[1][1], m[2][2]),
        vec3f(0.5 * (m[1][2] + m[2][1]), 0.5 * (m[0][2] + m[2][0]), 0.5 * (m[0][1] + m[1][0])),
    );
}

fn symmetric_trace(s: Symmetric) -> f32 {
    return s.diagonal.x + s.diagonal.y + s.diagonal.z;
}

fn traceless(s: Symmetric) -> Symmetric {
    return Symmetric(s.diagonal - symmetric_trace(s) * (1.0 / 3.0), s.off);
}

// The symmetric part of a matrix, without its mean.
fn deviator(m: mat3x3f) -> Symmetric {
    return traceless(symmetric(m));
}

fn columns(s: Symmetric) -> mat3x3f {
    let d = s.diagonal;
    let o = s.off;
    return mat3x3f(d.x, o.z, o.y, o.z, d.y, o.x, o.y, o.x, d.z);
}

fn times(a: Symmetric, s: f32) -> Symmetric {
    return Symmetric(a.diagonal * s, a.off * s);
}

fn sum_of(a: Symmetric, b: Symmetric) -> Symmetric {
    return Symmetric(a.diagonal + b.diagonal, a.off + b.off);
}

fn difference(a: Symmetric, b: Symmetric) -> Symmetric {
    return Symmetric(a.diagonal - b.diagonal, a.off - b.off);
}

// Sum of the products of all nine entries.
fn product(a: Symmetric, b: Symmetric) -> f32 {
    return dot3(a.diagonal, b.diagonal) + 2.0 * dot3(a.off, b.off);
}

// The matrix, shortened to the norm `bound` if it is longer.
fn shortened(a: Symmetric, bound: f32) -> Symmetric {
    let square = product(a, a);
    if square > bound * bound {
        return times(a, bound * (1.0 / sqrt(square)));
    }
    return a;
}

// The matrix rotated with the skew part of the displacement gradient `d`, by Cayley's rotation.
fn turned(s: Symmetric, d: mat3x3f) -> Symmetric {
    let t = vec3f((d[1][2] - d[2][1]) * 0.25, (d[2][0] - d[0][2]) * 0.25, (d[0][1] - d[1][0]) * 0.25);
    let k = 1.0 / (0.5 + 0.5 * dot3(t, t));
    let q = t * t;
    let r = vec3f(t.y * t.z, t.x * t.z, t.x * t.y);
    let turn = mat3x3f(
        1.0 - k * (q.y + q.z), k * (r.z + t.z), k * (r.y - t.y),
        k * (r.z - t.z), 1.0 - k * (q.x + q.z), k * (r.x + t.x),
        k * (r.y + t.y), k * (r.x - t.x), 1.0 - k * (q.x + q.y),
    );
    let m = columns(s);
    let a = transform(turn, m[0]);
    let b = transform(turn, m[1]);
    let c = transform(turn, m[2]);
    let x = transform(turn, vec3f(a.x, b.x, c.x));
    let y = transform(turn, vec3f(a.y, b.y, c.y));
    let z = transform(turn, vec3f(a.z, b.z, c.z));
    return Symmetric(vec3f(x.x, y.y, z.z), vec3f(y.z, x.z, x.y));
}
