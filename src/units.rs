//! The one place that converts between SI units outside and cell units inside.
//!
//! Inside, a length is a number of cells, a time is a number of steps, and the mass unit is the mass of one cell of the
//! densest material at rest. Positions are measured from a point [`MARGIN`] cells below the domain's lower corner, so
//! that every particle in the domain has 27 nodes of non-negative index.

use crate::world::World;
use glam::DVec3;

/// Cells between the lattice's first node and the domain's lower corner: one block.
pub const MARGIN: f64 = 4.0;

/// Conversion factors of one world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// World position of the inside's origin, m.
    pub origin: DVec3,
    /// Edge of a cell, m.
    pub cell_size: f64,
    /// Rest density of the densest material that takes part, kg/m³.
    pub density: f64,
}

impl Units {
    pub(crate) fn new(world: &World) -> Self {
        let cell_size = world.domain.cell_size;
        let density = world.taking_part().map(|(_, m)| m.rest_density).fold(0.0, f64::max);
        Units {
            origin: world.domain.min - DVec3::splat(MARGIN * cell_size),
            cell_size,
            density: if density > 0.0 { density } else { 1.0 },
        }
    }

    /// m → cells from the inside's origin.
    pub fn position_in(&self, position: DVec3) -> DVec3 {
        (position - self.origin) / self.cell_size
    }

    /// Cells from the inside's origin → m.
    pub fn position_out(&self, cells: DVec3) -> DVec3 {
        self.origin + cells * self.cell_size
    }

    /// m/s → cells per step.
    pub fn velocity_in(&self, velocity: DVec3, dt: f64) -> DVec3 {
        velocity * (dt / self.cell_size)
    }

    /// Cells per step → m/s.
    pub fn velocity_out(&self, displacement: DVec3, dt: f64) -> DVec3 {
        displacement * (self.cell_size / dt)
    }

    /// Cells per step → m/s, of a speed.
    pub fn speed_out(&self, displacement: f64, dt: f64) -> f64 {
        displacement * (self.cell_size / dt)
    }

    /// m/s² → cells per step, gained in one step.
    pub fn acceleration_in(&self, acceleration: DVec3, dt: f64) -> DVec3 {
        acceleration * (dt * dt / self.cell_size)
    }

    /// m → cells.
    pub fn length_in(&self, length: f64) -> f64 {
        length / self.cell_size
    }

    /// Cells → m.
    pub fn length_out(&self, cells: f64) -> f64 {
        cells * self.cell_size
    }

    /// m³ → cell volumes.
    pub fn volume_in(&self, volume: f64) -> f64 {
        volume / self.cell_size.powi(3)
    }

    /// kg/m³ → mass units per cell volume.
    pub fn density_in(&self, density: f64) -> f64 {
        density / self.density
    }

    /// Mass units → kg.
    pub fn mass_out(&self, mass: f64) -> f64 {
        mass * self.density * self.cell_size.powi(3)
    }
}
