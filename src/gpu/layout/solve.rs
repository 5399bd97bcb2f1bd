//! The state of the implicit scheme's solve, in the shaders' layout.

use bytemuck::{Pod, Zeroable};

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Search {
    pub pressure: f32,
    pub residual: f32,
    pub direction: f32,
    pub compliance: f32,
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Symmetric {
    pub diagonal: [f32; 3],
    pub padding: f32,
    pub off: [f32; 3],
    pub padding_too: f32,
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Shear {
    pub brought: Symmetric,
    pub found: Symmetric,
    pub residual: Symmetric,
    pub direction: Symmetric,
    pub compliance: f32,
    pub correction_x: f32,
    pub correction_y: f32,
    pub correction_z: f32,
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct StressSearch {
    pub mean: Search,
    pub shear: Shear,
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Held {
    pub axis: [f32; 3],
    pub count_and_body: u32,
    pub motion: [f32; 3],
    pub braked: f32,
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct BlockSums {
    pub sums: [u32; 6],
    pub softest: u32,
    pub firmest: u32,
    pub links: [u32; 8],
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct BlockPressure {
    pub residual: f32,
    pub inverse: f32,
    pub direction: f32,
    pub compliance: f32,
    pub found: f32,
    pub load: f32,
    pub most: f32,
    pub volume: f32,
}

/// Maxima over all particles, in this order; see [`Solve`](crate::cpu::solve::Solve).
pub(super) const LARGEST: [&str; 7] = ["PRESSURE", "RATE", "COMPLIANCE", "RESPONSE", "ANSWER", "DIRECTION", "FOUND"];
/// Sums over all particles or nodes, in this order.
pub(super) const WHOLE: [&str; 10] =
    ["SQUARE", "ANSWERS", "DIRECTIONS", "BOTH", "ENERGY", "MOTION", "NODE_MASS", "MOTION_X", "MOTION_Y", "MOTION_Z"];

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Solve {
    pub largest: [u32; LARGEST.len()],
    pub sums: [u32; 2 * WHOLE.len()],
    pub motion: f32,
    pub first_bound: f32,
    pub bound: f32,
    pub last_bound: f32,
    pub direction_bound: f32,
    pub ahead: f32,
    pub pressure_bound: f32,
    pub last_square: f32,
    pub first_square: f32,
    pub step: f32,
    pub mix: f32,
    pub change: f32,
    pub count: u32,
    pub going_on: u32,
    pub chunks: u32,
}
