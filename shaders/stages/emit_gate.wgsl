// Checks for each particle that is to appear whether its place is free, and counts the accepted ones, group by group.
// Twin: src/stages/emit_gate.rs.
#import layout
#import kernel
#import bins
#import neighbours
#import lookup
#import halt
#import scan

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read> candidates: array<Candidate>;
@group(0) @binding(2) var<storage, read> table: array<TableEntryView>;
@group(0) @binding(3) var<storage, read> grid: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> accepted: array<u32>;
@group(0) @binding(5) var<storage, read_write> vacancies: array<u32>;
@group(0) @binding(6) var<storage, read_write> counters: Counters;

// Mass per cell. In loops, because compilers take long for unrolled code.
fn mass_at(x: vec3f) -> f32 {
    let n = base(x);
    let s = stencil(x - vec3f(n));
    let weights = array<vec3f, 3>(s.w0, s.w1, s.w2);
    let key = block_key(n / EDGE);
    var links: array<u32, 8>;
    for (var k = 0u; k < 8u; k++) {
        links[k] = find(neighbour(key, k));
    }
    var sum = 0.0;
    for (var k = 0u; k < 3u; k++) {
        var plane = 0.0;
        for (var j = 0u; j < 3u; j++) {
            var row = 0.0;
            for (var i = 0u; i < 3u; i++) {
                let at = n % EDGE + vec3u(i, j, k);
                let block = links[tile_block(at)];
                if block != NONE {
                    row += grid[block * NODES + block_node(at)].w * weights[i].x;
                }
            }
            plane += row * weights[j].y;
        }
        sum += plane * weights[k].z;
    }
    return sum;
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let takes_step = !halted();
    let count = constants.candidate_count;
    for (var g = group.x; g * GROUP < count; g += groups.x) {
        let i = g * GROUP + lane;
        var may_appear = 0u;
        if takes_step && i < count {
            let c = candidates[constants.candidate_first + i];
            may_appear = u32(c.limit >= 0.0 && mass_at(c.position) <= c.limit);
        }
        let all = sums(lane, may_appear);
        if i < count {
            accepted[constants.candidate_first + i] = all.before + may_appear;
        }
        if lane == 0u {
            vacancies[constants.slot_groups + g] = all.total;
        }
    }
}
