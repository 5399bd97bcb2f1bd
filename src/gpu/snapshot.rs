//! The GPU path's state as a snapshot, without waiting, and back.

use super::contents::nothing_to_do;
use super::flight::Flight;
use super::layout::{Counters, Place, Sizes, StressSearch};
use super::readback::{CounterReadback, Mapping, Outcome, add_copies};
use super::requirements;
use super::slots::Slot;
use super::{GpuSolver, extended};
use crate::bins::NONE;
use crate::cpu::state::VACANT;
use crate::error::{Error, Result};
use crate::load::SUMS;
use crate::sensor;
use crate::snapshot::{Room, Snapshot, SnapshotFault, Unpacked, check_inside, halves, whole};
use crate::stages::bin_sleep::ASLEEP;
use crate::timeline::clock::Clock;
use bytemuck::Zeroable;

/// The slots that are read back.
const KEPT: [Slot; 8] = [
    Slot::Position,
    Slot::Displacement,
    Slot::Gradient,
    Slot::Deformation,
    Slot::Search,
    Slot::Bin,
    Slot::Counters,
    Slot::Sensed,
];

/// A snapshot on its way back to the host.
#[derive(Debug)]
pub(super) struct Pending {
    clock: Clock,
    /// Steps recorded before it.
    recorded: u64,
    /// Copies of the slots that are not empty.
    copies: Vec<(Slot, wgpu::Buffer, Mapping)>,
}

impl Pending {
    fn read<T: bytemuck::Pod>(&self, slot: Slot) -> Result<Vec<T>> {
        let Some((_, copy, _)) = self.copies.iter().find(|(of, ..)| *of == slot) else {
            return Ok(Vec::new());
        };
        let view = copy.get_mapped_range(..).map_err(|e| Error::Device(e.to_string()))?;
        let whole = view.len() / size_of::<T>() * size_of::<T>();
        Ok(bytemuck::pod_collect_to_vec(&view[..whole]))
    }
}

impl GpuSolver {
    fn room(&self) -> Room {
        let materials = self.timeline.world.materials.len() as u32;
        Room { capacity: self.sizes.particles, features: self.sizes.features, materials }
    }

