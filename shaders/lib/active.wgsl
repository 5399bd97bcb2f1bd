// The active blocks of a step: occupied ones, then those that only tiles reach. Needs the binding counters.

// Their number. In a step that is not taken, more were asked for than there is `room` for.
fn active_blocks(room: u32) -> u32 {
    return min(atomicLoad(&counters.occupied) + atomicLoad(&counters.halo), room);
}
