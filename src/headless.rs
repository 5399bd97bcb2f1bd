//! A GPU solver with a device of its own, which waits for its results.

use crate::cpu::particle_out;
use crate::emitter::Rate;
use crate::error::{Error, Result};
use crate::gpu::pipelines::Inputs;
use crate::gpu::slots::Slot;
use crate::gpu::timing::StageTimer;
use crate::gpu::tuning::MOST_SOLO_LANES;
use crate::gpu::{GpuOptions, GpuSolver, begin};
use crate::load::Loads;
use crate::plan::{Pass, Stage};
use crate::region::Region;
use crate::report::{Memory, Particle, StepReport};
use crate::sensor::Reading;
use crate::shape::Pose;
use crate::simulate::{Simulate, StageTime};
use crate::snapshot::Snapshot;
use crate::spawn::Spawn;
use crate::tool::Tool;
use crate::units::Units;
use crate::world::World;
use glam::DVec3;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The longest wait for one submission.
const PATIENCE: Duration = Duration::from_secs(300);
/// Submissions that the device is working on or has queued while the next is recorded, so that it is never idle between
/// them.
const AHEAD: usize = 2;

/// The adapter to open.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct AdapterChoice {
    /// Part of the adapter's name, driver or backend, in any case, for example `llvmpipe`, `nvidia` or `gl`. Empty: a
    /// GPU before a software adapter, Vulkan, Metal and DirectX before OpenGL.
    pub name: String,
}

/// A [`GpuSolver`] with its own device.
#[derive(Debug)]
pub struct Headless {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: wgpu::AdapterInfo,
    solver: GpuSolver,
    /// The first error that the device has reported since this was last read.
    trouble: Arc<Mutex<Option<String>>>,
    timer: Option<StageTimer>,
}

/// Every adapter of every backend, or of what the environment (`WGPU_BACKEND`, `WGPU_VALIDATION` …) leaves of them.
pub fn adapters() -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    // This would insert a pass before each indirect dispatch to check counts that the solver's own shaders have
    // bounded.
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    let instance = wgpu::Instance::new(descriptor.with_env());
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
}

fn rank(info: &wgpu::AdapterInfo) -> (u8, u8) {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    let way = match info.backend {
        wgpu::Backend::Gl => 2,
        // Several times slower than Mesa's lavapipe, where both are installed.
        _ if info.name.contains("SwiftShader") => 1,
        _ => 0,
    };
    (kind, way)
}

/// The adapter that fits `choice`.
///
/// # Errors
/// [`Error::NoAdapter`] with the names of those that there are.
pub fn choose_adapter(choice: &AdapterChoice) -> Result<wgpu::Adapter> {
    let wanted = choice.name.to_lowercase();
    let describe = |info: &wgpu::AdapterInfo| format!("{} ({}, {:?})", info.name, info.driver, info.backend);
    let all = adapters();
    let names: Vec<_> = all.iter().map(|a| describe(&a.get_info())).collect();
    let fitting = all.into_iter().filter(|a| describe(&a.get_info()).to_lowercase().contains(&wanted));
    fitting.min_by_key(|a| rank(&a.get_info())).ok_or_else(|| {
        let found =
            if names.is_empty() { "none is installed".to_owned() } else { format!("found {}", names.join(", ")) };
        Error::NoAdapter(if wanted.is_empty() { found } else { format!("no name contains '{wanted}'; {found}") })
    })
}

/// Opens a device with `limits` and, where the adapter has them, timestamps.
///
/// # Errors
/// [`Error::NoAdapter`] in the adapter's words.
pub fn open_device(adapter: &wgpu::Adapter, limits: wgpu::Limits) -> Result<(wgpu::Device, wgpu::Queue)> {
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("pbmpm headless"),
        required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
        required_limits: limits,
        ..Default::default()
    };
    pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| Error::NoAdapter(e.to_string()))
}

/// `limits` with workgroups as wide as are used where the adapter has them.
fn widened(limits: wgpu::Limits, adapter: &wgpu::Limits) -> wgpu::Limits {
    let wide = |most: u32, there: u32| most.max(there.min(MOST_SOLO_LANES));
    wgpu::Limits {
        max_compute_invocations_per_workgroup: wide(
            limits.max_compute_invocations_per_workgroup,
            adapter.max_compute_invocations_per_workgroup,
        ),
        max_compute_workgroup_size_x: wide(limits.max_compute_workgroup_size_x, adapter.max_compute_workgroup_size_x),
        ..limits
    }
}

fn no_report() -> Error {
    Error::Device("the report did not arrive; the device may be lost".to_owned())
}

