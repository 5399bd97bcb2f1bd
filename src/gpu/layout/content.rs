//! The data of a world and of a step, in the shaders' layout.

use crate::cpu::constants::{CandidateConstants, ColliderConstants, MaterialConstants, ToolConstants};
use crate::math::distance_grid::DistanceGrid as Grid;
use crate::timeline::disturbance::{self as timeline, DISTURBANCES};
use bytemuck::{Pod, Zeroable};

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
    pub bulk: f32,
    pub viscosity: f32,
    pub shear: f32,
    pub solved_viscosity: f32,
    pub even: f32,
    pub lightness: f32,
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
            bulk: m.bulk,
            viscosity: m.viscosity,
            shear: m.shear,
            solved_viscosity: m.solved_viscosity,
            even: m.even,
            lightness: m.lightness,
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
    pub load: u32,
    pub axes: [[f32; 4]; 3],
    pub turn_x: [f32; 3],
    pub faces: u32,
    pub turn_y: [f32; 3],
    pub joints: u32,
    pub turn_z: [f32; 4],
}

impl From<&ColliderConstants<f32>> for Collider {
    fn from(c: &ColliderConstants<f32>) -> Self {
        let columns = |m: [[f32; 3]; 3]| m.map(|c| [c[0], c[1], c[2], 0.0]);
        let [_, _, turn_z] = columns(c.turn);
        Collider {
            position: c.position,
            kind: c.kind,
            size: c.size,
            friction: c.friction,
            shift: c.shift,
            load: c.load,
            axes: columns(c.axes),
            turn_x: c.turn[0],
            faces: c.faces,
            turn_y: c.turn[1],
            joints: c.joints,
            turn_z,
        }
    }
}

/// Texels in a row of the texture of distances.
pub const DISTANCES_WIDTH: u32 = 2048;

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct DistanceGrid {
    pub lo: [f32; 3],
    pub spacing: f32,
    pub last: [f32; 3],
    pub inverse_spacing: f32,
    pub middle: [f32; 3],
    pub first: u32,
    pub extent: [f32; 3],
    pub padding: u32,
}

impl DistanceGrid {
    /// For a grid in cells whose distances begin at `first`.
    pub fn new(grid: &Grid, first: u32) -> Self {
        DistanceGrid {
            lo: grid.lo.as_vec3().to_array(),
            spacing: grid.spacing as f32,
            last: grid.counts.map(|n| (n - 1) as f32),
            inverse_spacing: (1.0 / grid.spacing) as f32,
            middle: grid.middle().as_vec3().to_array(),
            first,
            extent: grid.extent.as_vec3().to_array(),
            padding: 0,
        }
    }
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Candidate {
    pub position: [f32; 3],
    pub limit: f32,
    pub displacement: [f32; 3],
    pub mass: f32,
    pub turn: [f32; 3],
    pub material: f32,
}

impl From<CandidateConstants<f32>> for Candidate {
    fn from(c: CandidateConstants<f32>) -> Self {
        let CandidateConstants { position, limit, displacement, mass, turn, material } = c;
        Candidate { position, limit, displacement, mass, turn, material }
    }
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Tool {
    pub start: [f32; 3],
    pub inverse_way: f32,
    pub way: [f32; 3],
    pub inverse_radius: f32,
    pub push: [f32; 3],
    pub pull: f32,
    pub spin: [f32; 3],
    pub share: f32,
}

impl From<&ToolConstants<f32>> for Tool {
    fn from(t: &ToolConstants<f32>) -> Self {
        Tool {
            start: t.start,
            inverse_way: t.inverse_way,
            way: t.way,
            inverse_radius: t.inverse_radius,
            push: t.push,
            pull: t.pull,
            spin: t.spin,
            share: t.share,
        }
    }
}

/// See the shader's struct of this name.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Disturbance {
    pub lo: [u32; 3],
    pub count: u32,
    pub hi: [u32; 3],
    pub padding: u32,
}

impl Disturbance {
    /// The disturbances of a step; the first holds their number.
    pub fn all(of_step: &[timeline::Disturbance]) -> [Disturbance; DISTURBANCES] {
        let mut all = [Disturbance::zeroed(); DISTURBANCES];
        for (to, from) in all.iter_mut().zip(of_step) {
            (to.lo, to.hi) = (from.lo, from.hi);
        }
        all[0].count = of_step.len() as u32;
        all
    }
}
