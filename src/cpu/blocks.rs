//! What the liquids of a block share: a pressure that responds to the mean of their volume ratios.

use crate::math::real::Real;

/// The pressure of a block's liquids, beside those of its particles, in the unit of the lightest of the world's
/// liquids: a denser one adds less to its displacement gradients by the same pressure.
#[derive(Debug, Clone, Copy, Default)]
pub struct BlockPressure<R> {
    /// Volume of the liquids, as the mass that the lightest has in it; 0 where the block takes no part.
    pub volume: R,
    /// The block's part of the pressure that particles carry over.
    pub load: R,
    /// The largest that the block's pressure may be.
    pub most: R,
    /// Change of the block's pressure.
    pub found: R,
    /// Residual divergence, times the volume.
    pub residual: R,
    /// Direction of search.
    pub direction: R,
    /// Divergence per pressure, times the volume.
    pub compliance: R,
    /// The inverse of a pressure's effect on the block's own divergence.
    pub inverse: R,
}

/// How the pressures of the blocks whose tiles reach a block of nodes act on each other there, in the numbering of
/// these blocks.
#[derive(Debug, Clone, Copy)]
pub struct Coupling<R> {
    /// By rows: the divergence that the column's pressure brings to the row.
    pub matrix: [R; 64],
    /// Divergence of the predicted motion.
    pub motion: [R; 8],
    /// Effect of the directions of search on the divergence.
    pub image: [R; 8],
    /// Product of the directions with that effect.
    pub work: R,
}

impl<R: Real> Default for Coupling<R> {
    fn default() -> Self {
        let zero = R::of(0.0);
        Coupling { matrix: [zero; 64], motion: [zero; 8], image: [zero; 8], work: zero }
    }
}
