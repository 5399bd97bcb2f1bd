// The cells of a chunk that hold particles. Needs the binding chunks.

// A cell, and the places of particles of it in the order.
struct Cell {
    at: u32,
    first: u32,
    end: u32,
}

// How a chunk notes a cell: by its place in the block, and its particles after the chunk's first.
fn packed_cell(at: u32, first: u32, count: u32) -> u32 {
    return at | first << 8u | count << 16u;
}

// The k-th fullest cell of a chunk.
fn cell_of(chunk: u32, k: u32) -> Cell {
    let packed = chunks[chunk].cells[k];
    let first = chunks[chunk].start + (packed >> 8u & 0xffu);
    return Cell(packed & 0xffu, first, first + (packed >> 16u));
}
