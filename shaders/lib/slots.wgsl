// Slots for particles, in groups that one workgroup looks at. Needs the bindings constants, position.

// Whether a particle may be put there: there is none, or it was deleted. What is quarantined stays.
fn is_free(slot: u32) -> bool {
    if slot >= constants.particle_count {
        return false;
    }
    let fate = position[slot].w;
    return fate == VACANT || fate == ESCAPED || fate == DRAINED;
}

// Free slots among those of an invocation.
fn free_slots(first: u32) -> u32 {
    var free = 0u;
    for (var slot = first; slot < first + SLOTS; slot++) {
        free += u32(is_free(slot));
    }
    return free;
}
