//! Structures shared with the shaders. Twin: `shaders/lib/layout.wgsl`; a test compares them field by field.

mod content;
mod solve;

pub use content::{Candidate, Collider, DISTANCES_WIDTH, DistanceGrid, Disturbance, Material, Tool};
pub use solve::{BlockPressure, Coupling, Held, Search, Shear, Solve, StressSearch, Symmetric};

use super::shader::Variant;
use crate::bins::{EDGE, NODES, TILE_EDGE, TILE_NODES};
use crate::cpu::solve::MOTION_SCALE;
use crate::cpu::state::{Constants, DRAINED, ESCAPED, QUARANTINED, VACANT};
use crate::features::Features;
use crate::load::SUMS;
use crate::math::distance_grid::{DistanceGrid as Grid, REACH};
use crate::math::fixed::CHUNK;
use crate::math::kernel::KERNEL_REACH;
use crate::math::sdf;
use crate::sensor;
use crate::stages::believed::BESIDE_SOLIDS;
use crate::stages::bin_sleep::{AWAKE, BORDER, DEEP, REACHED};
use crate::stages::block_p2g::{BLOCK_SCALE, LEAST_PRESSURE, MOST_SHARED, SLACK};
use crate::stages::block_solve::{LEAST_SQUARE, LEFT, ROUNDS};
use crate::stages::collider_cull::{self, BODIES_PER_WORD, LEAST_REACH, MORE, MOST_WORDS};
use crate::stages::compliance::{EARLIER, LATER, RESOLVED, SOLID_LIMIT, SOLID_SHARE, THICKEST};
use crate::stages::contact::{CROWDED, EARLY, FIXED, FULL, LEAST_SHARE, STICKING, STUCK, SWEEPS};
use crate::stages::correction::{ALL_SEEN, LEAST_SEEN, LEAST_SEEN_BY_LIQUIDS};
use crate::stages::drag::MOST_BRAKED;
use crate::stages::even::NOTHING;
use crate::stages::footing::{FARTHEST_OFF, MOVED, ROUNDED};
use crate::stages::gap::{BESIDE, NONE_NEAR, OPPOSITE, PARTS, WIDEST};
use crate::stages::integrate::{LOOSENING, MEASURE_MARGIN, SHORTFALL, VOLUME_RATIO};
use crate::stages::motion::{FARTHEST, LEAST_MOTION};
use crate::stages::predict::{NEARER, SLIGHT, TOUCH};
use crate::stages::press::{MAX_DIVERGENCE, MAX_ERROR, MAX_LOAD, MAX_PRESSURE, MAX_SHEAR, MAX_SOFTENING};
use crate::stages::room::{HIDDEN, SIGHT};
use crate::stages::seam::{ALIKE, BESIDE_SEAM, BEVEL, FACING, NOTHING_ELSE, SEAM};
use crate::stages::sides::EDGE_REACH;
use crate::stages::solid::{self, CORRECTION, SLACKEST, STRETCH};
use crate::stages::stress::{FIRMEST, FIRMING, SOFT, SOFTENED};
use crate::stages::swept::{MENDS, PIECES, ROUGH};
use crate::timeline::disturbance::DISTURBANCES;
use crate::tool::MAX_TOOLS;
use bytemuck::{Pod, Zeroable};
use solve::{LARGEST, WHOLE};
use std::mem::offset_of;
use std::ops::Range;
use std::sync::Arc;

