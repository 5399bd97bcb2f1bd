//! Structures shared with the shaders. Twin: `shaders/lib/layout.wgsl`; a test compares them field by field.

mod content;
pub mod coupling;
mod shared;
mod solve;

pub use content::{Candidate, Collider, DISTANCES_WIDTH, DistanceGrid, Disturbance, Material, Tool};
pub use shared::shared_constants;
pub use solve::{BlockPressure, BlockSums, Held, Search, Shear, Solve, StressSearch, Symmetric};

use crate::bins::NODES;
use crate::cpu::constants::Constants;
use crate::features::Features;
use crate::load::SUMS;
use crate::math::distance_grid::DistanceGrid as Grid;
use crate::math::fixed::CHUNK;
use crate::sensor;
use crate::stages::collider_cull;
use crate::tool::MAX_TOOLS;
use bytemuck::{Pod, Zeroable};
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
    pub block_stiffness: f32,
    pub tolerance: f32,
    pub pressure_rescale: f32,
    pub impulse: f32,
    pub release: u32,
    pub rest_square: f32,
    pub rest_lasted: u32,
    pub period: [f32; 3],
    pub rest_needed: u32,
}

/// Sizes of the buffers that a step works in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    pub particles: u32,
    /// What the world asks of its steps, of which much has to be stored.
    pub features: Features,
    pub colliders: u32,
    pub materials: u32,
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
            materials: 1,
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
            block_stiffness: c.block_stiffness,
            tolerance: c.tolerance,
            pressure_rescale: c.pressure_rescale,
            impulse: c.impulse,
            release: c.release.into(),
            rest_square: c.rest_square,
            rest_lasted: c.rest_lasted,
            period: c.period,
            rest_needed: c.rest_needed,
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
    pub unrest: u32,
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
    pub present: u32,
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
