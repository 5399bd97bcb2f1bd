// The chunks and their cells. Needs the bindings chunks, counters, and halt.

var<workgroup> chunk_count: u32;

// How many chunks there are to do, none in a step that is not taken: the same number for the whole workgroup, all of which
// has to ask.
fn chunks_to_do(lane: u32) -> u32 {
    if lane == 0u {
        chunk_count = select(atomicLoad(&counters.chunks), 0u, halted());
    }
    return workgroupUniformLoad(&chunk_count);
}

// Where the particles of a cell end, in the order; `end` is where those of the chunk end.
fn cell_end(chunk: u32, cell: u32, end: u32) -> u32 {
    if cell + 1u < NODES {
        return chunks[chunk].cells[cell + 1u];
    }
    return end;
}
