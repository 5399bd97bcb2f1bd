// Finds or makes the block of every particle and counts the block's particles. Particles with a NaN, an infinite number
// or a volume ratio that is none are quarantined before they can affect others. Twin: src/stages/bin_insert.rs.
#import layout
#import kernel
#import bins
#import table
#import halt
#import sound
#if SLEEP
#import linear
#import rest
#endif

@group(0) @binding(0) var<uniform> constants: StepConstants;
@group(0) @binding(1) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(2) var<storage, read> displacement: array<vec4f>;
@group(0) @binding(3) var<storage, read> gradient: array<Gradient>;
@group(0) @binding(4) var<storage, read_write> bin: array<Place>;
@group(0) @binding(5) var<storage, read_write> table: array<TableEntry>;
@group(0) @binding(6) var<storage, read_write> blocks: array<Block>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;
@group(0) @binding(8) var<storage, read_write> dispatch_occupied: Arguments;

fn insert(p: u32) {
    let x = position[p];
    bin[p].entry = NONE;
    let missing = x.w <= 0.0;
    if missing && is_fate(x.w) {
        return;
    }
    let u = displacement[p];
#if SLEEP
    // Nothing has touched its gradient since it was stopped.
    let slept = (bin[p].rest & ASLEEP) != 0u && finite(x) && finite(u);
#else
    let slept = false;
#endif
    if missing || (!slept && !sound(x, u, gradient[p])) {
        position[p].w = QUARANTINED;
        atomicAdd(&counters.quarantined, 1u);
        return;
    }
    let key = block_key(base(x.xyz) / EDGE);
    let found = find_or_insert(key);
    if found.entry == NONE {
        halt();
        return;
    }
    if found.made {
        let block = atomicAdd(&counters.occupied, 1u);
        if block >= constants.max_blocks {
            halt();
            return;
        }
        table[found.entry].block = block;
        blocks[block] = Block(key, found.entry, 0u, 0u, 0u);
        atomicMax(&dispatch_occupied.x, min(block * LINKERS / GROUP + 1u, MAX_GROUPS));
    }
    bin[p].entry = found.entry;
    bin[p].rank = atomicAdd(&table[found.entry].count, 1u);
#if SLEEP
    // Stored by bin_sleep only: a step that is not taken lengthens no rest.
    if rested(bin[p].rest, u) < constants.rest_needed {
        atomicOr(&table[found.entry].unrest, RESTLESS);
    } else if !slept {
        atomicOr(&table[found.entry].unrest, DROWSY);
    }
#endif
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if halted() {
        return;
    }
    for (var p = id.x; p < constants.particle_count; p += groups.x * GROUP) {
        insert(p);
    }
}
