// The chunks. Needs halt and the binding counters.

var<workgroup> chunk_count: u32;

// Number of chunks to process, 0 in a step that is not taken; the same for the whole workgroup, all of which must call
// this.
fn chunks_to_do(lane: u32) -> u32 {
    if lane == 0u {
        chunk_count = select(atomicLoad(&counters.chunks), 0u, halted());
    }
    return workgroupUniformLoad(&chunk_count);
}
