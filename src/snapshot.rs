//! The whole state of a solver, to be kept and resumed: in memory here, in files with the feature `snapshot`.

#[cfg(feature = "snapshot")]
mod file;

use crate::cpu::gradient::stored_material;
use crate::cpu::particle_out;
use crate::cpu::state::VACANT;
use crate::error::{Check, Error, Result};
use crate::features::Features;
use crate::load;
use crate::math::real::Real;
use crate::report::{Counts, Particle};
use crate::sensor;
use crate::stages::bin_sleep::ASLEEP;
use crate::timeline::clock::Clock;
use crate::units::Units;
use crate::world::World;
use std::sync::Arc;

/// The whole state of a solver between two steps: particles, clock, what hosts have asked for, counts. A solver of the
/// same world that restores it continues as the original would have, bit for bit. Solvers in single precision, on the
/// CPU and on devices, accept each other's snapshots.
///
/// With the feature `snapshot` it can be written to a file and read again.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    pub(crate) world: Arc<World>,
    pub(crate) clock: Clock,
    pub(crate) counts: Counts,
    /// Loads since the start, each as upper and lower half.
    pub(crate) loads: Vec<[(i64, u64); load::SUMS]>,
    pub(crate) sensed: Vec<[i64; sensor::SUMS]>,
    pub(crate) particles: Particles,
}

/// Why a snapshot is refused, or could not be taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SnapshotFault {
    /// The file does not begin as a snapshot does.
    #[error("is not a snapshot of pbmpm")]
    NotASnapshot,
    /// It is of another version of the format.
    #[error("has version {found} of the format, this is version {known}")]
    Version {
        /// The file's.
        found: u32,
        /// The one that is read and written.
        known: u32,
    },
    /// It is shorter or longer than it says.
    #[error("has {found} bytes of {expected}")]
    Length {
        /// Bytes that there are.
        found: u64,
        /// Bytes that there should be.
        expected: u64,
    },
    /// Its checksum differs.
    #[error("has been altered: its checksum is {found:08x}, it was written with {expected:08x}")]
    Altered {
        /// CRC-32 of what there is.
        found: u32,
        /// CRC-32 when it was written.
        expected: u32,
    },
    /// It was taken of another world.
    #[error("is of another world: the two differ in {field}")]
    World {
        /// The first part of the world that differs.
        field: String,
    },
    /// It was taken in another precision.
    #[error("is in {found} bits, this solver calculates in {needed}")]
    Precision {
        /// Bits of a number in it.
        found: u32,
        /// Bits of a number in the solver.
        needed: u32,
    },
    /// Its parts do not fit each other.
    #[error("contradicts itself: {0}")]
    Content(String),
    /// Steps before it were not taken, because the grid had no room, and will be taken again: request another snapshot.
    #[error("was not taken: steps before it have to be taken again")]
    Deferred,
    /// The encoder that it was recorded into was dropped: request another snapshot.
    #[error("was not taken: its encoder was dropped")]
    Dropped,
}

impl SnapshotFault {
    /// As an error of a snapshot that lies in no file.
    pub(crate) fn in_memory(self) -> Error {
        Error::Snapshot { path: "in memory".to_owned(), fault: self }
    }
}

/// Particles as bytes, little-endian: the slots of those stored; where matter may sleep, how long they have been at
/// rest; positions, displacements, gradients; where there are solids or viscous liquids that stick, deformation
/// gradients; and where the implicit scheme solves for more than pressures, the stress that they carry over.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Particles {
    /// Bytes of a number: 4 or 8.
    pub width: u32,
    /// Particles stored: as many slots, from the first on, have been used.
    pub stored: u32,
    /// Whole numbers of a particle.
    pub words: u32,
    /// Other numbers of a particle.
    pub lanes: u32,
    pub bytes: Vec<u8>,
}

/// Numbers of a particle: positions, displacements and gradients; deformation gradients; stress.
const LANES: [usize; 3] = [20, 12, 8];

/// Particles as they are taken out of bytes.
#[derive(Debug, Default)]
pub(crate) struct Unpacked<R> {
    pub id: Vec<u32>,
    pub rest: Vec<u32>,
    pub position: Vec<[R; 4]>,
    pub displacement: Vec<[R; 4]>,
    pub gradient: Vec<[[R; 4]; 3]>,
    pub deformation: Vec<[[R; 4]; 3]>,
    pub deviator: Vec<[[R; 4]; 2]>,
}

