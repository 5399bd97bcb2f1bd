//! Natural logarithm and exponential in f32 from additions, multiplications and one division, so that every device gives
//! the same bits: the built-in ones differ. Errors are below 2e-7, of ln absolute for arguments between 1/10 and 10.
//! Twin: `shaders/lib/exponential.wgsl`.

const LN_2: f32 = std::f32::consts::LN_2;
/// The first bits of ln 2, which times a small whole number is exact, and the rest.
const LN_2_HIGH: f32 = 355.0 / 512.0;
const LN_2_LOW: f32 = -2.121_944_4e-4;
/// Bits of √½.
const SQRT_HALF: u32 = 0x3f35_04f3;

/// ln x of a positive, normal number.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits.wrapping_sub(SQRT_HALF) as i32) >> 23;
    let m = f32::from_bits(bits.wrapping_sub((exponent << 23) as u32));
    // m is in [√½, √2): the series of ln((1 + s)/(1 − s)).
    let s = (m - 1.0) * (1.0 / (m + 1.0));
    let z = s * s;
    let series = s * (2.0 + z * (2.0 / 3.0 + z * (2.0 / 5.0 + z * (2.0 / 7.0 + z * (2.0 / 9.0)))));
    series + exponent as f32 * LN_2
}

/// eˣ for −80 < x < 80.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let power = (x * std::f32::consts::LOG2_E + 0.5).floor();
    let r = x - power * LN_2_HIGH - power * LN_2_LOW;
    let tail = 1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0)));
    let series = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * tail)));
    series * f32::from_bits(((power as i32 + 127) << 23) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_double_precision() {
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
