//! What a step's inputs say, in the number type of the CPU path: the same constants as in the GPU's buffers.

use super::gradient::{Gradient, with_mass};
use crate::math::distance_grid::DistanceGrid;
use crate::math::linear::dot;
use crate::math::real::Real;
use crate::stages::matter::AT_REST;
use crate::timeline::emission::Candidate;
use crate::timeline::{ColliderInput, StepInput};
use crate::tool::ToolInput;
use std::sync::Arc;

/// The constants of one step. Twin: `StepConstants` in `shaders/lib/layout.wgsl`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Constants<R> {
    pub kick: [R; 3],
    pub rescale: R,
    pub pressure_rescale: R,
    /// What a force adds to a displacement in the step, over the square of the step's length.
    pub impulse: R,
    pub max_displacement: R,
    pub max_gradient: R,
    pub volume_gain: R,
    pub tension_limit: R,
    pub push_out: R,
    pub lo: [R; 3],
    pub hi: [R; 3],
    /// Lengths along the axes after which matter is repeated; 0 where it is not.
    pub period: [R; 3],
    pub open_sides: u32,
    /// Whether the slots of quarantined particles are given back.
    pub release: bool,
    pub momentum_scale: R,
    pub mass_scale: R,
    pub load_scale: R,
    /// Mass of a cell of the lightest material at rest.
    pub lightest: R,
    pub tool_count: u32,
    /// Length of the step, s.
    pub seconds: R,
    /// Largest stiffness of liquids, as the square of their speed of sound in cells per step.
    pub stiffness_limit: R,
    /// The stiffness of liquids to the mean compression of a block, likewise; 0 where blocks share no pressure.
    pub block_stiffness: R,
    pub tolerance: R,
    /// Square of the largest displacement at rest; what the step adds to the time at rest, and the time after which
    /// matter sleeps, µs.
    pub rest_square: R,
    pub rest_lasted: u32,
    pub rest_needed: u32,
}

impl<R: Real> Constants<R> {
    pub fn new(input: &StepInput) -> Self {
        Constants {
            kick: vector(input.kick),
            rescale: R::of(input.rescale),
            pressure_rescale: R::of(input.pressure_rescale),
            impulse: R::of(input.impulse),
            max_displacement: R::of(input.max_displacement),
            max_gradient: R::of(input.max_gradient),
            volume_gain: R::of(input.volume_gain),
            tension_limit: R::of(input.tension_limit),
            push_out: R::of(input.push_out),
            lo: vector(input.lo),
            hi: vector(input.hi),
            period: vector(input.period),
            open_sides: input.open_sides,
            release: input.release,
            momentum_scale: R::of(R::scale(input.scales.momentum)),
            mass_scale: R::of(R::scale(input.scales.mass)),
            load_scale: R::of(input.load_scale),
            lightest: R::of(input.lightest),
            tool_count: input.tools.len() as u32,
            seconds: R::of(input.seconds),
            stiffness_limit: R::of(input.stiffness_limit),
            block_stiffness: R::of(input.block_stiffness),
            tolerance: R::of(input.tolerance),
            rest_square: R::of(input.sleep.as_ref().map_or(0.0, |sleep| sleep.square)),
            rest_lasted: input.sleep.as_ref().map_or(0, |sleep| sleep.lasted),
            rest_needed: input.sleep.as_ref().map_or(0, |sleep| sleep.needed),
        }
    }

    /// The motion that counts as rest beside edges, see [`AT_REST`].
    pub fn at_rest(&self) -> R {
        (R::of(2.0 * AT_REST) * dot(self.kick, self.kick).sqrt()).sqrt()
    }
}

/// A material's constants. Twin: `Material` in `shaders/lib/layout.wgsl`.
#[derive(Debug, Clone, Copy)]
pub struct MaterialConstants<R> {
    /// One of [`solid`](crate::stages::solid)'s tags.
    pub model: u32,
    /// The relaxation; of a liquid a third of it, which is what one iteration adds to each diagonal entry per unit of
    /// error.
    pub gain: R,
    pub viscous_relaxation: R,
    /// Cell volumes per mass unit.
    pub inverse_density: R,
    /// Weight of the shape in an elastic target.
    pub shape_weight: R,
    /// Largest norm of an elastic strain's deviator; of sand per unit of compressive strain.
    pub yield_limit: R,
    /// Bulk modulus over the mass unit per cell volume and the square of a cell, 1/s².
    pub bulk: R,
    /// Shear modulus in the same unit; of liquids 0.
    pub shear: R,
    /// Dynamic viscosity in the same unit, 1/s, where it acts as a loss of the particles' own shear rate.
    pub viscosity: R,
    /// The viscosity that is solved for; either is 0.
    pub solved_viscosity: R,
    /// The evenness (emptiest node over fullest) from which on it counts as lying evenly.
    pub even: R,
    /// Of a liquid: the density of the lightest liquid over its own, which is its pressure, as a divergence, over that
    /// of its block.
    pub lightness: R,
}

