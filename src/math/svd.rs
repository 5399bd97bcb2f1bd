//! Singular value decomposition of 3×3 matrices by columns. Twin: `shaders/lib/svd.wgsl`.
//!
//! One-sided Jacobi (Hestenes): rotations V make the columns of `F V` orthogonal, the longest first; Gram-Schmidt then
//! gives U and Σ. Every rotation is proper and U is completed by a cross product, so that det U = det V = 1 and the
//! sign of det F is left with the smallest singular value. Rejected: Jacobi on `Fᵀ F`, which squares the condition (the
//! columns are then orthogonal to √ε only; measured, 2.5e-4 in f32) and is no faster.
//!
//! Errors are a few units in the last place of the largest singular value; values below about ε^(3/2) of it are
//! returned as zero. Denormal numbers are read and written as zero, because devices may flush them, and neither
//! decisions nor results depend on those that arise in between.
//!
//! Four matrices are decomposed at a time, one per lane, each with the same result as alone.
//!
//! A sweep takes at most 240 operations with 9 divisions and 6 roots, the rest 160. In f32, deformations near the
//! identity take 2.3 sweeps in the mean, each by itself, random matrices 2.8, rotations 1.

use super::linear::{add, cross, dot, scale, sub};
use super::real::{Lanes, Real};

/// Most sweeps over the three pairs of columns: a bound for matrices with NaN. Others need up to 4 in f32, 5 in f64.
pub const SWEEPS: usize = 8;

/// `F = U diag(sigma) Vᵀ` with proper rotations U and V.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Svd<T> {
    /// U, as columns.
    pub u: [[T; 3]; 3],
    /// Singular values, descending by magnitude; only the last may be negative.
    pub sigma: [T; 3],
    /// V, as columns.
    pub v: [[T; 3]; 3],
}

/// Singular value decomposition. For a matrix that is not finite the result is arbitrary, after bounded time.
#[inline]
pub fn svd<R: Real>(f: &[[R; 3]; 3]) -> Svd<R> {
    let Svd { u, sigma, v } = svd_of_four::<R>(&f.map(|column| column.map(R::V::all)));
    let first = |x: R::V| x.to4()[0];
    Svd { u: u.map(|c| c.map(first)), sigma: sigma.map(first), v: v.map(|c| c.map(first)) }
}

/// The same for four matrices, lane by lane, in the time of one.
#[inline(always)]
pub fn svd_of_four<R: Real>(f: &[[R::V; 3]; 3]) -> Svd<R::V> {
    let (scaled, power) = scaled_svd::<R>(f);
    Svd { sigma: restored::<R>(scaled.sigma, power), ..scaled }
}

/// Largest product of two columns that count as orthogonal, if the longer has the squared length `square`.
#[inline(always)]
fn limit<R: Real>(square: R::V) -> R::V {
    (R::V::all(R::EPSILON) * square).max(R::V::all(floor()))
}

/// Zero beside numbers of about one: far above the size at which denormal terms could matter.
#[inline(always)]
fn floor<R: Real>() -> R {
    R::EPSILON * R::EPSILON * R::EPSILON
}

/// `x` with entries smaller than `below` set to zero.
#[inline(always)]
fn flushed<R: Real>(x: [R::V; 3], below: R) -> [R::V; 3] {
    let (below, zero) = (R::V::all(below), R::V::all(R::of(0.0)));
    x.map(|c| c.abs().below(below).pick(zero, c))
}

/// Numbers of the scaled matrix, scaled back.
#[inline(always)]
fn restored<R: Real>(x: [R::V; 3], power: R::V) -> [R::V; 3] {
    // Twice the smallest normal number: below that, rounding to it and flushing to zero may happen in either order.
    flushed::<R>(scale(scale(x, R::V::all(R::of(0.5))), power), R::MIN_POSITIVE + R::MIN_POSITIVE)
}

