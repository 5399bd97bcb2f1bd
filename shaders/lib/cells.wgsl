// The cells of a chunk that hold particles. Needs the binding chunks.

// A cell, and where its particles lie in the order.
struct Cell {
    at: u32,
    first: u32,
    end: u32,
}

// A chunk's record of a cell: its index in the block, where its particles begin in the chunk, and how many there are.
fn packed_cell(at: u32, first: u32, count: u32) -> u32 {
    return at | (first << 8u) | (count << 16u);
}

// The k-th fullest cell of a chunk.
fn cell_of(chunk: u32, k: u32) -> Cell {
    let packed = chunks[chunk].cells[k];
    let first = chunks[chunk].start + ((packed >> 8u) & 0xffu);
    return Cell(packed & 0xffu, first, first + (packed >> 16u));
}