    /// Records a copy of the whole state after the steps recorded so far, for [`poll_snapshot`](Self::poll_snapshot),
    /// in place of one that is still on its way. Allocates the memory for it.
    ///
    /// # Errors
    /// [`Error::Snapshot`] while the device takes no steps because the grid has no room for them: call
    /// [`encode_step`](Self::encode_step) until it has enlarged the grid. [`Error::StepsLost`] if recorded steps were
    /// not submitted, [`Error::Device`] if the device is lost.
    pub fn encode_snapshot(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<()> {
        self.learn()?;
        if self.flight.lost() > 0 {
            return Err(Error::StepsLost { lost: self.flight.lost() });
        }
        if self.flight.is_full() {
            return Err(SnapshotFault::Deferred.in_memory());
        }
        let mut copies = Vec::new();
        for slot in KEPT {
            let source = self.buffers.get(slot);
            // A search for pressures alone keeps nothing between steps; of the bins only the time at rest is kept.
            let kept = match slot {
                Slot::Search => self.sizes.features.tensors(),
                Slot::Bin => self.sizes.features.sleep,
                _ => true,
            };
            if source.size() == 0 || !kept {
                continue;
            }
            let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(&format!("pbmpm snapshot {}", slot.name())),
                size: source.size(),
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            encoder.copy_buffer_to_buffer(source, 0, &copy, 0, source.size());
            let mapping = Mapping::encode(encoder, &copy);
            copies.push((slot, copy, mapping));
        }
        self.pending = Some(Pending { clock: self.timeline.clock(), recorded: self.flight.recorded(), copies });
        Ok(())
    }

    /// The snapshot that [`encode_snapshot`](Self::encode_snapshot) recorded, once it has arrived.
    ///
    /// # Errors
    /// [`Error::Device`] if it could not be read back, [`Error::Snapshot`] if steps before it were not taken for lack
    /// of room and will be taken again, or if its encoder was dropped: record another. [`Error::StepsLost`] if it shows
    /// that recorded steps were not submitted.
    pub fn poll_snapshot(&mut self) -> Result<Option<Snapshot>> {
        let on_its_way = |p: &Pending| p.copies.iter().any(|(.., mapping)| mapping.outcome() == Outcome::Pending);
        let Some(pending) = self.pending.take_if(|p| !on_its_way(p)) else { return Ok(None) };
        let any = |outcome: Outcome| pending.copies.iter().any(|(.., mapping)| mapping.outcome() == outcome);
        if any(Outcome::Dropped) {
            return Err(SnapshotFault::Dropped.in_memory());
        }
        if any(Outcome::Failed) {
            return Err(Error::Device("the snapshot could not be mapped; the device may be lost".to_owned()));
        }
        let bytes: Vec<u8> = pending.read(Slot::Counters)?;
        let (counters, loads) = bytes.split_at(size_of::<Counters>());
        let c: Counters = bytemuck::pod_read_unaligned(counters);
        // The buffers of an encoder that a host has made invalid are mapped all the same.
        if c.present == 0 {
            return Err(SnapshotFault::Dropped.in_memory());
        }
        let step = extended(pending.clock.step, c.steps);
        if c.halted != 0 || step != pending.clock.step {
            let deferred = extended(self.report.faults.steps_deferred, c.steps_deferred);
            let missed = self.flight.missed(pending.recorded, step + deferred);
            return Err(if missed > 0 {
                Error::StepsLost { lost: missed }
            } else {
                SnapshotFault::Deferred.in_memory()
            });
        }
        let particles = self.stored(&pending)?;
        let mut running = vec![[0; SUMS]; self.sizes.loads as usize];
        add_copies(&mut running, &loads[..self.sizes.load_bytes() as usize], self.sizes.load_copies as usize);
        let mut ledger = self.ledger.clone();
        ledger.take(running.into_iter());
        let sensed: Vec<[i64; sensor::SUMS]> = pending.read(Slot::Sensed)?;
        let sensors = self.sizes.sensors as usize;
        let turn = c.steps.wrapping_sub(1) as usize & 1;
        Ok(Some(Snapshot {
            world: self.timeline.world.clone(),
            counts: self.counts(&c),
            loads: ledger.sums().iter().map(|sums| sums.map(halves)).collect(),
            sensed: sensed[turn * sensors..][..sensors].to_vec(),
            clock: pending.clock,
            particles: particles.pack(),
        }))
    }

    /// The particles up to the last slot that is not vacant.
    fn stored(&self, pending: &Pending) -> Result<Unpacked<f32>> {
        let mut particles = Unpacked::<f32> {
            position: pending.read(Slot::Position)?,
            displacement: pending.read(Slot::Displacement)?,
            gradient: pending.read(Slot::Gradient)?,
            deformation: pending.read(Slot::Deformation)?,
            rest: pending.read::<Place>(Slot::Bin)?.iter().map(|place| place.rest & !ASLEEP).collect(),
            ..Unpacked::default()
        };
        let search: Vec<StressSearch> = pending.read(Slot::Search)?;
        let lanes = |s: &StressSearch| {
            let ([a, b, c], [d, e, f]) = (s.shear.brought.diagonal, s.shear.brought.off);
            [[a, b, c, 0.0], [d, e, f, 0.0]]
        };
        particles.deviator = search.iter().map(lanes).collect();
        particles.position.truncate(self.sizes.particles as usize);
        let used = particles.position.iter().rposition(|x| x[3] != VACANT as f32).map_or(0, |last| last + 1);
        particles.id = (0..used as u32).collect();
        particles.rest.truncate(used);
        particles.position.truncate(used);
        particles.displacement.truncate(used);
        particles.gradient.truncate(used);
        particles.deformation.truncate(used);
        particles.deviator.truncate(used);
        Ok(particles)
    }

    /// Replaces the state by that of a snapshot, from which the next recorded step continues, with all that hosts set:
    /// tools, rates, step length, gravity, the motion of bodies, and what is to be added and removed. All recorded steps
    /// must have been submitted before. A snapshot or report still on its way is dropped. After an error nothing has
    /// changed.
    ///
    /// # Errors
    /// [`Error::Snapshot`] if it is of another world, in double precision, or contradicts itself; [`Error::Invalid`]
    /// where it holds what no host can have asked for; [`Error::Unsupported`] where what it has yet to add or remove
    /// needs larger buffers than the device has.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<()> {
        snapshot.check_world(&self.timeline.world)?;
        let particles = snapshot.particles.unpack::<f32>(self.room())?;
        let timeline = self.timeline.resumed(&snapshot.clock)?;
        check_inside(&particles.position, timeline.hi())?;
        let candidates = self.sizes.candidates.max(timeline.most_added() as u32);
        let asked = Sizes { candidates, ..self.sizes }.with_grids(&timeline.grids);
        requirements::check(&self.device.limits(), &asked)?;
        snapshot.check_counts(self.sizes.loads as usize, self.sizes.sensors as usize, self.sizes.particles)?;
        self.timeline = timeline;
        let c = &snapshot.counts;
        self.spawned = c.spawned as u32;
        self.write_particles(&particles);
        let counters = Counters {
            steps: snapshot.clock.step as u32,
            steps_deferred: c.faults.steps_deferred as u32,
            saturated_nodes: c.faults.saturated_nodes as u32,
            speed_clamped: c.faults.speed_clamped as u32,
            gradient_clamped: c.faults.gradient_clamped as u32,
            strain_clamped: c.faults.strain_clamped as u32,
            escaped: c.faults.escaped as u32,
            quarantined: c.faults.quarantined as u32,
            last_occupied: c.occupied,
            last_active: c.active,
            last_asleep: c.asleep,
            drained: c.drained as u32,
            emitted: c.emitted as u32,
            withheld: c.withheld as u32,
            refused: c.faults.refused as u32,
            last_count: c.solved.0,
            last_change: c.solved.1 as f32,
            last_motion: 1.0,
            last_largest_square: c.largest_square as f32,
            iterations: c.iterations as u32,
            capped: c.capped as u32,
            worst_change: c.worst_change as f32,
            present: 1,
            ..Counters::default()
        };
        let mut bytes = bytemuck::bytes_of(&counters).to_vec();
        bytes.resize(bytes.len() + self.sizes.load_bytes() as usize, 0);
        self.write(Slot::Counters, &bytes);
        self.forget_blocks();
        nothing_to_do(&self.queue, &self.buffers);
        if self.sizes.features.implicit() {
            self.write(Slot::Solve, bytemuck::bytes_of(&super::layout::Solve::zeroed()));
        }
        let mut sensed = vec![[0; sensor::SUMS]; 2 * snapshot.sensed.len()];
        let turn = counters.steps.wrapping_sub(1) as usize & 1;
        sensed[turn * snapshot.sensed.len()..][..snapshot.sensed.len()].copy_from_slice(&snapshot.sensed);
        if !sensed.is_empty() {
            self.write(Slot::Sensed, bytemuck::cast_slice(&sensed));
        }
        self.ledger.take_up(snapshot.loads.iter().map(|sums| sums.map(whole)).collect());
        self.loads = self.ledger.loads(snapshot.clock.step, snapshot.clock.time);
        let t = &self.timeline;
        self.sensors = snapshot.sensed.iter().map(|sums| sensor::reading(*sums, &t.units, t.first_dt)).collect();
        self.report = c.report(t, snapshot.clock.step, t.now());
        // Copies on their way back describe the past.
        self.readback = CounterReadback::new(&self.device, &self.queue, &self.sizes);
        self.pending = None;
        self.flight = Flight::after(snapshot.clock.step + c.faults.steps_deferred);
        self.fresh = true;
        Ok(())
    }