/// The decomposition of `2 F / power`, whose largest entry is in [2, 4), and that power of two.
#[inline(always)]
fn scaled_svd<R: Real>(f: &[[R::V; 3]; 3]) -> (Svd<R::V>, R::V) {
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let identity = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let largest_of = |x: [R::V; 3]| x[0].abs().max(x[1].abs()).max(x[2].abs());
    let largest = largest_of(f[0]).max(largest_of(f[1])).max(largest_of(f[2]));
    let nothing = largest.below(R::V::all(R::MIN_POSITIVE));
    let (power, twice_inverse) = nothing.pick(one, largest).binade();
    let mut b = f.map(|column| scale(flushed::<R>(column, R::MIN_POSITIVE), twice_inverse));
    let mut v = identity;
    orthogonalise::<R>(&mut b, &mut v);

    let length = dot(b[0], b[0]).sqrt();
    let u0 = flushed::<R>(scale(b[0], one / length), floor());
    // Twice: the rest of a short column may be small against what is subtracted from it.
    let once = sub(b[1], scale(u0, dot(u0, b[1])));
    let rest = sub(once, scale(u0, dot(u0, once)));
    let square = dot(rest, rest);
    let spans = R::V::all(floor()).below(square);
    let middle = spans.pick(square.sqrt(), zero);
    let u1 = pick::<R>(spans, scale(rest, one / middle), perpendicular::<R>(u0));
    let u2 = cross(u0, u1);
    let smallest = dot(u2, b[2]);
    // The columns are in order up to rounding.
    let middle = length.below(middle).pick(length, middle);
    let smallest = middle.below(smallest).pick(middle, smallest);
    let smallest = smallest.below(-middle).pick(-middle, smallest);
    let u = [u0, flushed::<R>(u1, floor()), flushed::<R>(u2, floor())];
    let sigma = flushed::<R>([length, middle, smallest], floor());
    let v = v.map(|column| flushed::<R>(column, floor()));
    let unit = |m: [[R::V; 3]; 3]| [0, 1, 2].map(|c| pick::<R>(nothing, identity[c], m[c]));
    let sigma = pick::<R>(nothing, [zero; 3], sigma);
    (Svd { u: unit(u), sigma, v: unit(v) }, nothing.pick(zero, power))
}

/// Selects one of two vectors, lane by lane.
#[inline(always)]
fn pick<R: Real>(mask: R::V, a: [R::V; 3], b: [R::V; 3]) -> [R::V; 3] {
    [0, 1, 2].map(|i| mask.pick(a[i], b[i]))
}

/// A unit vector perpendicular to the unit vector `a`.
#[inline(always)]
fn perpendicular<R: Real>(a: [R::V; 3]) -> [R::V; 3] {
    let [zero, one] = [0.0, 1.0].map(|x| R::V::all(R::of(x)));
    let beside_z = a[2].abs().below(a[0].abs());
    let [long, other] = [beside_z.pick(a[0], a[1]), beside_z.pick(a[1], a[2])];
    let inverse = one / (long * long + other * other).sqrt();
    let (long, other) = (long * inverse, -other * inverse);
    pick::<R>(beside_z, [other, long, zero], [zero, other, long])
}

/// Rotates the columns of `b` until they are orthogonal, and those of `v` with them; returns the number of sweeps that
/// the slowest lane needs.
#[inline(always)]
fn orthogonalise<R: Real>(b: &mut [[R::V; 3]; 3], v: &mut [[R::V; 3]; 3]) -> usize {
    let ([b0, b1, b2], [v0, v1, v2]) = (b, v);
    let zero = R::V::all(R::of(0.0));
    // Lanes that are done stay as they are.
    let mut going = zero.at_most(zero);
    for sweep in 1..=SWEEPS {
        turn::<R>(going, b0, b1, v0, v1);
        turn::<R>(going, b0, b2, v0, v2);
        turn::<R>(going, b1, b2, v1, v2);
        // The last pair is orthogonal now; the rotations after the first may have spoilt the others.
        let square = dot(*b0, *b0);
        // Twice the limit of a rotation, so that the loop ends when no rotation would change anything.
        let limit = limit::<R>(square) + limit::<R>(square);
        let in_order = (dot(*b1, *b1) - square).at_most(limit);
        let done = dot(*b0, *b1).abs().at_most(limit).and(dot(*b0, *b2).abs().at_most(limit)).and(in_order);
        going = done.pick(zero, going);
        if !going.any() {
            return sweep;
        }
    }
    SWEEPS
}

