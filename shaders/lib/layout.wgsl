// Structures shared with the host. Twin: src/gpu/layout.rs; a test compares them field by field.

struct StepConstants {
    kick: vec3f,
    max_displacement: f32,
    lo: vec3f,
    max_gradient: f32,
    hi: vec3f,
    volume_gain: f32,
    momentum_scale: f32,
    mass_scale: f32,
    lightest: f32, // mass of a cell of the lightest material at rest
    tension_limit: f32,
    push_out: f32,
    rescale: f32,
    particle_count: u32,
    open_sides: u32,
    collider_count: u32,
    cull_words: u32,
    table_mask: u32,
    max_blocks: u32,
    drain_count: u32,
    candidate_first: u32,
    candidate_count: u32,
    slot_groups: u32,
    load_scale: f32,
    load_copies: u32,
    tool_count: u32,
    seconds: f32, // length of the step, s
    stiffness_limit: f32,
    block_stiffness: f32,
    tolerance: f32,
    pressure_rescale: f32,
    impulse: f32, // what a force adds to a displacement, over the square of the step's length
    release: u32, // 1: the slots of quarantined particles are given back
    rest_square: f32, // square of the largest displacement at rest
    rest_lasted: u32, // what the step adds to the time at rest, µs
    period: vec3f, // lengths along the axes after which matter is repeated; 0 where it is not
    rest_needed: u32, // the time after which matter sleeps, µs
}

struct Material {
    model: u32,
    gain: f32,
    viscous_relaxation: f32,
    inverse_density: f32,
    shape_weight: f32,
    yield_limit: f32,
    bulk: f32,
    viscosity: f32,
    shear: f32,
    solved_viscosity: f32,
    even: f32,
    lightness: f32,
}

struct Collider {
    position: vec3f,
    kind: u32,
    size: vec3f,
    friction: f32,
    shift: vec3f,
    load: u32,
    axes: mat3x3f,
    // Columns: the rotation of the step minus the identity.
    turn_x: vec3f,
    faces: u32, // those at rest that go through nodes (see faces.wgsl)
    turn_y: vec3f,
    joints: u32, // where it lies flush beside others (see joint.wgsl)
    turn_z: vec3f,
}

// A particle that appears if its place is free: if the grid holds at most `limit` mass per cell there.
struct Candidate {
    position: vec3f,
    limit: f32,
    displacement: vec3f,
    mass: f32,
    turn: vec3f, // rotation per step
    material: f32,
}

#if MESHES
// A grid of distances, in cells; `last` is the index of its last point along each axis, and `first` says where its
// distances begin.
struct DistanceGrid {
    lo: vec3f,
    spacing: f32,
    last: vec3f,
    inverse_spacing: f32,
    middle: vec3f,
    first: u32,
    extent: vec3f, // half the edges of the box around the body
    padding: u32,
}
#endif

struct Tool {
    start: vec3f,
    inverse_way: f32, // one over the square of its way's length; 0 for a tool that rests
    way: vec3f,
    inverse_radius: f32, // one over the square of its radius
    push: vec3f,
    pull: f32,
    spin: vec3f,
    share: f32,
}

#if SLEEP
// Blocks in which nothing sleeps: those between two corner blocks, inclusive.
struct Disturbance {
    lo: vec3u,
    count: u32, // in the first: how many there are
    hi: vec3u,
    padding: u32,
}
#endif

// The displacement gradient of a particle by columns, and what their fourth lanes hold.
struct Gradient {
    x: vec3f,
    mass: f32,
    y: vec3f,
    material: f32,
    z: vec3f,
    pressure: f32, // in the implicit scheme; in the explicit one the evenness of the matter around it
}

