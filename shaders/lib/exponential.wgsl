// Natural logarithm and exponential from additions, multiplications and one division, so that every device gives the
// same bits; the built-in ones differ. Twin: src/math/exponential.rs.

// The leading bits of ln 2, whose product with a small whole number is exact, and the rest.
const LN_2_HIGH = 0.693359375f;
const LN_2_LOW = -2.1219444e-4f;

// ln x for positive, normal numbers.
fn ln(x: f32) -> f32 {
    let bits = bitcast<u32>(x);
    let exponent = bitcast<i32>(bits - 0x3f3504f3u) >> 23u;
    let m = bitcast<f32>(bits - (bitcast<u32>(exponent) << 23u));
    let s = (m - 1.0) * (1.0 / (m + 1.0));
    let z = s * s;
    let series = s * (2.0 + z * (0.6666667f + z * (0.4f + z * (0.2857143f + z * 0.22222222f))));
    return series + f32(exponent) * 0.6931472f;
}

// e^x for -80 < x < 80.
fn exponential(x: f32) -> f32 {
    let power = floor(x * 1.442695f + 0.5);
    let r = x - power * LN_2_HIGH - power * LN_2_LOW;
    let tail = 0.041666668f + r * (0.008333334f + r * (0.0013888889f + r * 1.9841270e-4f));
    let series = 1.0 + r * (1.0 + r * (0.5 + r * (0.16666667f + r * tail)));
    return series * bitcast<f32>(u32(i32(power) + 127) << 23u);
}
