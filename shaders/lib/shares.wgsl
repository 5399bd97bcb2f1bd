// What an invocation processes of a chunk at a time: with tiles one particle, so that many are under way at once;
// without them the particles of a cell, whose nodes it then accesses once. Needs kernel, bins, cells and the bindings
// position, order and chunks.

#if TILES
// The number of pieces that a chunk's order is cut into for stages that add to nodes. The order goes by cells;
// neighbouring invocations take particles of different pieces, so that they add to different nodes.
const CUTS = 32u;

fn shares(chunk: u32) -> u32 {
    return chunks[chunk].count;
}

fn particle_at(chunk: u32, i: u32) -> Cell {
    let at = base(position[order[i]].xyz) - block_coordinates(chunks[chunk].key) * EDGE;
    return Cell(block_node(at), i, i + 1u);
}

// The k-th share. Neighbouring shares are often neighbours in memory, which makes writing them back cheaper.
fn share_of(chunk: u32, k: u32) -> Cell {
    return particle_at(chunk, chunks[chunk].start + k);
}

// The same for stages that add to nodes: first the first particles of all pieces, then the second ones. The pieces are
// as equal as can be.
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
