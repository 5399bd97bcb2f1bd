//! Gradients and materials of four particles at a time.

use super::constants::MaterialConstants;
use super::gradient::{Gradient, material_of};
use crate::math::real::{Lanes, Real};

/// The materials of up to four particles. Missing ones repeat the last.
#[inline(always)]
pub fn materials_of<'a, R: Real>(
    gradients: &[Gradient<R>],
    materials: &'a [MaterialConstants<R>],
) -> [&'a MaterialConstants<R>; 4] {
    let last = gradients.len() - 1;
    [0, 1, 2, 3].map(|n: usize| &materials[material_of(&gradients[n.min(last)])])
}

/// The columns of up to four gradients with their fourth numbers. Lanes beyond the last repeat it.
#[inline(always)]
pub fn columns<R: Real>(gradients: &[Gradient<R>]) -> [[R::V; 4]; 3] {
    let last = gradients.len() - 1;
    let [a, b, c, d] = [&gradients[0], &gradients[1.min(last)], &gradients[2.min(last)], &gradients[3.min(last)]];
    // Written out: a map over arrays is not always compiled to wide vectors.
    let column =
        |i: usize| R::V::transposed([R::V::from4(a[i]), R::V::from4(b[i]), R::V::from4(c[i]), R::V::from4(d[i])]);
    [column(0), column(1), column(2)]
}

/// The same without the fourth numbers, and the first of these.
#[inline(always)]
pub fn matrices<R: Real>(gradients: &[Gradient<R>]) -> ([[R::V; 3]; 3], R::V) {
    let [[a, b, c, fourth], [d, e, f, _], [g, h, i, _]] = columns(gradients);
    ([[a, b, c], [d, e, f], [g, h, i]], fourth)
}

/// From lanes to four matrices.
#[inline(always)]
pub fn entries<R: Real>([a, b, c]: [[R::V; 3]; 3]) -> [[[R; 3]; 3]; 4] {
    let rows = |[x, y, z]: [R::V; 3]| R::V::transposed([x, y, z, x]);
    let (a, b, c) = (rows(a), rows(b), rows(c));
    let column = |row: R::V| {
        let [x, y, z, _] = row.to4();
        [x, y, z]
    };
    let matrix = |n: usize| [column(a[n]), column(b[n]), column(c[n])];
    [matrix(0), matrix(1), matrix(2), matrix(3)]
}

/// Stores a matrix in a gradient, beside its fourth numbers.
#[inline(always)]
pub fn store<R: Real>(gradient: &mut Gradient<R>, matrix: [[R; 3]; 3]) {
    for (to, [x, y, z]) in gradient.iter_mut().zip(matrix) {
        *to = [x, y, z, to[3]];
    }
}
