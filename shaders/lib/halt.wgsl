// A step that does not fit the grid is not taken: once a block finds no room, every stage leaves the particles as they
// are until the host has made room. Needs the binding counters.

fn halted() -> bool {
    return atomicLoad(&counters.halted) != 0u;
}

fn halt() {
    atomicStore(&counters.halted, 1u);
}
