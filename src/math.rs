//! Small numerics, each the twin of a file in `shaders/lib`.

pub mod fixed;
pub mod kernel;
pub mod linear;
pub mod real;
pub mod sdf;