/// Rotates `x` and `y` in their plane until they are orthogonal and `x` is the longer, in the lanes that are `going`.
#[inline(always)]
fn turn<R: Real>(going: R::V, x: &mut [R::V; 3], y: &mut [R::V; 3], vx: &mut [R::V; 3], vy: &mut [R::V; 3]) {
    let [zero, half, one] = [0.0, 0.5, 1.0].map(|x| R::V::all(R::of(x)));
    let (a, b, p) = (dot(*x, *x), dot(*y, *y), dot(*x, *y));
    let limit = limit::<R>(a.max(b));
    let (slants, exchange) = (limit.below(p.abs()), limit.below(b - a));
    let turns = going.and(slants.pick(slants, exchange));
    if !turns.any() {
        return;
    }
    let exchange = slants.pick(a.below(b), exchange);
    let cotangent = (b - a).abs() * (half * (one / p.abs()));
    let tangent = one / (cotangent + (one + cotangent * cotangent).sqrt());
    let tangent = slants.pick(p.below(zero).pick(-tangent, tangent), zero);
    let cosine = one / (one + tangent * tangent).sqrt();
    let sine = tangent * cosine;
    // A quarter turn less, which puts the longer column first.
    let (c, s) = (exchange.pick(sine, cosine), exchange.pick(cosine, sine));
    let turned = |x: [R::V; 3], y: [R::V; 3]| {
        let (to_x, to_y) = (add(scale(x, c), scale(y, s)), sub(scale(y, c), scale(x, s)));
        (pick::<R>(turns, to_x, x), pick::<R>(turns, to_y, y))
    };
    (*x, *y) = turned(*x, *y);
    (*vx, *vy) = turned(*vx, *vy);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::matrices::{self, Errors, KINDS, Matrix, NEAR_IDENTITY, RANDOM, svd_errors};

    fn f64s<R: Real>(m: &[[R; 3]; 3]) -> Matrix {
        m.map(|column| column.map(R::f64))
    }

    /// The largest errors over matrices of one kind.
    fn errors<R: Real>(kind: u64, count: u64) -> Errors {
        let tiny = R::MIN_POSITIVE.f64();
        let of = |i| {
            let f = matrices::matrix(i * KINDS + kind).map(|column| column.map(R::of));
            let Svd { u, sigma, v } = svd(&f);
            svd_errors(&f64s(&f), &f64s(&u), sigma.map(R::f64), &f64s(&v), tiny)
        };
        (0..count).map(of).fold(Errors::default(), Errors::max)
    }

    /// Sweeps over matrices of one kind: the mean and the largest number.
    fn sweeps<R: Real>(kind: u64, count: u64) -> (f64, usize) {
        let counts = (0..count).map(|i| {
            let b = matrices::matrix(i * KINDS + kind).map(|column| column.map(R::of));
            let largest = b.iter().flatten().map(|c| c.abs()).fold(R::of(0.0), R::max);
            if largest < R::MIN_POSITIVE {
                return 0;
            }
            let mut b = b.map(|column| scale(column, Real::binade(largest).1).map(R::V::all));
            let mut v = [[R::V::all(R::of(0.0)); 3]; 3];
            orthogonalise::<R>(&mut b, &mut v)
        });
        let (sum, most) = counts.fold((0, 0), |(sum, most), n| (sum + n, n.max(most)));
        (sum as f64 / count as f64, most)
    }

    fn check<R: Real>(count: u64, product: f64, rotation: f64) {
        for kind in 0..KINDS {
            let found = errors::<R>(kind, count / KINDS);
            println!("{kind:3} {:8.1e} {:8.1e}", found.product, found.rotation);
            assert!(found.product <= product && found.rotation <= rotation, "kind {kind}: {found:?}");
        }
    }

    #[test]
    fn a_million_matrices_in_f32() {
        check::<f32>(1_000_000, 1e-6, 2e-6);
    }

    #[test]
    fn many_matrices_in_f64() {
        check::<f64>(200_000, 2e-15, 4e-15);
    }

    #[test]
    fn sweeps_end_by_themselves() {
        for kind in 0..KINDS {
            let (of_f32, of_f64) = (sweeps::<f32>(kind, 10_000), sweeps::<f64>(kind, 10_000));
            println!("{kind:3} sweeps {of_f32:?} {of_f64:?}");
            assert!(of_f32.1.max(of_f64.1) < SWEEPS - 1, "kind {kind}: {of_f32:?} {of_f64:?}");
        }
        let (near, any) = (sweeps::<f32>(NEAR_IDENTITY, 10_000).0, sweeps::<f32>(RANDOM, 10_000).0);
        assert!(near < 2.5 && any < 3.0, "{near} {any}");
    }

    #[test]
    fn what_is_known_comes_out() {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f32]];
        assert_eq!(svd(&identity), Svd { u: identity, sigma: [1.0; 3], v: identity });
        assert_eq!(svd(&[[0.0; 3]; 3]), Svd { u: identity, sigma: [0.0; 3], v: identity });
        assert_eq!(svd(&[[1e-40f32; 3]; 3]).sigma, [0.0; 3], "denormal numbers count as zero");
        let diagonal = |a, b, c| [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]];
        assert_eq!(svd(&diagonal(2.0, -8.0, 4.0f32)).sigma, [8.0, 4.0, -2.0]);
        assert_eq!(svd(&diagonal(-2.0, -8.0, 4.0f32)).sigma, [8.0, 4.0, 2.0]);
    }

    #[test]
    fn powers_of_two_scale_the_singular_values_alone() {
        for i in 0..1000 {
            let f = matrices::matrix(i * KINDS + RANDOM).map(|column| column.map(|x| x as f32));
            let one = svd(&f);
            for power in [1e18f32.binade().0, 1e-18f32.binade().0, 0.25] {
                let other = svd(&f.map(|column| scale(column, power)));
                assert_eq!(other, Svd { sigma: scale(one.sigma, power), ..one });
            }
        }
    }

    /// The other lanes may need more sweeps, or none.
    #[test]
    fn each_lane_is_as_by_itself() {
        let bits = |m: [[f32; 3]; 3]| m.map(|column| column.map(f32::to_bits));
        for i in 0..20_000 {
            let mut four = [0, 1, 2, 3].map(|n| matrices::matrix(4 * i + n * n).map(|column| column.map(|x| x as f32)));
            if i % 8 == 0 {
                four[(i / 8 % 4) as usize][1][1] = f32::NAN;
            }
            let lanes = [0, 1, 2].map(|c| [0, 1, 2].map(|r| wide::f32x4::from(four.map(|m| m[c][r]))));
            let together = svd_of_four::<f32>(&lanes);
            for (n, alone) in four.iter().map(svd).enumerate() {
                let of = |x: wide::f32x4| x.to_array()[n];
                let (u, v) = (together.u.map(|c| c.map(of)), together.v.map(|c| c.map(of)));
                let known = four[n].iter().flatten().all(|x| x.is_finite());
                let same = (bits(u), bits(v)) == (bits(alone.u), bits(alone.v));
                let values = together.sigma.map(|s| of(s).to_bits()) == alone.sigma.map(f32::to_bits);
                assert!(!known || same && values, "lane {n} of {four:?}");
            }
        }
    }

    #[test]
    fn what_is_not_finite_ends() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for i in 0..9 {
                let mut f = [[1.0, 2.0, 3.0], [0.0; 3], [4.0, 5.0, 7.0]];
                f[i / 3][i % 3] = x;
                svd(&f);
            }
            svd(&[[x; 3]; 3]);
        }
    }
}
