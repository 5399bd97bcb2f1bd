//! Natural logarithm and exponential in f32 from additions, multiplications and one division, so that every device
//! gives the same bits; the built-in ones differ. Errors are below 2e-7; for ln this is the absolute error for
//! arguments between 1/10 and 10. Twin: `shaders/lib/exponential.wgsl`.

use bytemuck::cast;
use wide::{f32x4, i32x4};

const LN_2: f32 = std::f32::consts::LN_2;
/// The leading bits of ln 2, whose product with a small whole number is exact, and the rest.
const LN_2_HIGH: f32 = 355.0 / 512.0;
const LN_2_LOW: f32 = -2.121_944_4e-4;
/// Bits of √½.
const SQRT_HALF: i32 = 0x3f35_04f3;

/// ln x for positive, normal numbers.
#[inline(always)]
pub fn ln(x: f32x4) -> f32x4 {
    let all = f32x4::splat;
    let bits: i32x4 = cast(x);
    let exponent: i32x4 = (bits - i32x4::splat(SQRT_HALF)) >> 23;
    let m: f32x4 = cast(bits - (exponent << 23));
    // m is in [√½, √2): the series of ln((1 + s)/(1 − s)).
    let s = (m - all(1.0)) * (all(1.0) / (m + all(1.0)));
    let z = s * s;
    let tail = all(2.0 / 3.0) + z * (all(2.0 / 5.0) + z * (all(2.0 / 7.0) + z * all(2.0 / 9.0)));
    let series = s * (all(2.0) + z * tail);
    series + exponent.round_float() * all(LN_2)
}

/// eˣ for −80 < x < 80.
#[inline(always)]
pub fn exp(x: f32x4) -> f32x4 {
    let all = f32x4::splat;
    let power = floor(x * all(std::f32::consts::LOG2_E) + all(0.5));
    let r = x - power.round_float() * all(LN_2_HIGH) - power.round_float() * all(LN_2_LOW);
    let tail = all(1.0 / 24.0) + r * (all(1.0 / 120.0) + r * (all(1.0 / 720.0) + r * all(1.0 / 5040.0)));
    let series = all(1.0) + r * (all(1.0) + r * (all(0.5) + r * (all(1.0 / 6.0) + r * tail)));
    series * cast::<i32x4, f32x4>((power + i32x4::splat(127)) << 23)
}

/// The largest whole numbers not above `x`, which is within ±2³⁰.
#[inline(always)]
fn floor(x: f32x4) -> i32x4 {
    let whole = x.fast_trunc_int();
    // Where it was rounded up, the comparison's bits are −1.
    whole + cast::<f32x4, i32x4>(x.simd_lt(whole.round_float()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_double_precision() {
        let [ln, exp] = [ln, exp].map(|of| move |x: f32| of(f32x4::splat(x)).to_array()[0]);
        for i in 0..200_000 {
            let x = 0.1 * 1.000_023f64.powi(i) as f32;
            assert!((f64::from(ln(x)) - f64::from(x).ln()).abs() < 2e-7, "ln {x}");
            let y = -5.0 + 5e-5 * i as f32;
            let exact = f64::from(y).exp();
            assert!((f64::from(exp(y)) / exact - 1.0).abs() < 2e-7, "exp {y}");
        }
        assert_eq!((ln(1.0), exp(0.0)), (0.0, 1.0));
    }
}