impl<R: Real> Unpacked<R> {
    /// As bytes. Empty parts are omitted; the others are equally long.
    pub fn pack(&self) -> Particles {
        let width = size_of::<R>();
        let lanes = LANES[0]
            + if self.deformation.is_empty() { 0 } else { LANES[1] }
            + if self.deviator.is_empty() { 0 } else { LANES[2] };
        let words = if self.rest.is_empty() { 1 } else { 2 };
        let mut bytes = Vec::with_capacity(self.id.len() * (4 * words + width * lanes));
        let whole = self.id.iter().chain(&self.rest);
        whole.for_each(|word| bytes.extend_from_slice(&word.to_le_bytes()));
        let mut put = |lanes: &[R]| {
            for x in lanes.iter().map(|x| x.f64()) {
                match width {
                    4 => bytes.extend_from_slice(&(x as f32).to_le_bytes()),
                    _ => bytes.extend_from_slice(&x.to_le_bytes()),
                }
            }
        };
        put(self.position.as_flattened());
        put(self.displacement.as_flattened());
        put(self.gradient.as_flattened().as_flattened());
        put(self.deformation.as_flattened().as_flattened());
        put(self.deviator.as_flattened().as_flattened());
        let stored = self.id.len() as u32;
        Particles { width: width as u32, stored, words: words as u32, lanes: lanes as u32, bytes }
    }
}

/// What a solver has room for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Room {
    pub capacity: u32,
    pub features: Features,
    pub materials: u32,
}

impl Particles {
    /// Bytes that these numbers of particles have.
    fn expected(&self) -> u64 {
        u64::from(self.stored) * (4 * u64::from(self.words) + u64::from(self.width) * u64::from(self.lanes))
    }

    /// The particles, for a solver over `R` with that room.
    pub fn unpack<R: Real>(&self, room: Room) -> Result<Unpacked<R>> {
        let width = size_of::<R>() as u32;
        if self.width != width {
            return Err(SnapshotFault::Precision { found: 8 * self.width, needed: 8 * width }.in_memory());
        }
        let deforms = if room.features.deforms() { LANES[1] } else { 0 };
        let tensors = if room.features.tensors() { LANES[2] } else { 0 };
        let lanes = LANES[0] + deforms + tensors;
        let count = self.stored as usize;
        let fail = |what: &str| Err(SnapshotFault::Content(what.to_owned()).in_memory());
        let words = if room.features.sleep { 2 } else { 1 };
        // Where nothing is stored, nothing tells of solids or of rest.
        let parts = [self.words, self.lanes] == [words, lanes as u32];
        if count > 0 && !parts || self.bytes.len() as u64 != self.expected() {
            return fail("the particles have other parts than those of this world");
        }
        if self.stored > room.capacity {
            return fail("there are more particles than the world has room for");
        }
        let (whole, mut rest) = self.bytes.split_at(4 * count * self.words as usize);
        let mut id: Vec<u32> = whole.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
        // Nothing is stored asleep; steps trust what is.
        let rests = id.split_off(count).into_iter().map(|rest| rest & !ASLEEP).collect();
        let mut seen = vec![false; count];
        for &id in &id {
            match seen.get_mut(id as usize) {
                Some(seen @ false) => *seen = true,
                _ => return fail("a slot is stored twice or not at all"),
            }
        }
        let mut take = |lanes: usize| -> Vec<R> {
            let (part, after) = rest.split_at(lanes * count * width as usize);
            rest = after;
            match width {
                4 => part.as_chunks().0.iter().map(|b| R::of(f32::from_le_bytes(*b).into())).collect(),
                _ => part.as_chunks().0.iter().map(|b| R::of(f64::from_le_bytes(*b))).collect(),
            }
        };
        let fours = |lanes: Vec<R>| lanes.as_chunks::<4>().0.to_vec();
        let columns = |lanes: Vec<R>| lanes.as_chunks::<4>().0.as_chunks::<3>().0.to_vec();
        let position = fours(take(4));
        let displacement = fours(take(4));
        let gradient = columns(take(12));
        let deformation = columns(take(deforms));
        let deviator = fours(take(tensors)).as_chunks::<2>().0.to_vec();
        // One whose material is no finite number is quarantined, by now or as the next step begins.
        let unknown = |material: R| material.finite() && !(0.0..f64::from(room.materials)).contains(&material.f64());
        if position
            .iter()
            .zip(&gradient)
            .any(|(x, d)| x[3] != R::of(VACANT) && x[3].finite() && unknown(stored_material(d)))
        {
            return fail("a particle is of a material that the world does not have");
        }
        // The next step begins by taking out particles whose other arrays are not finite; no step checks these two.
        let finite = |lanes: &[[R; 4]]| lanes.as_flattened().iter().all(|x| x.finite());
        let strained = |i: usize| {
            deformation.get(i).is_none_or(|f| finite(f)) && deviator.get(i).is_none_or(|stress| finite(stress))
        };
        if position.iter().enumerate().any(|(i, x)| x[3] > R::of(0.0) && !strained(i)) {
            return fail("a particle's deformation or stress is not finite");
        }
        Ok(Unpacked { id, rest: rests, position, displacement, gradient, deformation, deviator })
    }
}

