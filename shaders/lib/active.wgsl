// The blocks of a step: occupied ones, then those that only tiles reach. Needs the binding counters.

// How many there are; in a step that is not taken more than there is `room` for were asked for.
fn active_blocks(room: u32) -> u32 {
    return min(atomicLoad(&counters.occupied) + atomicLoad(&counters.halo), room);
}