/// Invocations in a workgroup.
pub const GROUP: u32 = 64;
/// Particle slots that an invocation examines where free ones are sought.
pub const SLOTS: u32 = 4;
/// Copies of all loads together; each load has several if there are fewer loads, as many nodes add to the same one at a
/// time.
const MOST_COPIES: u32 = 64;
/// The most tools in a step: the world's and the host's.
pub const TOOLS: usize = 2 * MAX_TOOLS;
/// Most workgroups along one axis of a dispatch.
pub const MAX_GROUPS: u32 = 65_535;

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct StepConstants {
    pub kick: [f32; 3],
    pub max_displacement: f32,
    pub lo: [f32; 3],
    pub max_gradient: f32,
    pub hi: [f32; 3],
    pub volume_gain: f32,
    pub momentum_scale: f32,
    pub mass_scale: f32,
    pub lightest: f32,
    pub tension_limit: f32,
    pub push_out: f32,
    pub rescale: f32,
    pub particle_count: u32,
    pub open_sides: u32,
    pub collider_count: u32,
    pub cull_words: u32,
    pub table_mask: u32,
    pub max_blocks: u32,
    pub drain_count: u32,
    pub candidate_first: u32,
    pub candidate_count: u32,
    pub slot_groups: u32,
    pub load_scale: f32,
    pub load_copies: u32,
    pub tool_count: u32,
    pub seconds: f32,
    pub stiffness_limit: f32,
    pub block_limit: f32,
    pub tolerance: f32,
    pub pressure_rescale: f32,
    pub impulse: f32,
    pub release: u32,
    pub rest_square: f32,
    pub rest_lasted: u32,
    pub rest_needed: u32,
    /// Pads to a multiple of 16 bytes.
    pub padding: [u32; 3],
}

/// Sizes of the buffers that a step works in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    pub particles: u32,
    /// What the world asks of its steps, of which much has to be stored.
    pub features: Features,
    pub colliders: u32,
    /// Distance grids, and rows of the texture that holds their distances.
    pub grids: u32,
    pub distance_rows: u32,
    pub cull_words: u32,
    /// Loads that are asked for.
    pub loads: u32,
    /// Copies of each load, to be added up.
    pub load_copies: u32,
    /// Blocks that the grid has room for.
    pub blocks: u32,
    /// Entries of the hash table, a power of two.
    pub table: u32,
    /// Chunks of particles.
    pub chunks: u32,
    /// Regions that a step has room for: drains and sensors.
    pub regions: u32,
    /// Sensors.
    pub sensors: u32,
    /// There is room for tools.
    pub tools: bool,
    /// Candidates that there is room for, of all steps in flight.
    pub candidates: u32,
    /// Steps in flight that there is room for.
    pub ring: u32,
}

impl Sizes {
    pub fn new(particles: u32, features: Features, colliders: u32, loads: u32, blocks: u32) -> Self {
        Sizes {
            particles,
            features,
            colliders,
            grids: 0,
            distance_rows: 0,
            cull_words: collider_cull::words(colliders as usize) as u32,
            loads,
            load_copies: MOST_COPIES.checked_div(loads).unwrap_or(0).max(1),
            blocks,
            // At most half full, so that probing ends soon.
            table: (2 * blocks).next_power_of_two(),
            chunks: particles / CHUNK + blocks,
            regions: 0,
            sensors: 0,
            tools: false,
            candidates: 0,
            ring: 1,
        }
    }

    /// The same with room for so many blocks.
    pub fn with_blocks(&self, blocks: u32) -> Self {
        let made = Sizes::new(self.particles, self.features, self.colliders, self.loads, blocks);
        Sizes { blocks, table: made.table, chunks: made.chunks, ..*self }
    }

    /// The same with room for these distance grids.
    pub fn with_grids(&self, grids: &[Arc<Grid>]) -> Self {
        let points: usize = grids.iter().map(|grid| grid.values.len()).sum();
        Sizes { grids: grids.len() as u32, distance_rows: (points as u32).div_ceil(DISTANCES_WIDTH), ..*self }
    }

    /// Groups of slots, each examined by one workgroup.
    pub fn slot_groups(&self) -> u32 {
        self.particles.div_ceil(GROUP * SLOTS)
    }

    /// Bytes of the sums of all sensors for a step.
    pub fn sensed_bytes(&self) -> u64 {
        u64::from(self.sensors) * size_of::<[u64; sensor::SUMS]>() as u64
    }