// The same, by columns with their fourth lanes.
struct GradientRows {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// The deformation gradient of a particle by columns. For sand the first fourth lane is its slack; for other solids, and
// for liquids that stick, the fourth lanes are the m of their correction. The columns of such liquids hold the rest of
// it: `turned`; `ahead` and the index of the body; `lacks`.
struct Deformation {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

struct TableEntry {
    key: atomic<u32>, // block key + 1; 0 is empty
    count: atomic<u32>,
    block: u32,
    unrest: atomic<u32>, // bits RESTLESS, DROWSY, WOKEN and DISTURBED, where matter may sleep
}

// The same, for stages that only read it.
struct TableEntryView {
    key: u32,
    count: u32,
    block: u32,
    unrest: u32,
}

// The same, for the stage that decides who is awake.
struct SharedTableEntry {
    key: u32,
    count: u32,
    block: u32,
    unrest: atomic<u32>,
}

// Where a particle is in the table, and its rank in its block.
struct Place {
    entry: u32,
    rank: u32,
#if SLEEP
    rest: u32, // how long it has been at rest, µs; with the bit ASLEEP where it sleeps, or did in the last step
#endif
}

struct Block {
    key: u32,
    entry: u32,
    start: u32,
    count: u32,
    // A bit for each of the eight tiles that reach it whose particles sleep beside others that are awake, and REACHED
    // where any tile adds mass.
    tiles: u32,
}

// The same, for the stage that decides who sleeps.
struct SharedBlock {
    key: u32,
    entry: u32,
    start: u32,
    count: u32,
    tiles: atomic<u32>,
}

struct Chunk {
    block: u32,
    start: u32,
    count: u32,
    key: u32, // of the block
    sleep: u32, // one of the tags AWAKE, BORDER and DEEP
    links: array<u32, 8>, // blocks of the tile
    cell_count: u32, // cells that hold particles
    cells: array<u32, 64>, // those cells, the fullest first (see cells.wgsl)
#if SHARES_PRESSURE
    load: f32, // of the pressure that its block shares: the part carried over, and its change
    found: f32,
#endif
}

struct Counters {
    halted: atomic<u32>,
    occupied: atomic<u32>,
    halo: atomic<u32>,
    ordered: atomic<u32>,
    chunks: atomic<u32>,
    largest_square: atomic<u32>, // bits of the square of the largest displacement
    largest_motion: atomic<u32>, // bits of the largest motion that particles bring to nodes; 0 in the published scheme
    steps: atomic<u32>,
    steps_deferred: atomic<u32>,
    saturated_nodes: atomic<u32>,
    speed_clamped: atomic<u32>,
    gradient_clamped: atomic<u32>,
    escaped: atomic<u32>,
    quarantined: atomic<u32>,
    last_occupied: atomic<u32>,
    last_active: atomic<u32>,
    drained: atomic<u32>,
    emitted: atomic<u32>,
    withheld: atomic<u32>,
    refused: atomic<u32>,
    last_count: u32, // iterations of the last solve, its last change, and the motion to compare this with
    last_change: f32,
    last_motion: f32,
    last_largest_square: f32,
    iterations: u32, // of all solves since the start
    capped: u32, // solves that ended because their iterations ran out
    worst_change: f32,
    asleep: atomic<u32>, // particles
    last_asleep: u32,
    strain_clamped: atomic<u32>,
    present: u32, // 1; 0 in new memory that nothing has been copied to
#if LOADS
    loads: array<atomic<u32>>,
#endif
}

struct Arguments {
    x: atomic<u32>,
    y: u32,
    z: u32,
}

struct Dispatch {
    blocks: Arguments,
    nodes: Arguments,
    chunks: Arguments,
    solve_nodes: Arguments, // none once the solve has ended
    solve_chunks: Arguments,
}

#if IMPLICIT
// What the solve of the implicit scheme keeps per particle.
struct Search {
    pressure: f32,
    residual: f32,
    direction: f32,
    compliance: f32,
}

#endif
#if TENSORS
// A symmetric matrix.
struct Symmetric {
    diagonal: vec3f, // xx, yy, zz
    off: vec3f, // yz, xz, xy
}

// What the solve keeps of a particle's stress besides the pressure: deviators.
struct Shear {
    brought: Symmetric,
    found: Symmetric,
    residual: Symmetric,
    direction: Symmetric,
    compliance: f32,
    // The correction of the strains that it underestimates.
    correction_x: f32,
    correction_y: f32,
    correction_z: f32,
}

// What the solve keeps per particle where it solves for more than pressures.
struct StressSearch {
    mean: Search,
    shear: Shear,
}
#endif
#if IMPLICIT
// The directions in which bodies hold a node: 0 for none, 1 along the axis, 2 across it, 3 any, in the lower two bits of
// `count_and_body`, above them the index of the body that holds it, of several the last to do so. `motion` is that with
// which it is held; for a braked node the free part is that along the body's normal. `braked` is the share of its motion
// along a body that the body takes.
struct Held {
    axis: vec3f,
    count_and_body: u32,
    motion: vec3f,
    braked: f32,
}

#if SHARES_PRESSURE
// What the liquids of a block bring to its pressure: the sums of volume (as the mass that the lightest liquid has in
// it), of volume times volume ratio and of volume times pressure (raised by the largest), two words each, the lower
// first; the bits of the largest compliance and of the largest stiffness of the block beside that of the particles; and
// the blocks of the tile.
struct BlockSums {
    sums: array<atomic<u32>, 6>,
    softest: atomic<u32>,
    firmest: atomic<u32>,
    links: array<u32, 8>,
}

// The same, for stages in which no two invocations write the same one.
struct BlockSumsView {
    sums: array<u32, 6>,
    softest: u32,
    firmest: u32,
    links: array<u32, 8>,
}

// The pressure of a block's liquids, beside those of its particles, and its solve.
struct BlockPressure {
    residual: f32,
    inverse: f32,
    direction: f32,
    compliance: f32,
    found: f32,
    load: f32,
    most: f32,
    volume: f32, // 0 where the block takes no part
}
#endif

// Global state of the implicit scheme's solve.
struct Solve {
    largest: array<atomic<u32>, LARGEST>, // bits of non-negative numbers
    sums: array<atomic<u32>, SUM_WORDS>, // two words each, the lower first
    motion: f32,
    first_bound: f32,
    bound: f32,
    last_bound: f32,
    direction_bound: f32,
    ahead: f32,
    pressure_bound: f32,
    last_square: f32,
    first_square: f32,
    step: f32,
    mix: f32,
    change: f32,
    count: u32,
    going_on: u32,
    chunks: u32,
}

// The same, for stages that do not add to it.
struct SolveView {
    largest: array<u32, LARGEST>,
    sums: array<u32, SUM_WORDS>,
    motion: f32,
    first_bound: f32,
    bound: f32,
    last_bound: f32,
    direction_bound: f32,
    ahead: f32,
    pressure_bound: f32,
    last_square: f32,
    first_square: f32,
    step: f32,
    mix: f32,
    change: f32,
    count: u32,
    going_on: u32,
    chunks: u32,
}
#endif
