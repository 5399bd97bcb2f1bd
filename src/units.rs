//! The one place that converts the inputs and outputs of steps between SI units outside and cell units inside.
//!
//! Inside, a length is a number of cells, a time is a number of steps, and the mass unit is the mass of one cell of the
//! densest material at rest. Positions are measured from a point [`MARGIN`] cells below the domain's lower corner, so
//! that every particle in the domain has 27 nodes of non-negative index; along periodic axes half a cell further below,
//! so that the first node of every particle is between the sides, too.

use crate::world::World;
use glam::{DMat3, DVec3};

/// Cells between the lattice's first node and the domain's lower corner: one block.
pub const MARGIN: f64 = 4.0;

/// The same where the domain's sides are periodic.
pub(crate) const FIRST_BETWEEN: f64 = MARGIN + 0.5;

/// The domain's lower corner, in cells from the lattice's first node, where matter is repeated after this `period`, if at
/// all.
pub(crate) fn lower_corner(period: DVec3) -> DVec3 {
    DVec3::select(period.cmpgt(DVec3::ZERO), DVec3::splat(FIRST_BETWEEN), DVec3::splat(MARGIN))
}

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
            origin: world.domain.min - lower_corner(world.domain.period_cells()) * cell_size,
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

    /// m → cells, of a displacement or of edges.
    pub fn way_in(&self, way: DVec3) -> DVec3 {
        way / self.cell_size
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

    /// rad/s → rad per step.
    pub fn turn_in(&self, angular_velocity: DVec3, dt: f64) -> DVec3 {
        angular_velocity * dt
    }

    /// Displacement gradient → velocity gradient, 1/s.
    pub fn gradient_out(&self, gradient: DMat3, dt: f64) -> DMat3 {
        gradient * (1.0 / dt)
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

    /// Pa → mass units per cell and s², and Pa s → mass units per cell and s.
    pub fn modulus_in(&self, modulus: f64) -> f64 {
        modulus / (self.density * self.cell_size * self.cell_size)
    }

    /// Mass units times cells per step → N s.
    pub fn impulse_out(&self, impulse: f64, dt: f64) -> f64 {
        self.mass_out(impulse) * self.cell_size / dt
    }

    /// N s times cells → N m s.
    pub fn moment_out(&self, moment: DVec3) -> DVec3 {
        moment * self.cell_size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The speed of sound converts as other speeds do, and an impulse is mass times speed.
    #[test]
    fn what_is_made_of_other_quantities_goes_with_them() {
        let units = Units { origin: DVec3::ZERO, cell_size: 0.02, density: 1200.0 };
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        let (modulus, density, dt) = (3e5, 900.0f64, 0.004);
        let sound = (units.modulus_in(modulus) / units.density_in(density)).sqrt();
        assert!(near(sound, units.length_in((modulus / density).sqrt())), "{sound}");
        assert!(near(units.impulse_out(3.0, dt), units.mass_out(3.0) * units.speed_out(1.0, dt)));
        let spin = units.gradient_out(DMat3::from_diagonal(units.turn_in(DVec3::ONE, dt)), dt);
        assert!(near(spin.x_axis.x, 1.0), "{spin}");
    }
}
