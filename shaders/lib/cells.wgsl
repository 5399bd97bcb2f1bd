// The cells of a chunk. Needs the binding chunks.

// Where the particles of a cell end, in the order; `end` is where those of the chunk end.
fn cell_end(chunk: u32, cell: u32, end: u32) -> u32 {
    if cell + 1u < NODES {
        return chunks[chunk].cells[cell + 1u];
    }
    return end;
}