impl Headless {
    /// Opens an adapter and makes the particles of `world` on it.
    ///
    /// # Errors
    /// [`Error::NoAdapter`], or those of [`GpuSolver::new`].
    pub fn new(world: &World, choice: &AdapterChoice, options: &GpuOptions) -> Result<Self> {
        let limits = GpuSolver::required_limits(world, options)?;
        let adapter = choose_adapter(choice)?;
        let (device, queue) = open_device(&adapter, widened(limits, &adapter.limits()))?;
        // Without these wgpu would panic at an error, and not report the loss of the device.
        let trouble: Arc<Mutex<Option<String>>> = Arc::default();
        let note = |trouble: &Mutex<Option<String>>, words: String| {
            trouble.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(words);
        };
        let (errors, losses) = (trouble.clone(), trouble.clone());
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(&errors, error.to_string())));
        device.set_device_lost_callback(move |_, words| note(&losses, format!("lost: {words}")));
        // A driver that refuses a buffer or a shader reports it here.
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let solver = GpuSolver::new(&device, &queue, world, options);
        let refused = pollster::block_on(validation.pop()).or(pollster::block_on(memory.pop()));
        if let Some(error) = refused {
            return Err(Error::Device(error.to_string()));
        }
        let solver = solver?;
        Ok(Headless { device, queue, info: adapter.get_info(), solver, trouble, timer: None })
    }

    /// Measures stages from now on, at the cost of a submission per step; false if the device has no timestamps.
    pub fn measure_stages(&mut self) -> bool {
        self.timer = StageTimer::new(&self.device, &self.queue);
        self.timer.is_some()
    }

    /// The adapter.
    pub fn adapter(&self) -> &wgpu::AdapterInfo {
        &self.info
    }

    /// The device, for renderers.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The queue, for renderers.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// The solver, for renderers.
    pub fn solver(&self) -> &GpuSolver {
        &self.solver
    }

    pub(crate) fn solver_mut(&mut self) -> &mut GpuSolver {
        &mut self.solver
    }

    /// Runs one pass of the step with these inputs.
    pub(crate) fn run_pass(&self, pass: Pass, inputs: &Inputs) -> Result<()> {
        let mut encoder = self.encoder();
        self.solver.record(&mut begin(&mut encoder, None), pass, inputs);
        self.submit_and_wait(encoder)
    }

    /// A buffer's contents.
    pub(crate) fn read<T: bytemuck::Pod>(&self, slot: Slot) -> Result<Vec<T>> {
        let source = self.solver.buffer(slot);
        // Whole items only: a buffer's end may be padding.
        let bytes = source.size() / size_of::<T>() as u64 * size_of::<T>() as u64;
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pbmpm headless readback"),
            size: bytes,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.encoder();
        encoder.copy_buffer_to_buffer(source, 0, &staging, 0, bytes);
        self.submit_and_wait(encoder)?;
        self.map(&staging, bytes)
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("pbmpm headless") })
    }

    fn submit_and_wait(&self, encoder: wgpu::CommandEncoder) -> Result<()> {
        self.wait(self.queue.submit([encoder.finish()]))
    }

    fn wait(&self, index: wgpu::SubmissionIndex) -> Result<()> {
        let wait = wgpu::PollType::Wait { submission_index: Some(index), timeout: Some(PATIENCE) };
        let waited = self.device.poll(wait).map(drop).map_err(|e| Error::Device(e.to_string()));
        // An error that the device reports says more than that it did not return.
        let trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner).take();
        trouble.map_or(waited, |words| Err(Error::Device(words)))
    }

    /// Reads `bytes` bytes of a buffer that was copied to mappable memory.
    fn map<T: bytemuck::Pod>(&self, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<T>> {
        let (send, receive) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, ..bytes, move |result| {
            // The receiver waits below; where it has given up there is nobody to tell.
            let _ = send.send(result);
        });
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: Some(PATIENCE) };
        self.device.poll(wait).map_err(|e| Error::Device(e.to_string()))?;
        let mapped = receive.recv_timeout(PATIENCE).map_err(|e| Error::Device(e.to_string()))?;
        mapped.map_err(|e| Error::Device(e.to_string()))?;
        let view = buffer.get_mapped_range(..bytes).map_err(|e| Error::Device(e.to_string()))?;
        let items = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        buffer.unmap();
        Ok(items)
    }

    /// Takes steps until `target` are taken.
    fn run_to(&mut self, target: u64) -> Result<()> {
        let mut submitted = VecDeque::new();
        while self.solver.step() < target || !self.solver.all_finished() {
            let mut encoder = self.encoder();
            // A timed step is read before the next. Other batches are a quarter of the ring, so that there is room for
            // all that are ahead.
            let (batch, ahead) = match self.timer {
                Some(_) => (1, 0),
                None => ((self.solver.steps_in_flight() / 4).min(8), AHEAD),
            };
            let before = self.solver.step();
            let missing = target.saturating_sub(before).min(u64::from(batch));
            // With nothing missing this only lets the solver take in what has come back.
            let mut encode = |_| self.solver.encode(&mut encoder, self.timer.as_mut()).map(drop);
            let recorded = (0..missing).try_for_each(&mut encode);
            self.solver.encode_report(&mut encoder);
            submitted.push_back(self.queue.submit([encoder.finish()]));
            // What was recorded before a step failed is submitted, lest it count as lost.
            recorded?;
            let left = if missing > 0 { ahead } else { 0 };
            for index in submitted.drain(..submitted.len().saturating_sub(left)) {
                self.wait(index)?;
            }
            let report = self.solver.poll_report()?;
            // All submissions were waited for; without a report this loop would never end.
            if submitted.is_empty() {
                report.ok_or_else(no_report)?;
            }
            // A step that was deferred for want of room is not timed.
            if let (Some(timer), true) = (&self.timer, self.solver.step() > before) {
                let ticks = self.map(&timer.staging, timer.staging.size())?;
                if let Some(timer) = &mut self.timer {
                    timer.add(&ticks);
                }
            }
        }
        Ok(())
    }
}

