// A block and the 26 around it. Twin: `around` in src/stages/bin_wake.rs. Needs neighbours and lookup.

const AROUND = 27u;
// The block itself.
const MIDDLE = 13u;

// The table entry of the n-th of them, or NONE.
fn entry_around(at: vec3u, n: u32) -> u32 {
    // One more along each axis, so that none is below 0.
    let beyond = at + vec3u(n % 3u, n / 3u % 3u, n / 9u);
    if any(beyond == vec3u(0u)) || any(beyond > vec3u(LAST_BLOCK + 1u)) {
        return NONE;
    }
    return find_entry(block_key(wrapped(beyond - 1u)));
}