impl Snapshot {
    /// Steps taken before it.
    pub fn step(&self) -> u64 {
        self.clock.step
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.clock.time
    }

    /// The particles in the order of their slots, as [`Simulate::particles`](crate::Simulate::particles) gives them, up
    /// to the last slot that was ever used. This is how a host of a [`GpuSolver`](crate::GpuSolver) reads them without
    /// waiting.
    ///
    /// # Errors
    /// [`Error::Snapshot`] if its particles are not those of its world.
    pub fn particles(&self) -> Result<Vec<Particle>> {
        match self.particles.width {
            8 => self.particles_of::<f64>(),
            _ => self.particles_of::<f32>(),
        }
    }

    fn particles_of<R: Real>(&self) -> Result<Vec<Particle>> {
        let (world, units) = (&self.world, Units::new(&self.world));
        let materials = world.materials.len() as u32;
        let Unpacked { id, position, displacement, gradient, .. } =
            self.particles.unpack::<R>(Room { capacity: u32::MAX, features: Features::of(world), materials })?;
        let f64s = |v: [R; 4]| v.map(Real::f64);
        let mut particles: Vec<_> = (0..id.len())
            .map(|i| {
                let gradient = gradient[i].map(f64s);
                (id[i], particle_out(&units, self.clock.last_dt(), f64s(position[i]), f64s(displacement[i]), gradient))
            })
            .collect();
        particles.sort_unstable_by_key(|(id, _)| *id);
        Ok(particles.into_iter().map(|(_, particle)| particle).collect())
    }

    /// Its size in bytes.
    pub fn bytes(&self) -> u64 {
        (size_of::<Self>() + self.particles.bytes.len()) as u64
    }

    /// Fails unless it can be of a solver with these numbers of loads and sensors, and slots for `capacity` particles.
    pub(crate) fn check_counts(&self, loads: usize, sensors: usize, capacity: u32) -> Result<()> {
        if self.loads.len() != loads || self.sensed.len() != sensors {
            return Err(SnapshotFault::Content("other loads or sensors than the world's".to_owned()).in_memory());
        }
        if !self.counts.can_be() {
            return Err(SnapshotFault::Content("numbers that no run reaches".to_owned()).in_memory());
        }
        // Each occupied block holds a particle, and its tile reaches eight blocks.
        let Counts { occupied, active, .. } = self.counts;
        if occupied > capacity || u64::from(active) > 8 * u64::from(occupied) {
            return Err(SnapshotFault::Content("more blocks than its particles touch".to_owned()).in_memory());
        }
        Ok(())
    }

    /// Fails unless it is of this world. Name and camera may differ.
    pub(crate) fn check_world(&self, world: &World) -> Result<()> {
        let (a, b) = (&*self.world, world);
        if std::ptr::eq(a, b) {
            return Ok(());
        }
        let same = [
            ("domain", a.domain == b.domain),
            ("gravity", a.gravity == b.gravity),
            ("materials", a.materials == b.materials),
            ("spawns", a.spawns == b.spawns),
            ("colliders", a.colliders == b.colliders),
            ("emitters", a.emitters == b.emitters),
            ("drains", a.drains == b.drains),
            ("tools", a.tools == b.tools),
            ("sensors", a.sensors == b.sensors),
            ("settings", a.settings == b.settings),
        ];
        match same.into_iter().find(|(_, same)| !same) {
            None => Ok(()),
            Some((field, _)) => Err(SnapshotFault::World { field: field.to_owned() }.in_memory()),
        }
    }
}

/// Fails unless every particle that takes part lies where a step may leave it.
pub(crate) fn check_inside<R: Real>(position: &[[R; 4]], hi: glam::DVec3) -> Result<()> {
    for x in position.iter().filter(|x| x[3] > R::of(0.0)) {
        let inside = (0..3).all(|a| !x[a].finite() || (x[a].f64() >= 1.0 && x[a].f64() <= hi[a] + 1.0));
        Check { path: "snapshot.particles" }.that(inside, "position", x, "inside the domain")?;
    }
    Ok(())
}

/// The halves of a sum of 128 bits, and back.
pub(crate) fn halves(sum: i128) -> (i64, u64) {
    ((sum >> 64) as i64, sum as u64)
}

pub(crate) fn whole((high, low): (i64, u64)) -> i128 {
    (i128::from(high) << 64) | i128::from(low)
}
