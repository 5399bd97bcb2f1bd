//! Pictures and particle files.

use crate::Failure;
use crate::args::Args;
use crate::engine::{Engine, adapter_choice};
use crate::render::{ColorBy, Renderer, write_png};
use pbmpm::{Fate, GpuOptions, GpuSolver, Particle, ParticleArrays, ParticleBuffers, World};
use std::io::Write;
use std::path::Path;

/// Takes pictures of an engine's particles.
pub struct Artist {
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
    size: (u32, u32),
    color: ColorBy,
    /// Buffers to which the particles of a CPU path are copied for a picture: positions, displacements, gradients.
    staging: Option<[wgpu::Buffer; 3]>,
}

/// Why there are no pictures.
pub enum NoArtist {
    /// There is nothing to draw with; the run itself is valid.
    NoAdapter(String),
    /// The call is invalid.
    Mistake(Failure),
}

impl<E: Into<Failure>> From<E> for NoArtist {
    fn from(error: E) -> Self {
        NoArtist::Mistake(error.into())
    }
}

impl Artist {
    /// Draws on the engine's own device, or opens an adapter for a CPU path.
    pub fn new(engine: &Engine, world: &World, args: &Args) -> Result<Self, NoArtist> {
        let (device, queue) = match engine {
            Engine::Gpu(headless) => (headless.device().clone(), headless.queue().clone()),
            _ => {
                let limits = GpuSolver::required_limits(world, &GpuOptions::default())?;
                let opened = pbmpm::choose_adapter(&adapter_choice(args)).and_then(|a| pbmpm::open_device(&a, limits));
                match opened {
                    Ok(opened) => opened,
                    Err(e) if args.adapter.is_none() => return Err(NoArtist::NoAdapter(e.to_string())),
                    Err(e) => return Err(e.into()),
                }
            }
        };
        // An adapter may be able to compute but not to draw, which shows when pipelines are made.
        let filters = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::Validation];
        let [outer, inner] = filters.map(|filter| device.push_error_scope(filter));
        let renderer = Renderer::new(&device, &queue, world, &engine.solver().units(), args.size);
        let errors = [inner, outer].map(|scope| pollster::block_on(scope.pop()));
        let renderer = renderer?;
        if let Some(error) = errors.into_iter().flatten().next() {
            // The message has many lines, the last of which says what is missing.
            let text = error.to_string();
            let reason = text.lines().rev().map(str::trim).find(|line| !line.is_empty()).unwrap_or("no reason given");
            return Err(NoArtist::NoAdapter(format!("the adapter cannot draw them: {reason}")));
        }
        let staging = (!matches!(engine, Engine::Gpu(_))).then(|| {
            let count = world.capacity().unwrap_or(0).max(1) as u64;
            [16, 16, 48].map(|bytes| {
                device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("headless particles"),
                    size: count * bytes,
                    usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                })
            })
        });
        Ok(Artist { device, queue, renderer, size: args.size, color: args.color, staging })
    }

    /// Writes a picture of the engine's state to a PNG file.
    pub fn draw(&self, engine: &Engine, path: &Path) -> Result<(), Failure> {
        let particles = match (engine, &self.staging) {
            (Engine::Gpu(headless), _) => headless.solver().particle_buffers(),
            (Engine::Cpu(solver), Some(staging)) => self.upload(staging, &solver.gpu_layout()),
            (Engine::Cpu64(solver), Some(staging)) => self.upload(staging, &solver.gpu_layout()),
            (_, None) => return Ok(()),
        };
        let solver = engine.solver();
        let poses = solver.poses();
        let pixels = self.renderer.draw(&self.device, &self.queue, &particles, poses, solver.dt(), self.color)?;
        write_png(path, self.size, &pixels).map_err(|e| at(path, &e))
    }

    fn upload<'a>(&self, staging: &'a [wgpu::Buffer; 3], layout: &ParticleArrays) -> ParticleBuffers<'a> {
        let [position, displacement, gradient] = staging;
        self.queue.write_buffer(position, 0, bytemuck::cast_slice(&layout.position));
        self.queue.write_buffer(displacement, 0, bytemuck::cast_slice(&layout.displacement));
        self.queue.write_buffer(gradient, 0, bytemuck::cast_slice(&layout.gradient));
        ParticleBuffers { position, displacement, gradient, deformation: None, count: layout.position.len() as u32 }
    }
}

/// An error that names the file.
pub fn at(path: &Path, error: &dyn std::error::Error) -> Failure {
    format!("{}: {error}", path.display()).into()
}

/// Writes the particles that are alive to a binary PLY file, in SI units, with the colours of their materials.
/// Positions are in double precision, since a world may lie far from the origin.
pub fn write_ply(path: &Path, world: &World, particles: &[Particle]) -> Result<(), Failure> {
    let colors: Vec<[u8; 3]> = world.materials.iter().map(|m| m.color.map(srgb)).collect();
    let alive = || particles.iter().filter(|p| p.fate == Fate::Alive);
    let write = || {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        writeln!(file, "ply\nformat binary_little_endian 1.0\ncomment pbmpm, SI units, y up")?;
        writeln!(file, "element vertex {}", alive().count())?;
        for name in ["x", "y", "z"] {
            writeln!(file, "property double {name}")?;
        }
        for name in ["vx", "vy", "vz", "volume_ratio"] {
            writeln!(file, "property float {name}")?;
        }
        for name in ["material", "red", "green", "blue"] {
            writeln!(file, "property uchar {name}")?;
        }
        writeln!(file, "end_header")?;
        for p in alive() {
            for value in p.position.to_array() {
                file.write_all(&value.to_le_bytes())?;
            }
            for value in p.velocity.to_array().into_iter().chain([p.volume_ratio]) {
                file.write_all(&(value as f32).to_le_bytes())?;
            }
            let color = colors.get(p.material as usize).copied().unwrap_or([255; 3]);
            file.write_all(&[p.material as u8, color[0], color[1], color[2]])?;
        }
        file.flush()
    };
    write().map_err(|e| at(path, &e))
}

/// A linear channel as an sRGB byte.
fn srgb(linear: f32) -> u8 {
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}
