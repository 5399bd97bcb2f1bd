// Signed distances on regular grids, interpolated between their points. Twin: src/math/distance_grid.rs.
// Needs the bindings distance_grids, distances.

fn stored_distance(i: u32) -> f32 {
    return textureLoad(distances, vec2u(i % DISTANCES_WIDTH, i / DISTANCES_WIDTH), 0).x;
}

// Distance (negative inside) and outward normal at `p`. Distances are stored in units of the grid's spacing. For a
// point outside of the grid's box the distance is a lower bound from the nearest point of the box.
fn grid_surface(index: u32, p: vec3f) -> Surface {
    let grid = distance_grids[index];
    let asked = (p - grid.lo) * grid.inverse_spacing;
    let inside = max(min(asked, grid.last), vec3f(0.0));
    let out = asked - inside;
    let cell = min(vec3u(inside), vec3u(grid.last) - 1u);
    let f = inside - vec3f(cell);
    let e = 1.0 - f;
    let row = u32(grid.last.x) + 1u;
    let layer = row * (u32(grid.last.y) + 1u);
    let first = grid.first + cell.x + cell.y * row + cell.z * layer;
    let v000 = stored_distance(first);
    let v100 = stored_distance(first + 1u);
    let v010 = stored_distance(first + row);
    let v110 = stored_distance(first + row + 1u);
    let v001 = stored_distance(first + layer);
    let v101 = stored_distance(first + layer + 1u);
    let v011 = stored_distance(first + layer + row);
    let v111 = stored_distance(first + layer + row + 1u);
    let x00 = v000 * e.x + v100 * f.x;
    let x10 = v010 * e.x + v110 * f.x;
    let x01 = v001 * e.x + v101 * f.x;
    let x11 = v011 * e.x + v111 * f.x;
    let y0 = x00 * e.y + x10 * f.y;
    let y1 = x01 * e.y + x11 * f.y;
    let value = y0 * e.z + y1 * f.z;
    let near = (v100 - v000) * e.y + (v110 - v010) * f.y;
    let far = (v101 - v001) * e.y + (v111 - v011) * f.y;
    let slope = vec3f(near * e.z + far * f.z, (x10 - x00) * e.z + (x11 - x01) * f.z, y1 - y0);
    let beyond = dot3(out, out);
    var distance = value;
    var away = slope;
    if beyond > 0.0 {
        distance = sqrt(beyond + value * value);
        away = select(out, slope * value, out == vec3f(0.0));
    }
    let length = sqrt(dot3(away, away));
    if length > 1e-6 {
        return Surface(away * (1.0 / length), distance * grid.spacing);
    }
    return Surface(vec3f(0.0, 1.0, 0.0), distance * grid.spacing);
}
