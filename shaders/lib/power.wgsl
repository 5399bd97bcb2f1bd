// Largest power of two not above `x`. Twin: `power` in src/cpu/solve.rs.
fn power(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(max(x, 0x1p-126f)) & 0x7f800000u);
}
