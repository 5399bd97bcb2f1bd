//! Small numerics. All except `fixed`, `real`, `wide` and the tests' `matrices` have twins in `shaders/lib`.

pub mod distance_grid;
pub mod exponential;
pub mod fixed;
pub mod kernel;
pub mod linear;
#[cfg(test)]
pub(crate) mod matrices;
pub mod real;
pub mod sdf;
pub mod svd;
pub mod symmetric;
pub mod wide;
