// Twin: `bounded` in src/stages/seek.rs.

// `x` within ±`bound`.
fn bounded(x: f32, bound: f32) -> f32 {
    return min(max(x, -bound), bound);
}
