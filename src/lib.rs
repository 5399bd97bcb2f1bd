//! 3D Position-Based Material Point Method (PB-MPM): liquids, elastic solids, sand and clay on a sparse grid, stepped
//! by WGSL compute passes on wgpu or by a CPU path with the same results.
//!
//! A [`World`] says what exists, as plain data in SI units. A solver steps it: [`CpuSolver`] on the CPU, [`GpuSolver`]
//! as a guest on a host's wgpu device, `Headless` (feature `headless`) on a device of its own.
//!
//! ```
//! use pbmpm::{CpuSolver, DVec3, Material, Quality, Simulate, Spawn, World};
//!
//! let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
//! world.materials.push(Material::liquid("water"));
//! world.spawns.push(Spawn::cuboid("water", DVec3::new(0.3, 0.4, 0.3), DVec3::new(0.7, 0.8, 0.7)));
//! world.settings = Quality::Realtime.settings(&world); // once all else is there
//!
//! let mut solver = CpuSolver::<f32>::new(&world)?;
//! for _ in 0..12 {
//!     solver.advance(1.0 / 60.0)?; // 0.2 s of free fall, in as many steps as each frame needs
//! }
//! let fallen = 0.6 - solver.state()?.centre_of_mass_m[1];
//! assert!((fallen - 0.5 * 9.81 * 0.2 * 0.2).abs() < 1e-5);
//! # Ok::<(), pbmpm::Error>(())
//! ```
//!
//! # Conventions
//! SI units (m, s, kg, Pa), y up, right-handed, quaternions `[x, y, z, w]`. Inside, lengths are cells and velocities
//! are displacements per step; [`Units`] converts all that steps read and give.
//!
//! # Features
//! * `parallel`: the CPU path on all cores. The same bits for any number of threads.
//! * `scene`: scene files in JSON, and their schema.
//! * `mesh`: meshes from OBJ, STL and glTF files, heightfields from PNG files.
//! * `snapshot`: the state of a run in files, to go on from.
//! * `headless`: a blocking GPU runner with its own device, and wgpu's native backends.
//!
//! # Where to look
//! `ARCHITECTURE.md` has the map. The order of a step is in `src/plan.rs`, each stage in `src/stages` and `shaders/stages`.

// A library does not panic on input and does not print; tests, examples and benches may.
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::print_stdout))]

#[doc(hidden)]
pub mod bins;
mod camera;
mod collider;
mod cpu;
mod domain;
mod driver;
mod emitter;
mod error;
mod features;
#[cfg(any(feature = "scene", feature = "mesh"))]
mod files;
mod gpu;
#[cfg(feature = "headless")]
mod headless;
mod load;
#[cfg(feature = "headless")]
#[doc(hidden)]
pub mod lockstep;
mod material;
#[doc(hidden)]
pub mod math;
mod mesh;
mod motion;
#[doc(hidden)]
pub mod plan;
mod quality;
mod region;
mod report;
#[cfg(feature = "scene")]
pub mod scene;
mod sensor;
mod settings;
#[doc(hidden)]
pub mod shaders;
mod shape;
mod simulate;
mod snapshot;
mod spawn;
mod stages;
mod timeline;
mod tool;
mod units;
mod world;

pub use camera::Camera;
pub use collider::{Boundary, Collider};
pub use cpu::{CpuSolver, ParticleArrays};
pub use domain::{Domain, MAX_CELLS_PER_AXIS, Wall, Walls};
pub use driver::{FixedStep, FrameSteps};
pub use emitter::{Emitter, Rate};
pub use error::{Error, Result};
/// The glam whose vectors and quaternions worlds are written with.
pub use glam;
pub use glam::{DMat3, DQuat, DVec3, UVec3};
pub use gpu::tuning::Tuning;
pub use gpu::{GpuOptions, GpuSolver, ParticleBuffers};
#[cfg(feature = "headless")]
pub use headless::{AdapterChoice, Headless, adapters, choose_adapter, open_device};
pub use load::{Load, Loads, MeanLoad};
pub use material::{Material, Model};
pub use math::real::Real;
pub use mesh::{Heightfield, HeightfieldForm, MAX_GRID_POINTS, MAX_TRIANGLES, Mesh, MeshForm};
pub use motion::{MAX_KEYFRAMES, Motion};
pub use quality::Quality;
pub use region::Region;
pub use report::{Fate, Faults, Memory, Particle, Solved, Spent, State, StepReport, VolumeRatio, state_hash};
pub use sensor::Reading;
pub use settings::{Scheme, Settings, Sleep};
pub use shape::{Pose, Shape};
pub use simulate::{Advanced, Simulate, StageTime};
pub use snapshot::{Snapshot, SnapshotFault};
pub use spawn::{Fill, Spawn};
pub use tool::{Action, MAX_TOOLS, ScriptedTool, Tool};
pub use units::Units;
/// The wgpu that [`GpuSolver`] takes devices of.
pub use wgpu;
pub use world::{MAX_COLLIDERS, MAX_MATERIALS, MAX_MESHES, MAX_PARTICLES, MAX_REGIONS, World};