    /// Bytes of the loads behind the counters.
    pub fn load_bytes(&self) -> u64 {
        u64::from(self.loads * self.load_copies) * size_of::<[u64; SUMS]>() as u64
    }
}

impl StepConstants {
    pub fn new(c: &Constants<f32>, sizes: &Sizes, drains: u32, candidates: Range<u32>) -> Self {
        StepConstants {
            kick: c.kick,
            max_displacement: c.max_displacement,
            lo: c.lo,
            max_gradient: c.max_gradient,
            hi: c.hi,
            volume_gain: c.volume_gain,
            momentum_scale: c.momentum_scale,
            mass_scale: c.mass_scale,
            lightest: c.lightest,
            tension_limit: c.tension_limit,
            push_out: c.push_out,
            rescale: c.rescale,
            particle_count: sizes.particles,
            open_sides: c.open_sides,
            collider_count: sizes.colliders,
            cull_words: sizes.cull_words,
            table_mask: sizes.table - 1,
            max_blocks: sizes.blocks,
            drain_count: drains,
            candidate_first: candidates.start,
            candidate_count: candidates.end - candidates.start,
            slot_groups: sizes.slot_groups(),
            load_scale: c.load_scale,
            load_copies: sizes.load_copies,
            tool_count: c.tool_count,
            seconds: c.seconds,
            stiffness_limit: c.stiffness_limit,
            block_limit: c.block_limit,
            tolerance: c.tolerance,
            pressure_rescale: c.pressure_rescale,
            impulse: c.impulse,
            release: c.release.into(),
            rest_square: c.rest_square,
            rest_lasted: c.rest_lasted,
            rest_needed: c.rest_needed,
            padding: [0; 3],
        }
    }
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct TableEntry {
    pub key: u32,
    pub count: u32,
    pub block: u32,
    pub restless: u32,
}

/// See the shader's struct of this name. `rest` exists only where matter may sleep.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Place {
    pub entry: u32,
    pub rank: u32,
    pub rest: u32,
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Block {
    pub key: u32,
    pub entry: u32,
    pub start: u32,
    pub count: u32,
    pub tiles: u32,
}

/// See the shader's struct of this name. `load` and `found` exist only where pressures are shared.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Chunk {
    pub block: u32,
    pub start: u32,
    pub count: u32,
    pub key: u32,
    pub sleep: u32,
    pub links: [u32; 8],
    pub cell_count: u32,
    pub cells: [u32; NODES],
    pub load: f32,
    pub found: f32,
}

impl Chunk {
    /// Bytes from one to the next.
    pub fn stride(shares_pressure: bool) -> usize {
        if shares_pressure { size_of::<Chunk>() } else { offset_of!(Chunk, load) }
    }
}

/// See the shader's struct of this name. The loads that are measured follow it in the buffer, so that both are read
/// back together.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct Counters {
    pub halted: u32,
    pub occupied: u32,
    pub halo: u32,
    pub ordered: u32,
    pub chunks: u32,
    pub largest_square: u32,
    pub largest_motion: u32,
    pub steps: u32,
    pub steps_deferred: u32,
    pub saturated_nodes: u32,
    pub speed_clamped: u32,
    pub gradient_clamped: u32,
    pub escaped: u32,
    pub quarantined: u32,
    pub last_occupied: u32,
    pub last_active: u32,
    pub drained: u32,
    pub emitted: u32,
    pub withheld: u32,
    pub refused: u32,
    pub last_count: u32,
    pub last_change: f32,
    pub last_motion: f32,
    pub last_largest_square: f32,
    pub iterations: u32,
    pub capped: u32,
    pub worst_change: f32,
    pub asleep: u32,
    pub last_asleep: u32,
    pub strain_clamped: u32,
}

