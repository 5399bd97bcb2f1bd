// The matter at a node, and how near to a surface points may come. Twin: src/stages/matter.rs. Needs the bindings
// constants and cull, and the library kernel.

// Amount of matter at the node, in cells at rest, as if nodes on the domain's sides had whole cells; negative for
// particles.
var<private> fill: f32 = -1.0;

#if GAPS
// How much nearer to a body the node may come before its matter touches, in cells; 0 for particles.
var<private> node_gap: f32;

// Whether the node's matter is viscoplastic; false for particles.
var<private> yields: bool;
#if BOXES

// The axis of the world along which it lies squarely before a face of a box that it touches; 3 if it is not solid, or
// lies before no face or before several.
var<private> face_axis: u32;
#endif
#endif

// Distance within which the node sticks to a body that matter sticks to, in cells.
var<private> sticky: f32;

// Whether it sticks, where it is pressed onto a body that matter sticks to, however far out: sand and viscoplastic
// matter.
var<private> grips: bool;

// Whether its matter comes apart when pulled (liquid, or sand in worlds without other solids), so that thin boxes may
// hold nodes behind them in both directions.
var<private> parts: bool;

// A word of the buffer that notes the bodies in reach.
fn cull_word(at: u32) -> u32 {
#if NOTES_GAPS
    return atomicLoad(&cull[at]);
#else
    return cull[at];
#endif
}

#if GAPS
// Where that buffer has the gap of a node, and the word with the faces before it: behind the bodies of all blocks.
fn gap_word(node: u32) -> u32 {
    return constants.max_blocks * constants.cull_words + node;
}

fn faces_word(node: u32) -> u32 {
    return constants.max_blocks * (constants.cull_words + NODES) + node / NODES_PER_WORD;
}
#endif

// Sets what `resolve_all` needs to know of a node of this mass.
fn fill_node(block: u32, node: u32, x: vec3f, mass: f32) {
#if GAPS
    let noted = cull_word(gap_word(block * NODES + node));
#else
    let noted = LIQUID_NEAR;
#endif
    parts = noted == LIQUID_NEAR;
#if LIQUID
    grips = false;
#else
    // Where there is no liquid, what comes apart is sand.
    grips = parts;
#endif
#if GAPS
    let solid = max(noted, VISCOPLASTIC_NEAR);
    node_gap = f32((solid - VISCOPLASTIC_NEAR) / 2u) * (1.0 / PARTS);
    // Less far where matter has still to come nearer: it touches within that, however little presses on it.
    sticky = max(STUCK - node_gap, ON_SURFACE);
#else
    sticky = STUCK;
#endif
#if STICKS
    // Liquids then stick by their viscosity.
    sticky = select(sticky, ON_SURFACE, parts);
#endif
#if GAPS
    yields = noted == solid && noted % 2u == VISCOPLASTIC_NEAR % 2u;
    grips |= yields || noted == SAND_NEAR;
#if BOXES
    let word = cull_word(faces_word(block * NODES + node));
    let faces = (word >> (node % NODES_PER_WORD * FACE_BITS)) & 7u;
    face_axis = select(3u, firstTrailingBit(faces), noted == solid && countOneBits(faces) == 1u);
#endif
#endif
    fill = mass / constants.lightest;
    for (var a = 0u; a < 3u; a++) {
        if x[a] < constants.lo[a] || constants.hi[a] < x[a] {
            fill = fill + fill;
        }
    }
}

// How near to a surface a point at `distance` may come. A particle may come as near as its CLEARANCE, a node up to the
// surface, but no nearer than it is if it is full, and in viscoplastic matter only by what it lacks to FULLEST. What is
// nearer than that may come no nearer, and what is inside go no deeper.
fn level_of(distance: f32) -> f32 {
    let open = share_near(distance);
    let least = select(0.0, CLEARANCE, fill < 0.0);
    let early = fill <= CROWDED && distance < EARLY;
    var level = select(min(distance, least), distance, open * FULL <= fill && early);
#if GAPS
    if yields && early {
        level = max(distance - max(open * FULLEST - fill, 0.0), min(distance, 0.0));
    }
    return min(level, distance - node_gap);
#else
    return level;
#endif
}
