// The solid models, shared by the constraint and the integration: strain, yield, correction. Twin: src/stages/solid.rs.

// (1 + D) F
fn deformed(f: Deformation, d: mat3x3f) -> mat3x3f {
    return mat3x3f(
        f.x.xyz + transform(d, f.x.xyz),
        f.y.xyz + transform(d, f.y.xyz),
        f.z.xyz + transform(d, f.z.xyz),
    );
}

fn stretch_sign(sigma: vec3f) -> vec3f {
    return select(vec3f(1.0), vec3f(-1.0), sigma < vec3f(0.0));
}

// Magnitudes of principal stretches, within the range that is stored.
fn stretch_size(sigma: vec3f) -> vec3f {
    return min(max(abs(sigma), vec3f(MIN_STRETCH)), vec3f(MAX_STRETCH));
}

fn ln3(x: vec3f) -> vec3f {
    return vec3f(ln(x.x), ln(x.y), ln(x.z));
}

#if YIELDING
fn exponential3(x: vec3f) -> vec3f {
    return vec3f(exponential(x.x), exponential(x.y), exponential(x.z));
}

// A strain whose deviator is shortened to at most `limit`.
fn yielded(strain: vec3f, trace: f32, limit: f32) -> vec3f {
    let mean = trace * (1.0 / 3.0);
    let deviator = strain - mean;
    let square = dot3(deviator, deviator);
    if square <= limit * limit {
        return strain;
    }
    return mean + deviator * (limit * (1.0 / sqrt(square)));
}

// The elastic part of a logarithmic strain, and the slack that is left: how far sand has come apart, as a logarithm of
// volume, which must be taken back before it carries load again.
struct Elastic {
    strain: vec3f,
    slack: f32,
}

fn elastic_part(m: Material, strain: vec3f, slack: f32) -> Elastic {
    if m.model == MODEL_VISCOPLASTIC {
        return Elastic(yielded(strain, strain.x + strain.y + strain.z, m.yield_limit), slack);
    }
    let slackened = strain + slack * (1.0 / 3.0);
    let trace = slackened.x + slackened.y + slackened.z;
    if trace >= 0.0 {
        return Elastic(vec3f(0.0), min(trace, SLACKEST));
    }
    return Elastic(yielded(slackened, trace, -(m.yield_limit * trace)), 0.0);
}
#endif

#if TENSORS
// The logarithmic strain of a deformation gradient.
fn logarithmic_strain(f: Deformation) -> mat3x3f {
    let s = svd(mat3x3f(f.x.xyz, f.y.xyz, f.z.xyz));
    return along(s.u, ln3(stretch_size(s.sigma)));
}
#endif

// The symmetric matrix with these principal values along the columns of `u`.
fn along(u: mat3x3f, c: vec3f) -> mat3x3f {
    let u0 = u[0];
    let u1 = u[1];
    let u2 = u[2];
    let diagonal = u0 * u0 * c.x + u1 * u1 * c.y + u2 * u2 * c.z;
    // xy, xz, yz
    let off = u0.xxy * u0.yzz * c.x + u1.xxy * u1.yzz * c.y + u2.xxy * u2.yzz * c.z;
    return mat3x3f(diagonal.x, off.x, off.y, off.x, diagonal.y, off.z, off.y, off.z, diagonal.z);
}

// The target's principal stretches over the present ones.
fn target_ratio(m: Material, sigma: vec3f, slack: f32) -> vec3f {
    let size = stretch_size(sigma);
#if YIELDING
    if m.model != MODEL_ELASTIC {
        return stretch_sign(sigma) * exponential3(-elastic_part(m, ln3(size), slack).strain);
    }
#endif
    let rigid = stretch_sign(sigma) * (1.0 / size);
    if m.shape_weight < 1.0 {
        let volume = exponential(ln(size.x * size.y * size.z) * (-1.0 / 3.0));
        return volume + m.shape_weight * (rigid - volume);
    }
    return rigid;
}

fn determinant3(f: mat3x3f) -> f32 {
    return f[0].x * (f[1].y * f[2].z - f[1].z * f[2].y)
        + f[0].y * (f[1].z * f[2].x - f[1].x * f[2].z)
        + f[0].z * (f[1].x * f[2].y - f[1].y * f[2].x);
}

