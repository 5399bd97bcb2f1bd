//! Writes numbers into particles, as a host may do in the buffers of a device.

use crate::cpu::CpuSolver;
use crate::gpu::slots::Slot;
use crate::headless::Headless;
use crate::math::real::Real;

/// The arrays that can be written to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Array {
    /// Four lanes: position, volume ratio or fate.
    Position,
    /// Four lanes: displacement, volume fraction.
    Displacement,
    /// Three columns of four lanes.
    Gradient,
    /// Three columns of four lanes, in worlds whose matter has deformation gradients.
    Deformation,
}

/// A solver whose particles can be overwritten.
pub trait Spoil {
    /// Writes a lane of the particle in a slot that has been used.
    fn spoil(&mut self, slot: usize, array: Array, lane: usize, value: f32);
}

impl<R: Real> Spoil for CpuSolver<R> {
    fn spoil(&mut self, slot: usize, array: Array, lane: usize, value: f32) {
        let s = &mut self.state;
        let Some(at) = s.id.iter().position(|id| *id as usize == slot) else { return };
        let value = R::of(f64::from(value));
        match array {
            Array::Position => s.position[at][lane] = value,
            Array::Displacement => s.displacement[at][lane] = value,
            Array::Gradient => s.gradient[at][lane / 4][lane % 4] = value,
            Array::Deformation => s.deformation[at][lane / 4][lane % 4] = value,
        }
    }
}

impl Spoil for Headless {
    fn spoil(&mut self, slot: usize, array: Array, lane: usize, value: f32) {
        let (buffer, lanes) = match array {
            Array::Position => (Slot::Position, 4),
            Array::Displacement => (Slot::Displacement, 4),
            Array::Gradient => (Slot::Gradient, 12),
            Array::Deformation => (Slot::Deformation, 12),
        };
        let offset = 4 * (slot * lanes + lane) as u64;
        self.queue().write_buffer(self.solver().buffer(buffer), offset, bytemuck::bytes_of(&value));
    }
}