impl Simulate for Headless {
    fn step(&mut self) -> Result<()> {
        self.steps(1)
    }

    fn steps(&mut self, count: u32) -> Result<()> {
        self.run_to(self.solver.step() + u64::from(count))
    }

    fn particles(&mut self) -> Result<Vec<Particle>> {
        if self.solver.particle_buffers().count == 0 {
            return Ok(Vec::new());
        }
        let position: Vec<[f32; 4]> = self.read(Slot::Position)?;
        let displacement: Vec<[f32; 4]> = self.read(Slot::Displacement)?;
        let gradient: Vec<[[f32; 4]; 3]> = self.read(Slot::Gradient)?;
        let timeline = self.solver.timeline();
        let (units, dt) = (timeline.units, timeline.last_dt());
        let f64s = |v: [f32; 4]| v.map(f64::from);
        let particles = position.iter().zip(&displacement).zip(&gradient);
        Ok(particles.map(|((x, u), d)| particle_out(&units, dt, f64s(*x), f64s(*u), d.map(f64s))).collect())
    }

    fn report(&mut self) -> Result<StepReport> {
        let mut encoder = self.encoder();
        self.solver.encode_report(&mut encoder);
        self.submit_and_wait(encoder)?;
        let report = self.solver.poll_report()?;
        report.ok_or_else(no_report)
    }

    fn sensors(&mut self) -> Result<Vec<Reading>> {
        self.report()?;
        Ok(self.solver.sensors().to_vec())
    }

    fn loads(&mut self) -> Result<Loads> {
        self.report()?;
        Ok(self.solver.loads().clone())
    }

    fn memory(&self) -> Memory {
        self.solver.memory()
    }

    fn poses(&self) -> &[Pose] {
        self.solver.poses()
    }

    fn units(&self) -> Units {
        self.solver.units()
    }

    fn gravity(&self) -> DVec3 {
        self.solver.gravity()
    }

    fn time(&self) -> f64 {
        self.solver.time()
    }

    fn dt(&self) -> f64 {
        self.solver.dt()
    }

    fn set_dt(&mut self, dt: f64) -> Result<()> {
        self.solver.set_dt(dt)
    }

    fn plan_frame(&mut self, frame: f64) -> Result<u32> {
        self.solver.divide_frame(frame)
    }

    fn set_gravity(&mut self, gravity: DVec3) -> Result<()> {
        self.solver.set_gravity(gravity)
    }

    fn set_collider(&mut self, index: usize, pose: Option<Pose>, linear: DVec3, angular: DVec3) -> Result<()> {
        self.solver.set_collider(index, pose, linear, angular)
    }

    fn add(&mut self, spawn: &Spawn) -> Result<usize> {
        self.solver.add(spawn)
    }

    fn remove(&mut self, region: &Region) -> Result<()> {
        self.solver.remove(region)
    }

    fn save(&mut self) -> Result<Snapshot> {
        let mut encoder = self.encoder();
        self.solver.encode_snapshot(&mut encoder)?;
        self.submit_and_wait(encoder)?;
        let snapshot = self.solver.poll_snapshot()?;
        snapshot.ok_or_else(|| Error::Device("the snapshot did not arrive".to_owned()))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<()> {
        self.solver.restore(snapshot)
    }

    fn release_quarantined(&mut self) {
        self.solver.release_quarantined();
    }

    fn set_emission(&mut self, emitter: usize, rate: Rate) -> Result<()> {
        self.solver.set_emission(emitter, rate)
    }

    fn set_tools(&mut self, tools: &[Tool]) -> Result<()> {
        self.solver.set_tools(tools)
    }

    fn stage_times(&self) -> Vec<StageTime> {
        let Some(timer) = &self.timer else {
            return Vec::new();
        };
        let steps = timer.steps.max(1) as f64;
        let ran = Stage::ALL.into_iter().zip(timer.total).filter(|(_, t)| !t.is_zero());
        ran.map(|(stage, t)| StageTime { stage: stage.name(), seconds: t.as_secs_f64() / steps }).collect()
    }
}
