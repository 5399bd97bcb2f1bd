//! What the liquids of a block have in common: a pressure that answers to the mean of their volume.

use crate::math::real::Real;

/// The pressure of a block's liquids, beside those of its particles.
#[derive(Debug, Clone, Copy, Default)]
pub struct BlockPressure<R> {
    /// Mass of the liquids; 0 where the block takes no part.
    pub mass: R,
    /// Of the pressure that particles bring along what is the block's.
    pub load: R,
    /// The largest that the block's pressure may be.
    pub most: R,
    /// Change of the block's pressure.
    pub found: R,
    /// Divergence that is still wrong, times the mass.
    pub residual: R,
    /// Direction of search.
    pub direction: R,
    /// Divergence per pressure, times the mass.
    pub compliance: R,
    /// The inverse of what a pressure does to the block's own divergence.
    pub inverse: R,
}

/// What the pressures of the blocks around a block of nodes do to each other there, as those whose tiles reach it are numbered.
#[derive(Debug, Clone, Copy)]
pub struct Coupling<R> {
    /// By rows: the divergence that the column's pressure brings to the row.
    pub matrix: [R; 64],
    /// Divergence of the predicted motion.
    pub motion: [R; 8],
    /// What the directions of search do to the divergence.
    pub image: [R; 8],
    /// What they do against themselves.
    pub work: R,
}

impl<R: Real> Default for Coupling<R> {
    fn default() -> Self {
        let zero = R::of(0.0);
        Coupling { matrix: [zero; 64], motion: [zero; 8], image: [zero; 8], work: zero }
    }
}