// Squared Frobenius norm.
fn norm3(m: mat3x3f) -> f32 {
    return dot3(m[0], m[0]) + dot3(m[1], m[1]) + dot3(m[2], m[2]);
}

// Anisotropy of 1 + D, 1 or more; see the twin.
fn anisotropy(d: mat3x3f) -> f32 {
    let m = mat3x3f(vec3f(1.0, 0.0, 0.0) + d[0], vec3f(0.0, 1.0, 0.0) + d[1], vec3f(0.0, 0.0, 1.0) + d[2]);
    let volume = max(abs(determinant3(m)), 0.05);
    return max(norm3(m) * (1.0 / 3.0) * exponential(ln(volume) * (-2.0 / 3.0)), 1.0);
}

// The displacement gradient steered to the target of the material; see the twin.
fn constrain_solid(m: Material, f: Deformation, d: mat3x3f) -> mat3x3f {
    let s = svd(deformed(f, d));
    let ratio = target_ratio(m, s.sigma, f.x.w);
    let c = min(max(ratio - 1.0, vec3f(-MAX_CORRECTION)), vec3f(MAX_CORRECTION));
    let b = along(s.u, c);
    let bd = mat3x3f(transform(b, d[0]), transform(b, d[1]), transform(b, d[2]));
    let gain = m.gain * (1.0 / anisotropy(d));
    return d + gain * (b + 0.5 * (bd + transpose(bd)));
}

// Whether all principal stretches are certainly within the range that is stored.
fn within_range(f: mat3x3f) -> bool {
    let norm = norm3(f);
    return norm <= MAX_STRETCH * MAX_STRETCH && determinant3(f) * (2.0 / MIN_STRETCH) >= norm;
}

struct Advanced {
    deformation: Deformation,
    volume_ratio: f32,
    clamped: bool, // whether a stretch has left the range that is stored
}

// A strain whose compression is reduced by as much as matter is `loosened`, at most to none, so that cohesive matter
// does not begin to pull.
fn relieved(strain: vec3f, loosened: f32) -> vec3f {
    let compression = -(strain.x + strain.y + strain.z);
    return strain + min(loosened, max(compression, 0.0)) * (1.0 / 3.0);
}

// Advances a deformation gradient, and the slack of sand, by the step's displacement gradient, and applies the yield
// surface.
fn advance_solid(m: Material, f: Deformation, d: mat3x3f, dense: bool, loosened: f32) -> Advanced {
    let moved = deformed(f, d);
    // For other matter that lane holds the correction.
    var slack = select(0.0, f.x.w + loosened, m.model == MODEL_SAND);
    if m.model == MODEL_ELASTIC && within_range(moved) {
        let kept = Deformation(vec4f(moved[0], slack), vec4f(moved[1], 0.0), vec4f(moved[2], 0.0));
        return Advanced(kept, determinant3(moved), false);
    }
    let s = svd(moved);
    var size = stretch_size(s.sigma);
    let clamped = any(size != abs(s.sigma));
#if YIELDING
    if m.model != MODEL_ELASTIC {
        var strain = ln3(size);
        if m.model != MODEL_SAND {
            strain = relieved(strain, loosened);
        }
        let elastic = elastic_part(m, strain, select(slack, 0.0, dense));
        size = exponential3(elastic.strain);
        slack = elastic.slack;
    }
#endif
    let signed = stretch_sign(s.sigma) * size;
    let a = s.u[0] * signed.x;
    let b = s.u[1] * signed.y;
    let c = s.u[2] * signed.z;
    let x = a * s.v[0].x + b * s.v[1].x + c * s.v[2].x;
    let y = a * s.v[0].y + b * s.v[1].y + c * s.v[2].y;
    let z = a * s.v[0].z + b * s.v[1].z + c * s.v[2].z;
    let kept = Deformation(vec4f(x, slack), vec4f(y, 0.0), vec4f(z, 0.0));
    return Advanced(kept, size.x * size.y * size.z * exponential(slack), clamped);
}
