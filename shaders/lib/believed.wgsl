// Which measures of volume a particle believes. Twin: src/stages/believed.rs. Needs kernel, bins, the binding constants, and
// `tile_volume`, which says what a node of the tile holds.

fn even(x: vec3f, first_of_tile: u32, unit: f32) -> bool {
    let first = base(x);
    let open = (vec3u(constants.open_sides) >> vec3u(0u, 2u, 4u)) & vec3u(3u);
    // More than any node can hold.
    var least = 4294967296.0;
    var most = 0.0;
    for (var k = 0u; k < 3u; k++) {
        for (var j = 0u; j < 3u; j++) {
            for (var i = 0u; i < 3u; i++) {
                let at = vec3u(i, j, k);
                let node = vec3f(first + at);
                // Not on walls nor behind them.
                let above = ((open & vec3u(1u)) != vec3u(0u)) | (node - constants.lo >= vec3f(0.5));
                let below = ((open & vec3u(2u)) != vec3u(0u)) | (constants.hi - node >= vec3f(0.5));
                if all(above & below) {
                    let volume = tile_volume(first_of_tile + tile_index(at)) * unit;
                    least = min(least, volume);
                    most = max(most, volume);
                }
            }
        }
    }
    return least >= most * EVEN;
}

// The volume fraction measured at a particle, of opposite sign where it is too little and believed nevertheless.
fn believed(fraction: f32, x: vec4f, first_of_tile: u32, unit: f32) -> f32 {
    if fraction * x.w < 1.0 - SHORTFALL && even(x.xyz, first_of_tile, unit) {
        return -fraction;
    }
    return fraction;
}
