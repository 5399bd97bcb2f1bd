// Counts the step and the results of its iterations, and zeroes its counters. Twin: src/stages/step_end.rs.
#import layout
#import halt

@group(0) @binding(0) var<storage, read_write> counters: Counters;
@group(0) @binding(1) var<storage, read_write> dispatch_occupied: Arguments;
@group(0) @binding(2) var<storage, read_write> dispatch: Dispatch;
#if IMPLICIT
@group(0) @binding(3) var<storage, read_write> solve: SolveView;
#endif

@compute @workgroup_size(1)
fn main() {
    if halted() {
        atomicAdd(&counters.steps_deferred, 1u);
        return;
    }
    let occupied = atomicLoad(&counters.occupied);
    atomicStore(&counters.last_occupied, occupied);
    atomicStore(&counters.last_active, occupied + atomicLoad(&counters.halo));
    atomicAdd(&counters.steps, 1u);
    atomicStore(&counters.occupied, 0u);
    atomicStore(&counters.halo, 0u);
    atomicStore(&counters.ordered, 0u);
    atomicStore(&counters.chunks, 0u);
    counters.last_asleep = atomicExchange(&counters.asleep, 0u);
    counters.last_largest_square = bitcast<f32>(atomicExchange(&counters.largest_square, 0u));
    atomicStore(&counters.largest_motion, 0u);
    atomicStore(&dispatch_occupied.x, 0u);
    atomicStore(&dispatch.blocks.x, 0u);
    atomicStore(&dispatch.nodes.x, 0u);
    atomicStore(&dispatch.chunks.x, 0u);
#if IMPLICIT
    atomicStore(&dispatch.solve_nodes.x, 0u);
    atomicStore(&dispatch.solve_chunks.x, 0u);
    counters.last_count = solve.count;
    counters.last_change = solve.change;
    counters.last_motion = solve.motion;
    counters.iterations += solve.count;
    counters.capped += solve.going_on;
    if solve.motion > 0.0 {
        counters.worst_change = max(counters.worst_change, solve.change * (1.0 / solve.motion));
    }
    solve = SolveView();
#endif
}
