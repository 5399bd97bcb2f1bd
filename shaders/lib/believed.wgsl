// Which measures of volume a particle believes. Twin: src/stages/believed.rs. Needs kernel, bins, the binding constants, and
// `tile_volume`, which says what a node of the tile holds.

// Whether nodes lie neither on walls nor behind them.
fn inside(node: vec3f) -> vec3<bool> {
    let open = (vec3u(constants.open_sides) >> vec3u(0u, 2u, 4u)) & vec3u(3u);
    let above = ((open & vec3u(1u)) != vec3u(0u)) | (node - constants.lo >= vec3f(0.5));
    let below = ((open & vec3u(2u)) != vec3u(0u)) | (constants.hi - node >= vec3f(0.5));
    return above & below;
}

fn even(x: vec3f, first_of_tile: u32) -> bool {
    let first = vec3f(base(x));
    let a = inside(first);
    let b = inside(first + 1.0);
    let c = inside(first + 2.0);
    // Those inside; all where there are none.
    let none = !(a | b | c);
    let low = select(select(vec3u(2u), vec3u(1u), b), vec3u(0u), a | none);
    let high = select(select(vec3u(0u), vec3u(1u), b), vec3u(2u), c | none);
    var least = tile_volume(first_of_tile + tile_index(low));
    var most = least;
    for (var k = low.z; k <= high.z; k++) {
        for (var j = low.y; j <= high.y; j++) {
            for (var i = low.x; i <= high.x; i++) {
                let volume = tile_volume(first_of_tile + tile_index(vec3u(i, j, k)));
                least = min(least, volume);
                most = max(most, volume);
            }
        }
    }
    return least >= most * EVEN;
}

// The volume fraction measured at a particle, of opposite sign where it is too little and believed nevertheless.
fn believed(fraction: f32, x: vec4f, first_of_tile: u32) -> f32 {
    if fraction * x.w < 1.0 - SHORTFALL && even(x.xyz, first_of_tile) {
        return -fraction;
    }
    return fraction;
}
