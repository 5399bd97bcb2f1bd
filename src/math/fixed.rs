//! Fixed-point scales of the particle-to-grid sums.
//!
//! A node's mass is summed in units of `1/mass_scale` and read as a `u32`; its momentum in units of
//! `1/momentum_scale`, read as an `i32`. Both scales are powers of two, so that scaling is exact.
//!
//! * A particle's velocity at a node is at most `U = max_displacement + √(3·1.5²)·max_gradient` per component, because
//!   its displacement and its displacement gradient are clamped to those norms before the scatter. This holds for the
//!   published scheme; in the others U is the largest motion that particles bring in that step (`stages::motion`).
//! * Hence |momentum| ≤ U · mass at every node, and with `momentum_scale ≤ mass_scale/(2 U)` the momentum channel
//!   cannot wrap before the mass channel does.
//! * One workgroup scatters at most [`CHUNK`] particles, each with at most `0.75³` of its mass to one node, into a
//!   tile. The scale leaves room for that, so that a tile cannot wrap.
//! * Where tiles are added to the grid, each addition of mass is checked. Masses are not negative, so that the check
//!   finds a wrap in whatever order the tiles arrive; half the range is reported before the whole of it is used up.

use super::kernel::KERNEL_REACH;
use super::real::Real;

/// Particles that one workgroup scatters.
pub const CHUNK: u32 = 256;
/// Largest Frobenius norm of a scattered displacement gradient, per step.
pub const MAX_GRADIENT: f64 = 1.5;
/// Largest weight of one node.
const MAX_WEIGHT: f64 = 0.75 * 0.75 * 0.75;

/// The scales of one world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// Units per unit of mass (the mass of a cell of the densest material at rest).
    pub mass: f64,
    /// Units per unit of momentum (that mass times one cell per step).
    pub momentum: f64,
}

/// Largest velocity component, in cells per step, that a particle brings to a node.
pub fn velocity_bound(max_displacement: f64) -> f64 {
    max_displacement + 3f64.sqrt() * KERNEL_REACH * MAX_GRADIENT
}

impl Scales {
    /// For particles of at most `max_particle_mass` and nodes of up to `max_fill` cell masses (reported at that,
    /// wrapping at twice that).
    pub fn new(max_particle_mass: f64, max_fill: f64, max_displacement: f64) -> Self {
        let room = (2.0 * max_fill).max(f64::from(CHUNK) * MAX_WEIGHT * max_particle_mass);
        let mass = (2f64.powi(32) / room).binade().0;
        let momentum = (mass / (2.0 * velocity_bound(max_displacement))).binade().0;
        Scales { mass, momentum }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_powers_of_two_and_leave_room() {
        for (mass, fill, displacement) in [(0.125, 16.0, 4.0), (0.2, 16.0, 4.0), (8.0, 16.0, 1.0), (1e-3, 4096.0, 16.0)]
        {
            let s = Scales::new(mass, fill, displacement);
            assert_eq!((s.mass.binade().0, s.momentum.binade().0), (s.mass, s.momentum));
            assert!(s.mass * 2.0 * fill <= 2f64.powi(32));
            assert!(s.mass * mass * MAX_WEIGHT * f64::from(CHUNK) <= 2f64.powi(32));
            assert!(s.momentum * velocity_bound(displacement) * (2f64.powi(32) / s.mass) <= 2f64.powi(31));
        }
    }
}
