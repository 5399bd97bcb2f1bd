// Where the numbers of a coupling lie: in vectors of four, each of all blocks before the next, so that neighbouring
// invocations read neighbouring memory. The vectors: src/gpu/layout/coupling.rs. Needs the binding constants.

// Index of a vector of a block of nodes.
fn coupling_vector(block: u32, which: u32) -> u32 {
    return which * constants.max_blocks + block;
}

// Index of the i-th number from a vector on.
fn coupling_word(block: u32, which: u32, i: u32) -> u32 {
    return 4u * coupling_vector(block, which + i / 4u) + i % 4u;
}
