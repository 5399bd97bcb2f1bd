//! The GPU path, a guest on the caller's device. It records into the caller's encoder; it opens no device, submits
//! nothing, waits for nothing, and allocates nothing on the device while the grid has room.

pub(crate) mod buffers;
mod contents;
mod flight;
mod inputs;
pub(crate) mod layout;
pub(crate) mod pipelines;
pub(crate) mod readback;
mod requests;
pub(crate) mod requirements;
mod ring;
pub(crate) mod shader;
pub(crate) mod slots;
mod snapshot;
#[cfg_attr(not(feature = "headless"), expect(dead_code, reason = "times can only be read by a runner that waits"))]
pub(crate) mod timing;
pub(crate) mod tuning;

use crate::collider::Shapes;
use crate::error::{Error, Result};
use crate::load::{Ledger, Loads};
use crate::plan::{Needs, Pass, passes};
use crate::report::{Counts, Faults, Memory, StepReport, share};
use crate::sensor::{self, Reading};
use crate::shape::Pose;
use crate::timeline::{ColliderInput, Timeline};
use crate::units::Units;
use crate::world::World;
use buffers::Buffers;
use bytemuck::Zeroable;
use contents::{nothing_to_do, sizes, upload};
use flight::Flight;
use glam::DVec3;
use layout::{Counters, Sizes};
use pipelines::{Inputs, Pipelines};
use readback::CounterReadback;
use shader::{ColliderStore, Variant};
use slots::Slot;
use timing::StageTimer;
use tuning::Tuning;

/// How a [`GpuSolver`] is set up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GpuOptions {
    /// Steps that may be recorded before the device has finished the oldest; their constants wait in a ring of this
    /// length. Default 64, which is enough for three frames of a sixtieth of a second in the steps that fast matter
    /// needs; at least 4, at most 1024.
    pub steps_in_flight: u32,
    /// Blocks of 4³ nodes for which the grid has room at first: 1.4 KiB each, 2.4 KiB for several iterations of liquids
    /// alone in the published scheme, 5.4 KiB in the implicit scheme, 8.4 KiB with
    /// [`block_pressure`](crate::Settings::block_pressure), which the qualities realtime and accurate choose where it
    /// has an effect. Allowed 8 … 2²⁴. Default: by the matter at the start. The grid grows when a step needs more;
    /// see [`GpuSolver::encode_step`].
    pub grid_blocks: Option<u32>,
    /// How passes are cut into workgroups. Default: [`Tuning::of`] the device's adapter.
    pub tuning: Option<Tuning>,
}

impl Default for GpuOptions {
    fn default() -> Self {
        GpuOptions { steps_in_flight: 64, grid_blocks: None, tuning: None }
    }
}

/// The particles as they lie on the device, for renderers. Positions and displacements are in cells: a point in the
/// world is `units.origin + cells · units.cell_size`. The buffers stay the same as long as the solver lives.
#[derive(Debug, Clone, Copy)]
pub struct ParticleBuffers<'a> {
    /// `vec4f` per particle: position, volume ratio. A ratio not above 0 marks a particle that is not in the
    /// simulation: 0 for an empty slot, −1 escaped, −2 quarantined, with the rest of its state kept, −3 drained.
    pub position: &'a wgpu::Buffer,
    /// `vec4f` per particle: displacement in the last step (position minus displacement is where it came from), volume
    /// fraction measured on the grid.
    pub displacement: &'a wgpu::Buffer,
    /// Three `vec4f` per particle: columns of the displacement gradient; fourth lanes mass, material index (the whole part;
    /// the fraction notes faces of bodies before which the particle lies), and in the implicit scheme the pressure, in
    /// the explicit one the evenness of the matter around it.
    pub gradient: &'a wgpu::Buffer,
    /// Three `vec4f` per particle, as [`ParticleArrays::deformation`](crate::ParticleArrays::deformation); none in
    /// worlds without solids and without viscous liquids that stick. Hosts that write here must write finite numbers:
    /// steps check only the other arrays for non-finite ones.
    pub deformation: Option<&'a wgpu::Buffer>,
    /// How many slots there are: the world's [capacity](crate::Settings::capacity).
    pub count: u32,
}