    /// Writes the particles into their slots, and empties the others.
    fn write_particles(&self, particles: &Unpacked<f32>) {
        fn slots<T: Copy>(id: &[u32], stored: &[T], capacity: u32, nothing: T) -> Vec<T> {
            let mut slots = vec![nothing; if stored.is_empty() { 0 } else { capacity as usize }];
            id.iter().zip(stored).for_each(|(id, particle)| slots[*id as usize] = *particle);
            slots
        }
        let (id, capacity) = (&particles.id, self.sizes.particles);
        // Where nothing was stored, the slots have to be emptied all the same.
        let empty = vec![[0f32; 4]; capacity as usize];
        let position = if id.is_empty() { empty } else { slots(id, &particles.position, capacity, [0.0; 4]) };
        self.write(Slot::Position, bytemuck::cast_slice(&position));
        self.write(Slot::Displacement, bytemuck::cast_slice(&slots(id, &particles.displacement, capacity, [0.0; 4])));
        let columns = [[0.0; 4]; 3];
        self.write(Slot::Gradient, bytemuck::cast_slice(&slots(id, &particles.gradient, capacity, columns)));
        self.write(Slot::Deformation, bytemuck::cast_slice(&slots(id, &particles.deformation, capacity, columns)));
        if self.sizes.features.sleep {
            let places: Vec<_> =
                particles.rest.iter().map(|rest| Place { entry: NONE, rank: 0, rest: *rest }).collect();
            let nowhere = Place { entry: NONE, rank: 0, rest: 0 };
            self.write(Slot::Bin, bytemuck::cast_slice(&slots(id, &places, capacity, nowhere)));
        }
        let search = particles.deviator.iter().map(|[d, o]| {
            let mut search = StressSearch::zeroed();
            search.shear.brought.diagonal.copy_from_slice(&d[..3]);
            search.shear.brought.off.copy_from_slice(&o[..3]);
            search
        });
        let search: Vec<_> = search.collect();
        self.write(Slot::Search, bytemuck::cast_slice(&slots(id, &search, capacity, StressSearch::zeroed())));
    }
}
