// Turns what pressures do to the nodes into a velocity field, where bodies do not hold it. Twin: src/stages/project.rs.
#import layout
#import linear
#import scales
#import wide
#import totals
#import hold

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> grid: array<vec4f>;
@group(0) @binding(2) var<storage, read> held: array<Held>;
@group(0) @binding(3) var<storage, read_write> force: array<vec4i>;
@group(0) @binding(4) var<storage, read_write> field: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> solve: Solve;
@group(0) @binding(6) var<storage, read_write> counters: Counters;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    begin_totals(lane);
    let unit = 1.0 / force_scale(solve.bound);
    let pressure_unit = 1.0 / pressure_scale(bitcast<f32>(atomicLoad(&solve.largest[PRESSURE])));
    let scale = energy_scale(solve.bound);
    let count = min(atomicLoad(&counters.occupied) + atomicLoad(&counters.halo), constants.max_blocks);
    var energy = vec2u(0u);
    for (var b = group.x; b < count; b += groups.x) {
        let i = b * NODES + lane;
        let mass = grid[i].w;
        let sum = vec4f(force[i]);
        force[i] = vec4i(0);
        var after = vec4f(0.0);
        if mass > 0.0 {
            let u = free(held[i], sum.xyz * (unit * (1.0 / mass)));
            after = vec4f(u, sum.w * (pressure_unit * (1.0 / mass)));
            energy = plus(energy, mass * dot3(u, u) * scale);
        }
        field[i] = after;
    }
    note_sum(ENERGY, energy);
    end_totals(lane);
}
