// Sums of 64 bits in two words, the lower first. Twin: src/stages/load.rs.

// A number rounded to a whole one.
fn wide(value: f32) -> vec2u {
    let size = min(abs(round(value)), MOST_WHOLE);
    let upper = floor(size * 0x1p-32);
    var high = u32(upper);
    var low = u32(size - upper * 0x1p32);
    if value < 0.0 {
        low = ~low + 1u;
        high = ~high + select(0u, 1u, low == 0u);
    }
    return vec2u(low, high);
}

// What is to be added to the upper word once `value` has been added to the lower one, which was `before`.
fn carried(before: u32, value: vec2u) -> u32 {
    return value.y + select(0u, 1u, before + value.x < value.x);
}

// `a` plus the rounded `value`, which is not negative.
fn plus(a: vec2u, value: f32) -> vec2u {
    let whole = wide(max(value, 0.0));
    return vec2u(a.x + whole.x, a.y + carried(a.x, whole));
}
