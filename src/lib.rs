//! x
pub mod bins;
mod collider;
mod cpu;
mod error;
mod gpu;
#[cfg(feature="headless")]
mod headless;
pub mod math;
mod material;
mod plan;
mod report;
#[cfg(feature="scene")] pub mod scene;
mod settings;
mod shape;
mod simulate;
mod spawn;
mod stages;
mod timeline;
mod units;
mod world;
pub use collider::*; pub use error::*; pub use material::*; pub use report::*; pub use settings::*; pub use shape::*; pub use simulate::*; pub use spawn::*; pub use units::*; pub use world::*; pub use cpu::CpuSolver; pub use plan::*; pub use gpu::{GpuSolver,GpuOptions,ParticleBuffers};
#[cfg(feature="headless")] pub use headless::*;
