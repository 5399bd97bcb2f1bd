// Which blocks are beside others. Twin: src/bins.rs. Needs the binding constants, and bins.

#if PERIODIC
// The block with these coordinates, where one beyond an end of the repeated ones is the one at the other end.
fn wrapped(block: vec3u) -> vec3u {
    let last = vec3u(constants.period) / EDGE;
    let below = select(block, last, block == vec3u(0u));
    return select(block, select(below, vec3u(1u), block > last), last > vec3u(0u));
}
#else
fn wrapped(block: vec3u) -> vec3u {
    return block;
}
#endif

fn neighbour(key: u32, k: u32) -> u32 {
    return block_key(wrapped(block_coordinates(key) + offset(k)));
}