impl Counters {
    /// Bytes from the front that belong to the current step, and are zeroed when it is begun anew.
    pub const OF_STEP: usize = offset_of!(Counters, steps);
}

/// See the shader's struct of this name: workgroup counts of the indirect dispatches.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Dispatch {
    pub blocks: [u32; 3],
    pub nodes: [u32; 3],
    pub chunks: [u32; 3],
    pub solve_nodes: [u32; 3],
    pub solve_chunks: [u32; 3],
}

impl Dispatch {
    /// Nothing to do, for one of them.
    pub const NO_GROUPS: [u32; 3] = [0, 1, 1];
    /// Nothing to do.
    pub const NOTHING: Dispatch = Dispatch {
        blocks: Self::NO_GROUPS,
        nodes: Self::NO_GROUPS,
        chunks: Self::NO_GROUPS,
        solve_nodes: Self::NO_GROUPS,
        solve_chunks: Self::NO_GROUPS,
    };
}

/// The constants that the shaders share with Rust, as WGSL text.
pub fn shared_constants(variant: &Variant) -> String {
    let numbers = [
        ("GROUP", GROUP),
        ("LANES", variant.tuning.lanes),
        ("SHARE", variant.tuning.share),
        ("MAX_GROUPS", MAX_GROUPS),
        ("CHUNK", CHUNK),
        ("SLOTS", SLOTS),
        ("EDGE", EDGE as u32),
        ("NODES", NODES as u32),
        ("TILE_EDGE", TILE_EDGE as u32),
        ("TILE_NODES", TILE_NODES as u32),
        ("MATERIALS", variant.materials.max(1) as u32),
        ("MESHES", variant.shapes.meshes),
        ("DISTANCES_WIDTH", DISTANCES_WIDTH),
        ("SWEEPS", SWEEPS as u32),
        ("PIECES", PIECES as u32),
        ("MENDS", MENDS as u32),
        ("SHAPE_BOX", sdf::BOX),
        ("SHAPE_SPHERE", sdf::SPHERE),
        ("SHAPE_HALF_SPACE", sdf::HALF_SPACE),
        ("MODEL_ELASTIC", solid::ELASTIC),
        ("MODEL_SAND", solid::SAND),
        ("MODEL_VISCOPLASTIC", solid::VISCOPLASTIC),
        ("MODEL_LIQUID", solid::LIQUID),
        ("SHAPE_CAPSULE", sdf::CAPSULE),
        ("SHAPE_CYLINDER", sdf::CYLINDER),
        ("SHAPE_GRID", sdf::GRID),
        ("INVERTED", sdf::INVERTED),
        ("LOAD_WORDS", 2 * SUMS as u32),
        ("SENSED_WORDS", 2 * sensor::SUMS as u32),
        ("TOOLS", TOOLS as u32),
        ("DISTURBANCES", DISTURBANCES as u32),
        ("AWAKE", AWAKE),
        ("BORDER", BORDER),
        ("DEEP", DEEP),
        ("REACHED", REACHED),
        ("NONE_NEAR", NONE_NEAR),
        ("LARGEST", LARGEST.len() as u32),
        ("SUM_WORDS", 2 * WHOLE.len() as u32),
    ];
    let places = LARGEST.iter().zip(0..).chain(WHOLE.iter().zip((0..).step_by(2)));
    let numbers = numbers.iter().copied().chain(places.map(|(name, place)| (*name, place)));
    let text: String = numbers.map(|(name, value)| format!("const {name} = {value}u;\n")).collect();
    let [low, high] = VOLUME_RATIO;
    text + &format!(
        "const MIN_VOLUME_RATIO = {low:?};
const MAX_VOLUME_RATIO = {high:?};
const MIN_STRETCH = {:?};
const MAX_STRETCH = {:?};
const MAX_CORRECTION = {:?};
const SLACKEST = {SLACKEST:?};
const ESCAPED = {ESCAPED:?};
const QUARANTINED = {QUARANTINED:?};
const DRAINED = {DRAINED:?};
const VACANT = {VACANT:?};
const SENSED_MASS = {:?};
const REACH = {REACH:?};
const FIXED = {FIXED:?};
const STICKING = {STICKING:?};
const STUCK = {STUCK:?};
const MAX_PRESSURE = {MAX_PRESSURE:?};
const MAX_DIVERGENCE = {MAX_DIVERGENCE:?};
const MAX_ERROR = {MAX_ERROR:?};
const MAX_LOAD = {MAX_LOAD:?};
const MAX_SHEAR = {MAX_SHEAR:?};
const BLOCK_SCALE = {BLOCK_SCALE:?};
const SLACK = {SLACK:?};
const FILLED = {:?};
const PRESSED = {:?};
const LEAST_PRESSURE = {LEAST_PRESSURE:?};
const LEAST_SQUARE = {LEAST_SQUARE:?};
const LEFT = {LEFT:?};
const ROUNDS = {ROUNDS}u;
const MAX_SOFTENING = {MAX_SOFTENING:?};
const SOLID_SHARE = {SOLID_SHARE:?};
const SOLID_LIMIT = {SOLID_LIMIT:?};
const THICKEST = {THICKEST:?};
const LATER = {LATER:?};
const EARLIER = {EARLIER:?};
const RESOLVED = {RESOLVED:?};
const MOTION_SCALE = {MOTION_SCALE:?};
const NOTHING = {NOTHING:?};
const FIRMEST = {FIRMEST:?};
const FIRMING = {FIRMING:?};
const SOFT = {SOFT:?};
const SOFTENED = {SOFTENED:?};
const EARLY = {EARLY:?};
const CROWDED = {CROWDED:?};
const SEAM = {SEAM:?};
const ROUGH = {ROUGH:?};
const ROUNDED = {ROUNDED:?};
const FARTHEST_OFF = {FARTHEST_OFF:?};
const MOVED = {MOVED:?};
const KERNEL_REACH = {KERNEL_REACH:?};
const NOTHING_ELSE = {NOTHING_ELSE:?};
const BESIDE_SEAM = {BESIDE_SEAM:?};
const FACING = {FACING:?};
const BEVEL = {BEVEL:?};
const ALIKE = {ALIKE:?};
const EDGE_REACH = {EDGE_REACH:?};
const FULL = {FULL:?};
const LEAST_SHARE = {LEAST_SHARE:?};
const MEASURE_MARGIN = {MEASURE_MARGIN:?};
const SHORTFALL = {SHORTFALL:?};
const LOOSENING = {LOOSENING:?};
const HIDDEN = {HIDDEN:?};
const SIGHT = {SIGHT:?};
const BESIDE_SOLIDS = {BESIDE_SOLIDS:?};
const TOUCH = {TOUCH:?};
const SLIGHT = {SLIGHT:?};
const NEARER = {NEARER:?};
const WIDEST = {WIDEST:?};
const LEAST_REACH = {LEAST_REACH:?};
const BODIES_PER_WORD = {BODIES_PER_WORD}u;
const MORE = {MORE}u;
const MOST_WORDS = {MOST_WORDS}u;
const LEAST_SEEN = {LEAST_SEEN:?};
const ALL_SEEN = {ALL_SEEN:?};
const LEAST_SEEN_BY_LIQUIDS = {LEAST_SEEN_BY_LIQUIDS:?};
const MOST_BRAKED = {MOST_BRAKED:?};
const FARTHEST = {FARTHEST:?};
const LEAST_MOTION = {LEAST_MOTION:?};
const PARTS = {PARTS:?};
const BESIDE = {BESIDE:?};
const OPPOSITE = {OPPOSITE:?};
",
        STRETCH[0],
        STRETCH[1],
        CORRECTION,
        sensor::MASS_SCALE,
        1.0 + SLACK,
        1.0 + MOST_SHARED
    )
}
