// What an invocation takes of a chunk at a time: with tiles a particle, so that many are under way at once; without them the particles of
// a cell, whose nodes it then touches once. Needs kernel, bins, cells and the bindings position, order and chunks.

#if TILES
// Invocations side by side that add to nodes take particles far from each other in the chunk's order, which goes by cells: they add to
// different ones.
const CUTS = 32u;

fn shares(chunk: u32) -> u32 {
    return chunks[chunk].count;
}

fn particle_at(chunk: u32, i: u32) -> Cell {
    let at = base(position[order[i]].xyz) - block_coordinates(chunks[chunk].key) * EDGE;
    return Cell(block_node(at), i, i + 1u);
}

// The k-th. Those side by side often lie so in memory too, which is what writing them back costs by.
fn share_of(chunk: u32, k: u32) -> Cell {
    return particle_at(chunk, chunks[chunk].start + k);
}

// The same for those that add to nodes: the order is cut into `CUTS` pieces as equal as can be, of which come the first particles, then the
// second ones.
fn share_apart(chunk: u32, k: u32) -> Cell {
    let count = chunks[chunk].count;
    let piece = k % CUTS;
    let before = piece * (count / CUTS) + min(piece, count % CUTS);
    return particle_at(chunk, chunks[chunk].start + before + k / CUTS);
}
#else
fn shares(chunk: u32) -> u32 {
    return chunks[chunk].cell_count;
}

fn share_of(chunk: u32, k: u32) -> Cell {
    return cell_of(chunk, k);
}

fn share_apart(chunk: u32, k: u32) -> Cell {
    return cell_of(chunk, k);
}
#endif
