// Slots for particles, in groups each examined by one workgroup. Needs the bindings constants, position.

// Whether a particle may be put there: the slot is empty, or its particle has left or was deleted, here or by a host.
// Quarantined ones stay.
fn is_free(slot: u32) -> bool {
    if slot >= constants.particle_count {
        return false;
    }
    let fate = position[slot].w;
    return fate <= 0.0 && fate != QUARANTINED;
}

// Number of free slots among those that an invocation examines.
fn free_slots(first: u32) -> u32 {
    var free = 0u;
    for (var slot = first; slot < first + SLOTS; slot++) {
        free += u32(is_free(slot));
    }
    return free;
}
