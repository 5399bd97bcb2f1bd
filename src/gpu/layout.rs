//! Structures that cross to the shaders. Twin: `shaders/lib/layout.wgsl`; a test compares them field by field.

use crate::bins::{EDGE, NODES, TILE_EDGE, TILE_NODES};
use crate::cpu::state::{ColliderConstants, Constants, MaterialConstants};
use crate::math::fixed::CHUNK;
use crate::math::sdf;
use crate::stages::contact::SWEEPS;
use crate::stages::integrate::{MEASURE_LIMIT, VOLUME_RATIO};
use crate::stages::solid::{self, CORRECTION, STRETCH};
use bytemuck::{Pod, Zeroable};

/// Invocations in a workgroup.
pub const GROUP: u32 = 64;
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
    pub measure_limit: f32,
    pub tension_limit: f32,
    pub push_out: f32,
    pub rescale: f32,
    pub particle_count: u32,
    pub open_sides: u32,
    pub collider_count: u32,
    pub cull_words: u32,
    pub table_mask: u32,
    pub max_blocks: u32,
}

/// Sizes of the buffers that a step works in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    pub particles: u32,
    /// Particles have a deformation gradient.
    pub solids: bool,
    pub colliders: u32,
    pub cull_words: u32,
    /// Blocks that the grid has room for.
    pub blocks: u32,
    /// Entries of the hash table, a power of two.
    pub table: u32,
    /// Chunks of particles.
    pub chunks: u32,
}

impl Sizes {
    pub fn new(particles: u32, solids: bool, colliders: u32, blocks: u32) -> Self {
        Sizes {
            particles,
            solids,
            colliders,
            cull_words: colliders.div_ceil(32),
            blocks,
            // At most half full, so that probing ends soon.
            table: (2 * blocks).next_power_of_two(),
            chunks: particles / CHUNK + blocks,
        }
    }
}

impl StepConstants {
    pub fn new(c: &Constants<f32>, sizes: &Sizes) -> Self {
        StepConstants {
            kick: c.kick,
            max_displacement: c.max_displacement,
            lo: c.lo,
            max_gradient: c.max_gradient,
            hi: c.hi,
            volume_gain: c.volume_gain,
            momentum_scale: c.momentum_scale,
            mass_scale: c.mass_scale,
            measure_limit: MEASURE_LIMIT as f32,
            tension_limit: c.tension_limit,
            push_out: c.push_out,
            rescale: c.rescale,
            particle_count: sizes.particles,
            open_sides: c.open_sides,
            collider_count: sizes.colliders,
            cull_words: sizes.cull_words,
            table_mask: sizes.table - 1,
            max_blocks: sizes.blocks,
        }
    }
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Material {
    pub model: u32,
    pub gain: f32,
    pub viscous_relaxation: f32,
    pub inverse_density: f32,
    pub shape_weight: f32,
    pub yield_limit: f32,
    pub padding: [f32; 2],
}

impl From<&MaterialConstants<f32>> for Material {
    fn from(m: &MaterialConstants<f32>) -> Self {
        Material {
            model: m.model,
            gain: m.gain,
            viscous_relaxation: m.viscous_relaxation,
            inverse_density: m.inverse_density,
            shape_weight: m.shape_weight,
            yield_limit: m.yield_limit,
            padding: [0.0; 2],
        }
    }
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Collider {
    pub position: [f32; 3],
    pub kind: u32,
    pub size: [f32; 3],
    pub friction: f32,
    pub shift: [f32; 3],
    pub padding: f32,
    pub axes: [[f32; 4]; 3],
    pub turn: [[f32; 4]; 3],
}

impl From<&ColliderConstants<f32>> for Collider {
    fn from(c: &ColliderConstants<f32>) -> Self {
        let columns = |m: [[f32; 3]; 3]| m.map(|c| [c[0], c[1], c[2], 0.0]);
        Collider {
            position: c.position,
            kind: c.kind,
            size: c.size,
            friction: c.friction,
            shift: c.shift,
            padding: 0.0,
            axes: columns(c.axes),
            turn: columns(c.turn),
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
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Block {
    pub key: u32,
    pub entry: u32,
    pub start: u32,
    pub count: u32,
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Chunk {
    pub block: u32,
    pub start: u32,
    pub count: u32,
    pub key: u32,
    pub links: [u32; 8],
    pub cells: [u32; NODES],
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct Counters {
    pub halted: u32,
    pub occupied: u32,
    pub halo: u32,
    pub ordered: u32,
    pub chunks: u32,
    pub steps: u32,
    pub steps_deferred: u32,
    pub saturated_nodes: u32,
    pub speed_clamped: u32,
    pub gradient_clamped: u32,
    pub escaped: u32,
    pub quarantined: u32,
    pub last_occupied: u32,
    pub last_active: u32,
}

impl Counters {
    /// Bytes from the front that belong to the step in hand, and are zeroed when it is begun anew.
    pub const OF_STEP: u64 = 5 * 4;
}

/// See the shader's struct of this name: workgroup counts of the indirect dispatches.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Dispatch {
    pub blocks: [u32; 3],
    pub nodes: [u32; 3],
    pub chunks: [u32; 3],
}

impl Dispatch {
    /// Nothing to do, for one of them.
    pub const NO_GROUPS: [u32; 3] = [0, 1, 1];
    /// Nothing to do.
    pub const NOTHING: Dispatch = Dispatch { blocks: Self::NO_GROUPS, nodes: Self::NO_GROUPS, chunks: Self::NO_GROUPS };
}

/// The constants that the shaders share with Rust, as WGSL text.
pub fn shared_constants(materials: usize) -> String {
    let numbers = [
        ("GROUP", GROUP),
        ("MAX_GROUPS", MAX_GROUPS),
        ("CHUNK", CHUNK),
        ("EDGE", EDGE as u32),
        ("NODES", NODES as u32),
        ("TILE_EDGE", TILE_EDGE as u32),
        ("TILE_NODES", TILE_NODES as u32),
        ("MATERIALS", materials.max(1) as u32),
        ("SWEEPS", SWEEPS as u32),
        ("SHAPE_BOX", sdf::BOX),
        ("SHAPE_SPHERE", sdf::SPHERE),
        ("MODEL_ELASTIC", solid::ELASTIC),
        ("MODEL_SAND", solid::SAND),
        ("MODEL_VISCOPLASTIC", solid::VISCOPLASTIC),
        ("MODEL_LIQUID", solid::LIQUID),
        ("SHAPE_CAPSULE", sdf::CAPSULE),
        ("SHAPE_CYLINDER", sdf::CYLINDER),
        ("INVERTED", sdf::INVERTED),
    ];
    let text: String = numbers.iter().map(|(name, value)| format!("const {name} = {value}u;\n")).collect();
    let [low, high] = VOLUME_RATIO;
    text + &format!(
        "const MIN_VOLUME_RATIO = {low:?};
const MAX_VOLUME_RATIO = {high:?};
const MIN_STRETCH = {:?};
const MAX_STRETCH = {:?};
const MAX_CORRECTION = {:?};
",
        STRETCH[0], STRETCH[1], CORRECTION
    )
}
