//! Products of small vectors and matrices, with a fixed order of additions. Twin: `shaders/lib/linear.wgsl`.

use super::real::Real;

/// a · b
#[inline(always)]
pub fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + b
#[inline(always)]
pub fn add<R: Real>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b
#[inline(always)]
pub fn sub<R: Real>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a times s
#[inline(always)]
pub fn scale<R: Real>(a: [R; 3], s: R) -> [R; 3] {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `m · v` for a matrix of columns.
#[inline(always)]
pub fn transform<R: Real>(m: &[[R; 3]; 3], v: [R; 3]) -> [R; 3] {
    add(add(scale(m[0], v[0]), scale(m[1], v[1])), scale(m[2], v[2]))
}

/// `mᵀ · v` for a matrix of columns.
#[inline(always)]
pub fn transform_transposed<R: Real>(m: &[[R; 3]; 3], v: [R; 3]) -> [R; 3] {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}
