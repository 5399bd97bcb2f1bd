//! Products of small vectors and matrices, with a fixed order of additions. Twin: `shaders/lib/linear.wgsl`.
//!
//! Entries are numbers, or lanes of them: four points at a time.

use std::ops::{Add, Mul, Sub};

/// Entries of vectors.
pub trait Scalar: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}
impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>> Scalar for T {}

/// a · b
#[inline(always)]
pub fn dot<T: Scalar>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b
#[inline(always)]
pub fn cross<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// v + a × b, summed from the left: drivers may reorder the sum of two products and a third in that way.
#[inline(always)]
pub fn add_cross<T: Scalar>(v: [T; 3], a: [T; 3], b: [T; 3]) -> [T; 3] {
    let along = |axis: usize| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        v[axis] + a[next] * b[last] - a[last] * b[next]
    };
    [along(0), along(1), along(2)]
}

/// a + b
#[inline(always)]
pub fn add<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b
#[inline(always)]
pub fn sub<T: Scalar>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a times s
#[inline(always)]
pub fn scale<T: Scalar>(a: [T; 3], s: T) -> [T; 3] {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `m · v` for a matrix by columns.
#[inline(always)]
pub fn transform<T: Scalar>(m: &[[T; 3]; 3], v: [T; 3]) -> [T; 3] {
    add(add(scale(m[0], v[0]), scale(m[1], v[1])), scale(m[2], v[2]))
}

/// `mᵀ · v` for a matrix by columns.
#[inline(always)]
pub fn transform_transposed<T: Scalar>(m: &[[T; 3]; 3], v: [T; 3]) -> [T; 3] {
    [dot(m[0], v), dot(m[1], v), dot(m[2], v)]
}