/// Steps a world on a wgpu device that belongs to somebody else.
///
/// Each frame: [`encode_step`](Self::encode_step) as often as wanted, submit, poll the device as any wgpu application
/// does, and look at [`poll_report`](Self::poll_report). A recorded step must be submitted, in the order of recording.
#[derive(Debug)]
pub struct GpuSolver {
    device: wgpu::Device,
    queue: wgpu::Queue,
    timeline: Timeline,
    spawned: u32,
    sizes: Sizes,
    options: GpuOptions,
    buffers: Buffers,
    pipelines: Pipelines,
    readback: CounterReadback,
    flight: Flight,
    report: StepReport,
    ledger: Ledger,
    loads: Loads,
    sensors: Vec<Reading>,
    /// The report has not been asked for yet.
    fresh: bool,
    pending: Option<snapshot::Pending>,
}

impl GpuSolver {
    /// The limits to request of a device for `world`: WebGPU's defaults, raised only where the world's size needs it.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the world is not valid.
    pub fn required_limits(world: &World, options: &GpuOptions) -> Result<wgpu::Limits> {
        let seeds = world.seeds()?;
        let timeline = Timeline::new(world, &seeds)?;
        Ok(requirements::limits(&sizes(world, &seeds, &timeline, options)?))
    }

    /// Makes the particles of `world` on `device`. Needs no feature, and no limit above WebGPU's defaults for up to 1.5
    /// million particles in the implicit scheme (0.8 where it solves for stresses, 1.2 with
    /// [`block_pressure`](crate::Settings::block_pressure)) and 2.7 million in the others.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the world is not valid, [`Error::Unsupported`] if a limit of the device is too small.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, world: &World, options: &GpuOptions) -> Result<Self> {
        let seeds = world.seeds()?;
        let timeline = Timeline::new(world, &seeds)?;
        let sizes = sizes(world, &seeds, &timeline, options)?;
        requirements::check(&device.limits(), &sizes)?;
        let buffers = Buffers::new(device, &sizes);
        let fastest = upload(queue, &buffers, &sizes, world, &seeds, &timeline);
        let max_speed = timeline.units.speed_out(f64::from(fastest).sqrt(), timeline.last_dt());
        let input = timeline.input();
        let shapes = |of: &[ColliderInput]| Shapes::of_kinds(of.iter().map(|c| c.kind), sizes.grids);
        let adapter = device.adapter_info();
        let tuning = options.tuning.unwrap_or_else(|| Tuning::of(&adapter));
        let beside = tuning.beside(input.colliders.iter().map(|c| c.kind), timeline.features);
        let variant = Variant {
            features: timeline.features,
            colliders: ColliderStore::choose(sizes.colliders, device.limits().max_uniform_buffer_binding_size),
            materials: world.materials.len(),
            shapes: shapes(&input.colliders),
            drains: (!input.drains.is_empty()).then(|| shapes(&input.drains)),
            sensors: (!input.sensors.is_empty()).then(|| shapes(&input.sensors)),
            emission: sizes.candidates > 0,
            loads: sizes.loads > 0,
            tools: sizes.tools,
            tuning: Tuning { share: beside.share, ..tuning },
            lanes_beside: beside.lanes,
            solo_lanes: tuning.solo_lanes(&device.limits(), adapter.backend),
        };
        let ledger = Ledger::new(&world.colliders, &timeline.units, world.settings.dt);
        let mut pipelines = Pipelines::new(device, variant);
        pipelines.bind(device, &buffers, &sizes);
        Ok(GpuSolver {
            device: device.clone(),
            queue: queue.clone(),
            report: StepReport { alive: seeds.len() as u32, max_speed, ..StepReport::default() },
            timeline,
            spawned: seeds.len() as u32,
            sizes,
            options: options.clone(),
            buffers,
            pipelines,
            readback: CounterReadback::new(device, queue, &sizes),
            loads: ledger.loads(0, 0.0),
            sensors: vec![Reading::default(); world.sensors.len()],
            ledger,
            flight: Flight::default(),
            fresh: false,
            pending: None,
        })
    }

    /// Records one step and says whether it did. Several steps may be recorded into one submission.
    ///
    /// Every few steps it also records a copy of the counters, from which it learns which steps are finished. If the
    /// matter has spread over more blocks than the grid has room for, the device takes no further step rather than a
    /// wrong one. Once a copy has reported that, this records no step, returns false, and the clock stands still until
    /// all recorded steps are finished: submit, poll and call again. Then the grid is enlarged and the steps are taken
    /// again, each as it was asked for, by so many calls; whatever the host has asked for since then acts in the step
    /// after them. [`StepReport::step`] counts steps taken.
    ///
    /// # Errors
    /// [`Error::StepsInFlight`] if the device is too far behind; the call then records a copy of the counters at most.
    /// [`Error::StepsLost`] if recorded steps were not submitted, [`Error::Unsupported`] if the grid would outgrow the
    /// device, [`Error::Device`] if the device is lost.
    pub fn encode_step(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<bool> {
        self.encode(encoder, None)
    }

    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        timer: Option<&mut StageTimer>,
    ) -> Result<bool> {
        self.learn()?;
        if self.flight.is_full() {
            if self.flight.unfinished() > 0 {
                self.encode_report(encoder);
                return Ok(false);
            }
            self.grow()?;
        }
        if self.flight.unfinished() >= u64::from(self.options.steps_in_flight) {
            // The copies that would have reported may have been dropped with the steps.
            if !self.readback.on_its_way() {
                self.encode_report(encoder);
            }
            return Err(Error::StepsInFlight { max: self.options.steps_in_flight });
        }
        let input = self.timeline.input();
        let inputs = self.write_inputs(&input)?;
        let passes = passes(Needs { fused: self.pipelines.variant().fused(), ..self.timeline.needs(&input) });
        match timer {
            None => {
                let mut pass = begin(encoder, None);
                passes.for_each(|what| self.record(&mut pass, what, &inputs));
            }
            Some(timer) => timer.time(encoder, passes, |encoder, writes, what| {
                self.record(&mut begin(encoder, writes), what, &inputs);
            }),
        }
        self.flight.record(self.timeline.beginning(), inputs.candidates);
        self.timeline.advance(&input);
        if self.flight.recorded().is_multiple_of(u64::from(self.options.steps_in_flight / 4)) {
            self.encode_report(encoder);
        }
        Ok(true)
    }

    pub(crate) fn record(&self, pass: &mut wgpu::ComputePass<'_>, what: Pass, inputs: &Inputs) {
        self.pipelines.record(pass, what, &self.buffers, &self.sizes, inputs);
    }

    /// Records a copy of the counters for [`poll_report`](Self::poll_report); to be called once a frame at most.
    /// Without it a report comes every few steps. False if all staging buffers are still in use.
    pub fn encode_report(&mut self, encoder: &mut wgpu::CommandEncoder) -> bool {
        self.readback.encode(encoder, &self.buffers, self.flight.recorded())
    }

    /// The newest report that has arrived since the last call. It describes a step some frames back, whose number it
    /// states. [`report`](Self::report) keeps it.
    ///
    /// # Errors
    /// [`Error::Device`] if the report could not be read back, [`Error::StepsLost`] if it shows that recorded steps
    /// were not submitted.
    pub fn poll_report(&mut self) -> Result<Option<StepReport>> {
        self.learn()?;
        Ok(std::mem::take(&mut self.fresh).then_some(self.report))
    }

    /// Takes in the copies that have come back from the device.
    fn learn(&mut self) -> Result<()> {
        let Some(arrived) = self.readback.poll().map_err(Error::Device)? else {
            return Ok(());
        };
        let counts = self.counts(&arrived.counters);
        let step = extended(self.report.step, arrived.counters.steps);
        let moment = self.flight.before(step).unwrap_or(self.timeline.now());
        self.report = counts.report(&self.timeline, step, moment);
        self.ledger.take(self.readback.loads().iter().copied());
        self.loads = self.ledger.loads(step, self.report.time);
        let t = &self.timeline;
        self.sensors.clear();
        self.sensors.extend(self.readback.sensed().iter().map(|sums| sensor::reading(*sums, &t.units, t.first_dt)));
        self.fresh = true;
        let executed = step + self.report.faults.steps_deferred;
        if self.flight.learn(arrived.recorded, executed, arrived.counters.halted != 0) {
            // Time has not passed since the first step that was not taken.
            self.timeline.restore(self.flight.from(step));
        }
        match self.flight.lost() {
            0 => Ok(()),
            lost => Err(Error::StepsLost { lost }),
        }
    }

    /// The counts in a copy of the counters that was made not long before or after the present report.
    fn counts(&self, c: &Counters) -> Counts {
        let near = &self.report;
        let faults = &near.faults;
        Counts {
            spawned: self.spawned.into(),
            emitted: extended(near.emitted, c.emitted),
            drained: extended(near.drained, c.drained),
            withheld: extended(near.withheld, c.withheld),
            faults: Faults {
                saturated_nodes: extended(faults.saturated_nodes, c.saturated_nodes),
                speed_clamped: extended(faults.speed_clamped, c.speed_clamped),
                gradient_clamped: extended(faults.gradient_clamped, c.gradient_clamped),
                strain_clamped: extended(faults.strain_clamped, c.strain_clamped),
                escaped: extended(faults.escaped, c.escaped),
                quarantined: extended(faults.quarantined, c.quarantined),
                refused: extended(faults.refused, c.refused),
                steps_deferred: extended(faults.steps_deferred, c.steps_deferred),
            },
            iterations: extended(near.spent.iterations, c.iterations),
            capped: extended(near.spent.capped, c.capped),
            worst_change: c.worst_change.into(),
            occupied: c.last_occupied,
            active: c.last_active,
            asleep: c.last_asleep,
            largest_square: c.last_largest_square.into(),
            solved: (c.last_count, share(c.last_change, c.last_motion).into()),
        }
    }

    /// Makes room for twice as many blocks, or for as many more as the device allows. Nothing in the grid outlives a
    /// step, so nothing is copied.
    fn grow(&mut self) -> Result<()> {
        let limits = self.device.limits();
        // One more at least, and so many that there is no room for one more than that.
        let least = self.sizes.blocks.saturating_add(1);
        requirements::check(&limits, &self.sizes.with_blocks(least))?;
        let (mut fits, mut most) = (least, self.sizes.blocks.saturating_mul(2).max(least));
        while fits < most {
            let middle = fits + (most - fits).div_ceil(2);
            match requirements::check(&limits, &self.sizes.with_blocks(middle)) {
                Ok(()) => fits = middle,
                Err(_) => most = middle - 1,
            }
        }
        let sizes = self.sizes.with_blocks(fits);
        self.sizes = sizes;
        self.buffers.resize(&self.device, &sizes);
        self.pipelines.bind(&self.device, &self.buffers, &sizes);
        self.queue.write_buffer(self.buffers.get(Slot::Counters), 0, &[0; Counters::OF_STEP]);
        self.forget_blocks();
        if sizes.features.implicit() {
            self.write(Slot::Solve, bytemuck::bytes_of(&layout::Solve::zeroed()));
        }
        nothing_to_do(&self.queue, &self.buffers);
        // Copies on their way back still say that there is no room.
        self.readback = CounterReadback::new(&self.device, &self.queue, &sizes);
        self.flight.has_room();
        Ok(())
    }

    /// Empties the table of blocks, in which a step that was not taken may have left some.
    fn forget_blocks(&self) {
        self.write(Slot::Table, &vec![0; self.buffers.get(Slot::Table).size() as usize]);
    }

    /// The newest report that has arrived; that of step 0 before the first, and that of a snapshot after it has been
    /// [restored](Self::restore).
    pub fn report(&self) -> &StepReport {
        &self.report
    }

    /// What the matter has exerted since the start on the colliders that ask for it, as of the newest report that has
    /// arrived. It comes with the reports: impulses add up over the steps between two of them, so that none is lost.
    pub fn loads(&self) -> &Loads {
        &self.loads
    }

    /// What was in each of the world's sensors at the end of the step of the newest report that has arrived.
    pub fn sensors(&self) -> &[Reading] {
        &self.sensors
    }

    /// The particles, for drawing on the device without a copy.
    pub fn particle_buffers(&self) -> ParticleBuffers<'_> {
        ParticleBuffers {
            position: self.buffers.get(Slot::Position),
            displacement: self.buffers.get(Slot::Displacement),
            gradient: self.buffers.get(Slot::Gradient),
            deformation: self.sizes.features.deforms().then(|| self.buffers.get(Slot::Deformation)),
            count: self.sizes.particles,
        }
    }

    /// The conversion between the buffers' cells and metres.
    pub fn units(&self) -> Units {
        self.timeline.units
    }

    /// Where the world's colliders are after the steps recorded so far.
    pub fn poses(&self) -> &[Pose] {
        &self.timeline.now().poses
    }

    /// Simulated time after the steps recorded so far, s.
    pub fn time(&self) -> f64 {
        self.timeline.now().time
    }

    /// Steps recorded so far that were or will be taken.
    pub fn step(&self) -> u64 {
        self.timeline.now().step
    }

    /// Length of the steps to come, s.
    pub fn dt(&self) -> f64 {
        self.timeline.dt
    }

    /// Length of the newest recorded step, s: a particle's displacement divided by it is its velocity.
    pub fn last_dt(&self) -> f64 {
        self.timeline.last_dt()
    }

    /// Gravity in the steps to come, m/s².
    pub fn gravity(&self) -> DVec3 {
        self.timeline.gravity
    }

    /// Bytes of the solver's buffers.
    pub fn memory(&self) -> Memory {
        let mut memory = self.buffers.memory();
        memory.other += self.readback.bytes();
        memory
    }

    #[cfg(feature = "headless")]
    pub(crate) fn set_timeline(&mut self, timeline: Timeline) {
        self.timeline = timeline;
    }

    #[cfg(feature = "headless")]
    pub(crate) fn buffer(&self, slot: Slot) -> &wgpu::Buffer {
        self.buffers.get(slot)
    }

    pub(crate) fn write(&self, slot: Slot, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.queue.write_buffer(self.buffers.get(slot), 0, bytes);
        }
    }

    #[cfg(feature = "headless")]
    pub(crate) fn timeline(&self) -> &Timeline {
        &self.timeline
    }

    #[cfg(feature = "headless")]
    pub(crate) fn steps_in_flight(&self) -> u32 {
        self.options.steps_in_flight
    }

    #[cfg(feature = "headless")]
    pub(crate) fn all_finished(&self) -> bool {
        self.flight.unfinished() == 0 && !self.flight.is_full()
    }
}

/// A 64-bit count since the start with the lower half `low`; `near` is the same count at another time, not long before
/// or after.
fn extended(near: u64, low: u32) -> u64 {
    let apart = low.wrapping_sub(near as u32) as i32;
    near.wrapping_add_signed(apart.into())
}

pub(crate) fn begin<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
) -> wgpu::ComputePass<'e> {
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("pbmpm step"), timestamp_writes })
}