/// A tool in one step. Twin: `Tool` in `shaders/lib/layout.wgsl`.
#[derive(Debug, Clone, Copy)]
pub struct ToolConstants<R> {
    pub start: [R; 3],
    /// One over the square of its way's length; 0 for a tool that rests.
    pub inverse_way: R,
    pub way: [R; 3],
    /// One over the square of its radius.
    pub inverse_radius: R,
    pub push: [R; 3],
    /// Towards the centre, per radius.
    pub pull: R,
    pub spin: [R; 3],
    pub share: R,
}

impl<R: Real> ToolConstants<R> {
    pub fn new(input: &ToolInput) -> Self {
        let way = input.way.length_squared();
        ToolConstants {
            start: vector(input.start),
            inverse_way: R::of(if way > 1e-12 { 1.0 / way } else { 0.0 }),
            way: vector(input.way),
            inverse_radius: R::of(1.0 / (input.radius * input.radius)),
            push: vector(input.push),
            pull: R::of(input.pull / input.radius),
            spin: vector(input.spin),
            share: R::of(input.share),
        }
    }
}

/// A collider in one step, in numbers or in lanes. Twin: `Collider` in `shaders/lib/layout.wgsl`.
#[derive(Debug, Clone)]
pub struct ColliderConstants<T> {
    pub kind: u32,
    /// Place of its load, or [`load::NONE`](crate::load::NONE).
    pub load: u32,
    /// See [`faces`](crate::stages::faces).
    pub faces: u32,
    /// See [`joint`](crate::stages::joint).
    pub joints: u32,
    pub position: [T; 3],
    pub size: [T; 3],
    pub friction: T,
    pub axes: [[T; 3]; 3],
    pub shift: [T; 3],
    pub turn: [[T; 3]; 3],
    /// For shapes that are given by distances.
    pub grid: Option<Arc<DistanceGrid>>,
}

impl<T> ColliderConstants<T> {
    pub fn new(input: &ColliderInput, of: impl Fn(f64) -> T) -> Self {
        let vector = |v: glam::DVec3| v.to_array().map(&of);
        let matrix = |m: glam::DMat3| m.to_cols_array_2d().map(|c| c.map(&of));
        ColliderConstants {
            kind: input.kind,
            load: input.load,
            faces: input.faces,
            joints: input.joints,
            position: vector(input.position),
            size: vector(input.size),
            friction: of(input.friction),
            axes: matrix(input.axes),
            shift: vector(input.shift),
            turn: matrix(input.turn),
            grid: input.grid.clone(),
        }
    }
}

/// A particle that appears if its place is free. Twin: `Candidate` in `shaders/lib/layout.wgsl`.
#[derive(Debug, Clone, Copy)]
pub struct CandidateConstants<R> {
    pub position: [R; 3],
    pub limit: R,
    pub displacement: [R; 3],
    pub mass: R,
    pub turn: [R; 3],
    pub material: R,
}

impl<R: Real> CandidateConstants<R> {
    pub fn new(c: &Candidate) -> Self {
        CandidateConstants {
            position: vector(c.position),
            limit: R::of(c.limit),
            displacement: vector(c.displacement),
            mass: R::of(c.mass),
            turn: vector(c.turn),
            material: R::of(f64::from(c.material)),
        }
    }

    /// Position, displacement and gradient of the new particle.
    pub fn particle(&self) -> ([R; 4], [R; 4], Gradient<R>) {
        let ([x, y, z], [u, v, w], [a, b, c]) = (self.position, self.displacement, self.turn);
        let (zero, one) = (R::of(0.0), R::of(1.0));
        // Spin: the gradient of turn × position.
        let spin = [[zero, c, zero - b], [zero - c, zero, a], [b, zero - a, zero]];
        ([x, y, z, one], [u, v, w, zero], with_mass(spin, self.mass, self.material))
    }
}

pub fn vector<R: Real>(v: glam::DVec3) -> [R; 3] {
    v.to_array().map(R::of)
}
