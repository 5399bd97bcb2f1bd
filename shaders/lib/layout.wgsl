// Structures that cross from the host. Twin: src/gpu/layout.rs; a test compares them field by field.

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
    seconds: f32, // length of the step
    stiffness_limit: f32,
    block_limit: f32,
    tolerance: f32,
    pressure_rescale: f32,
    impulse: f32, // what a force adds to a displacement, over the length squared
    release: u32, // 1: the slots of quarantined particles are given back
    rest_square: f32, // of the largest displacement at rest
    rest_lasted: u32, // µs by which the step lengthens a rest
    rest_needed: u32, // µs after which matter sleeps
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
    rest: f32,
}

struct Collider {
    position: vec3f,
    kind: u32,
    size: vec3f,
    friction: f32,
    shift: vec3f,
    load: u32,
    axes: mat3x3f,
    turn: mat3x3f,
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
// A grid of distances, in cells; `row` and `layer` are the points from one to the next along y and z.
struct DistanceGrid {
    lo: vec3f,
    spacing: f32,
    last: vec3f,
    inverse_spacing: f32,
    first: u32,
    row: u32,
    layer: u32,
    padding: u32,
}
#endif

struct Tool {
    start: vec3f,
    inverse_way: f32, // squared
    way: vec3f,
    inverse_radius: f32, // squared
    push: vec3f,
    pull: f32,
    spin: vec3f,
    share: f32,
}

#if SLEEP
// Blocks in which nothing sleeps.
struct Disturbance {
    lo: vec3u,
    count: u32, // of the first: how many there are
    hi: vec3u,
    padding: u32,
}
#endif

// Columns of the displacement gradient, and what fills their fourth lanes.
struct Gradient {
    x: vec3f,
    mass: f32,
    y: vec3f,
    material: f32,
    z: vec3f,
    pressure: f32, // in the implicit scheme; in the explicit one how evenly matter lies
}

// The same, with fourth lanes by their columns.
struct GradientRows {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// Columns of the deformation gradient; fourth lanes: sand's slack, nothing, nothing; of other solids their correction, and of liquids that
// stick. The columns of those are what the turning of a body adds to it; by how much of that motion is ahead, and of which body; what
// their gradient lacks of it.
struct Deformation {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

struct TableEntry {
    key: atomic<u32>, // block key + 1; 0 is empty
    count: atomic<u32>,
    block: u32,
    restless: atomic<u32>, // 1: some of its particles have not been at rest for long enough to sleep
}

// The same, for stages that only read it.
struct TableEntryView {
    key: u32,
    count: u32,
    block: u32,
    restless: u32,
}

// Where a particle is in the table, and its rank in the block.
struct Place {
    entry: u32,
    rank: u32,
#if SLEEP
    rest: u32, // how long it has been at rest, µs
#endif
}

struct Block {
    key: u32,
    entry: u32,
    start: u32,
    count: u32,
    tiles: u32, // a bit for each of the eight that reach it whose particles sleep beside others, REACHED where some bring mass
}

// The same, for the stage that notes who sleeps.
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
    sleep: u32, // whether its particles sleep
    links: array<u32, 8>, // blocks of the tile
    cell_count: u32, // of cells that hold particles
    cells: array<u32, 64>, // those cells, the fullest first (see cells.wgsl)
#if SHARES_PRESSURE
    load: f32, // of the pressure that its block shares: what particles bring along, and its change
    found: f32,
#endif
}

struct Counters {
    halted: atomic<u32>,
    occupied: atomic<u32>,
    halo: atomic<u32>,
    ordered: atomic<u32>,
    chunks: atomic<u32>,
    largest_square: atomic<u32>, // of displacements, the bits
    largest_motion: atomic<u32>, // that particles bring to nodes, likewise; not in the published scheme
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
    last_count: u32, // of the solve, with its last change and the motion that it is compared to
    last_change: f32,
    last_motion: f32,
    last_largest_square: f32,
    iterations: u32, // of solves since the start
    capped: u32, // solves that ended with their iterations
    worst_change: f32,
    asleep: atomic<u32>, // particles
    last_asleep: u32,
    strain_clamped: atomic<u32>,
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
    solve_nodes: Arguments, // while a solve goes on
    solve_chunks: Arguments,
}

#if IMPLICIT
// What the solve keeps for a particle.
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

// What the solve keeps of a particle's stress beside the pressure: deviators.
struct Shear {
    brought: Symmetric,
    found: Symmetric,
    residual: Symmetric,
    direction: Symmetric,
    compliance: f32,
    // What makes up for what it does not see of strains.
    correction_x: f32,
    correction_y: f32,
    correction_z: f32,
}

// What it keeps of a particle where it seeks more than pressures.
struct StressSearch {
    mean: Search,
    shear: Shear,
}
#endif
#if IMPLICIT
// In which directions bodies hold a node: none, along the axis, across it, any; the share that a body takes of its motion along it; and the
// motion with which it is held, whose other part is, where there is such a share, that of the body's normal.
struct Held {
    axis: vec3f,
    count: u32,
    motion: vec3f,
    braked: f32,
}

#if SHARES_PRESSURE
// What the liquids of a block share: sums of mass, of mass times volume ratio and times pressure, two words each, the lower first; bits of
// their largest compliance and of the largest stiffness beside; the blocks of the tile; and the solve for their pressure.
struct BlockPressure {
    sums: array<atomic<u32>, 6>,
    softest: atomic<u32>,
    firmest: atomic<u32>,
    links: array<u32, 8>,
    mass: f32, // 0: takes no part
    load: f32,
    most: f32,
    found: f32,
    residual: f32,
    direction: f32,
    compliance: f32,
    inverse: f32,
}

// The same, for stages that one invocation at a time writes.
struct BlockPressureView {
    sums: array<u32, 6>,
    softest: u32,
    firmest: u32,
    links: array<u32, 8>,
    mass: f32,
    load: f32,
    most: f32,
    found: f32,
    residual: f32,
    direction: f32,
    compliance: f32,
    inverse: f32,
}

// What the pressures of the blocks whose tiles reach a block of nodes do to each other there: by rows.
struct Coupling {
    sources: array<u32, 8>,
    matrix: array<f32, 64>,
    motion: array<f32, 8>, // what the predicted motion does to them
    image: array<f32, 8>, // what directions of search do
    work: f32,
}
#endif

// What the solve knows as a whole.
struct Solve {
    largest: array<atomic<u32>, LARGEST>, // bits of numbers that are not negative
    sums: array<atomic<u32>, SUM_WORDS>, // two words each, the lower first
    motion: f32,
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

// The same, for stages that note nothing.
struct SolveView {
    largest: array<u32, LARGEST>,
    sums: array<u32, SUM_WORDS>,
    motion: f32,
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
