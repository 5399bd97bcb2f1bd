// Singular value decomposition of 3x3 matrices. Needs linear. Twin: src/math/svd.rs.

const SVD_EPSILON: f32 = 0x1p-23;
const SVD_FLOOR: f32 = 0x1p-69;
const SVD_MIN_POSITIVE: f32 = 0x1p-126;
const SVD_EXPONENT = 0x7f800000u;

// F = U diag(sigma) V^T with proper rotations U and V; sigma descends by magnitude, and only its last may be negative.
struct Svd {
    u: mat3x3f,
    sigma: vec3f,
    v: mat3x3f,
}

fn svd_flushed(x: vec3f, below: f32) -> vec3f {
    return select(x, vec3f(), abs(x) < vec3f(below));
}

fn svd_restored(x: vec3f, power: f32) -> vec3f {
    return svd_flushed(x * 0.5 * power, 2.0 * SVD_MIN_POSITIVE);
}

fn svd_largest(x: vec3f) -> f32 {
    return max(max(abs(x.x), abs(x.y)), abs(x.z));
}

fn svd_perpendicular(a: vec3f) -> vec3f {
    if abs(a.x) > abs(a.z) {
        let inverse = 1.0 / sqrt(a.x * a.x + a.y * a.y);
        return vec3f(-a.y * inverse, a.x * inverse, 0.0);
    }
    let inverse = 1.0 / sqrt(a.y * a.y + a.z * a.z);
    return vec3f(0.0, -a.z * inverse, a.y * inverse);
}

// Largest product of two columns that count as orthogonal, if the longer has the squared length `square`.
fn svd_limit(square: f32) -> f32 {
    return max(SVD_EPSILON * square, SVD_FLOOR);
}

// Rotates x and y in their plane until they are orthogonal and x is the longer.
fn svd_turn(
    x: ptr<function, vec3f>,
    y: ptr<function, vec3f>,
    vx: ptr<function, vec3f>,
    vy: ptr<function, vec3f>,
) {
    let x0 = *x;
    let y0 = *y;
    let a = dot3(x0, x0);
    let b = dot3(y0, y0);
    let p = dot3(x0, y0);
    let limit = svd_limit(max(a, b));
    var exchange = b - a > limit;
    var tangent = 0.0;
    if abs(p) > limit {
        exchange = b > a;
        let cotangent = abs(b - a) * (0.5 * (1.0 / abs(p)));
        tangent = 1.0 / (cotangent + sqrt(1.0 + cotangent * cotangent));
        if p < 0.0 {
            tangent = -tangent;
        }
    } else if !exchange {
        return;
    }
    let cosine = 1.0 / sqrt(1.0 + tangent * tangent);
    let sine = tangent * cosine;
    // A quarter turn less, which puts the longer column first.
    let c = select(cosine, sine, exchange);
    let s = select(sine, cosine, exchange);
    *x = x0 * c + y0 * s;
    *y = y0 * c - x0 * s;
    let vx0 = *vx;
    let vy0 = *vy;
    *vx = vx0 * c + vy0 * s;
    *vy = vy0 * c - vx0 * s;
}

fn svd_scaled(f: mat3x3f, power: ptr<function, f32>) -> Svd {
    var v0 = vec3f(1.0, 0.0, 0.0);
    var v1 = vec3f(0.0, 1.0, 0.0);
    var v2 = vec3f(0.0, 0.0, 1.0);
    let largest = max(max(svd_largest(f[0]), svd_largest(f[1])), svd_largest(f[2]));
    if largest < SVD_MIN_POSITIVE {
        *power = 0.0;
        return Svd(mat3x3f(v0, v1, v2), vec3f(), mat3x3f(v0, v1, v2));
    }
    let exponent = bitcast<u32>(largest) & SVD_EXPONENT;
    *power = bitcast<f32>(exponent);
    let twice_inverse = bitcast<f32>(SVD_EXPONENT - exponent);
    var b0 = svd_flushed(f[0], SVD_MIN_POSITIVE) * twice_inverse;
    var b1 = svd_flushed(f[1], SVD_MIN_POSITIVE) * twice_inverse;
    var b2 = svd_flushed(f[2], SVD_MIN_POSITIVE) * twice_inverse;
    for (var sweep = 0u; sweep < SVD_SWEEPS; sweep++) {
        svd_turn(&b0, &b1, &v0, &v1);
        svd_turn(&b0, &b2, &v0, &v2);
        svd_turn(&b1, &b2, &v1, &v2);
        // The last pair is orthogonal now; the rotations after the first may have spoilt the others.
        let square = dot3(b0, b0);
        // Twice the limit of a rotation, so that the loop ends when no rotation would change anything.
        let limit = svd_limit(square) + svd_limit(square);
        if abs(dot3(b0, b1)) <= limit && abs(dot3(b0, b2)) <= limit && dot3(b1, b1) - square <= limit {
            break;
        }
    }

    let length = sqrt(dot3(b0, b0));
    let u0 = svd_flushed(b0 * (1.0 / length), SVD_FLOOR);
    // Twice: the rest of a short column may be small against what is subtracted from it.
    let once = b1 - u0 * dot3(u0, b1);
    let rest = once - u0 * dot3(u0, once);
    let square = dot3(rest, rest);
    var middle = 0.0;
    var u1 = svd_perpendicular(u0);
    if square > SVD_FLOOR {
        middle = sqrt(square);
        u1 = rest * (1.0 / middle);
    }
    let u2 = cross3(u0, u1);
    var smallest = dot3(u2, b2);
    // The columns are in order up to rounding.
    if middle > length {
        middle = length;
    }
    if smallest > middle {
        smallest = middle;
    }
    if smallest < -middle {
        smallest = -middle;
    }
    return Svd(
        mat3x3f(u0, svd_flushed(u1, SVD_FLOOR), svd_flushed(u2, SVD_FLOOR)),
        svd_flushed(vec3f(length, middle, smallest), SVD_FLOOR),
        mat3x3f(svd_flushed(v0, SVD_FLOOR), svd_flushed(v1, SVD_FLOOR), svd_flushed(v2, SVD_FLOOR)),
    );
}

fn svd(f: mat3x3f) -> Svd {
    var power = 0.0;
    let scaled = svd_scaled(f, &power);
    return Svd(scaled.u, svd_restored(scaled.sigma, power), scaled.v);
}
