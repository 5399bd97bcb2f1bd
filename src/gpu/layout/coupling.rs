//! How the pressures of the blocks whose tiles reach a block of nodes act on each other there: vectors of four, by their
//! first. See `shaders/lib/couplings.wgsl`.

/// The eight blocks.
pub const SOURCES: usize = 0;
/// The upper triangle of the matrix, by rows.
pub const MATRIX: usize = 2;
/// Divergence of the predicted motion.
pub const MOTIONS: usize = 11;
/// Effect of the directions of search on the divergence.
pub const IMAGES: usize = 13;
/// The product of the directions with that effect.
pub const WORK: usize = 15;
/// All of them.
pub const VECTORS: usize = 16;
