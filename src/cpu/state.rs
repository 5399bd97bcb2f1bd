//! What the CPU path holds: the same slots as the GPU's buffers, in a number type of choice.

use super::blocks::{BlockPressure, Coupling};
use super::constants::{CandidateConstants, ColliderConstants, Constants, MaterialConstants, ToolConstants};
use super::gradient::{Gradient, undeformed};
use super::solve::{Held, Search, Shear, Solve};
use crate::bins::{NODES, NONE, TILE_NODES, hash};
use crate::features::Features;
use crate::load::Running;
use crate::math::real::Real;
use crate::sensor;
use crate::stages::bin_insert::Run;
use crate::stages::bin_sleep::{AWAKE, REACHED};
use crate::stages::drag;
use crate::stages::gap::Noted;
use crate::timeline::disturbance::Disturbance;
use std::sync::atomic::{AtomicI64, AtomicU32, AtomicU64, Ordering};

/// Makes `items` as long as asked, with at most a quarter of room in reserve: doubling would waste megabytes.
pub fn fit<T: Clone>(items: &mut Vec<T>, length: usize, fill: T) {
    if length > items.capacity() {
        items.reserve_exact(length + length / 4 - items.len());
    }
    items.resize(length, fill);
}

/// A block of the grid; the occupied ones come first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Block {
    pub key: u32,
    pub start: u32,
    pub count: u32,
    /// Whether its particles sleep: one of [`bin_sleep`](crate::stages::bin_sleep)'s tags.
    pub sleep: u32,
    /// A bit for each of the eight tiles that reach it whose particles sleep beside others that are awake, and
    /// [`REACHED`] where any tile adds mass.
    pub tiles: u32,
}

impl Block {
    /// One without particles, whose range begins at `start`.
    pub fn new(key: u32, start: u32) -> Self {
        Block { key, start, count: 0, sleep: AWAKE, tiles: REACHED }
    }
}

/// An open-addressing table from block keys to block indices.
#[derive(Debug, Default)]
pub struct Table {
    entries: Vec<(u32, u32)>,
    used: usize,
}

impl Table {
    pub fn clear(&mut self) {
        if self.entries.is_empty() {
            self.entries.resize(64, (NONE, NONE));
        }
        if self.used > 0 {
            self.entries.fill((NONE, NONE));
            self.used = 0;
        }
    }

    /// The block of `key`; where there is none, `new` becomes it.
    pub fn find_or_insert(&mut self, key: u32, new: u32) -> u32 {
        if (self.used + 1) * 2 > self.entries.len() {
            let old = std::mem::take(&mut self.entries);
            self.entries.resize(old.len() * 2, (NONE, NONE));
            for (key, block) in old.into_iter().filter(|e| e.0 != NONE) {
                let slot = self.slot(key);
                self.entries[slot] = (key, block);
            }
        }
        let slot = self.slot(key);
        if self.entries[slot].0 == NONE {
            self.entries[slot] = (key, new);
            self.used += 1;
        }
        self.entries[slot].1
    }

    /// The block of `key`, or `NONE`.
    pub fn find(&self, key: u32) -> u32 {
        self.entries[self.slot(key)].1
    }

    fn slot(&self, key: u32) -> usize {
        let mask = self.entries.len() - 1;
        let mut slot = hash(key) as usize & mask;
        while self.entries[slot].0 != key && self.entries[slot].0 != NONE {
            slot = (slot + 1) & mask;
        }
        slot
    }

    pub fn bytes(&self) -> u64 {
        (self.entries.capacity() * size_of::<(u32, u32)>()) as u64
    }
}

/// Counts that all cores add to; sums of integers, so that order does not matter.
#[derive(Debug, Default)]
pub struct Tally {
    pub saturated_nodes: AtomicU64,
    pub speed_clamped: AtomicU64,
    pub gradient_clamped: AtomicU64,
    pub strain_clamped: AtomicU64,
    pub escaped: AtomicU64,
    pub quarantined: AtomicU64,
    pub drained: AtomicU64,
    pub emitted: u64,
    pub withheld: u64,
    pub refused: u64,
    /// Iterations of solves, and solves that ended because their iterations ran out.
    pub iterations: u64,
    pub capped: u64,
    /// The square of the largest relative change of the velocities that a solve left over
    /// ([`Solved::change`](crate::Solved::change)).
    pub worst_change: f64,
}

impl Tally {
    pub fn add(counter: &AtomicU64, n: u32) {
        if n > 0 {
            counter.fetch_add(n.into(), Ordering::Relaxed);
        }
    }
}

/// Everything the stages read and write.
#[derive(Debug)]
pub struct CpuState<R: Real> {
    pub constants: Constants<R>,
    pub materials: Vec<MaterialConstants<R>>,
    /// The same numbers in every lane: contact takes four points at a time.
    pub colliders: Vec<ColliderConstants<R::V>>,
    /// What is deleted at the end of the step; the same numbers in every lane.
    pub drains: Vec<ColliderConstants<R::V>>,
    /// The same of the sensors.
    pub sensors: Vec<ColliderConstants<R::V>>,
    /// Sums of each sensor.
    pub sensed: Vec<[AtomicI64; sensor::SUMS]>,
    pub tools: Vec<ToolConstants<R>>,
    pub candidates: Vec<CandidateConstants<R>>,
    /// For each candidate how many of its group of 64 may appear, up to and including it.
    pub accepted: Vec<u32>,
    /// Free slots and where they are stored, in the order of the slots. Slots beyond those stored are free as well.
    pub vacant: Vec<(u32, u32)>,
    /// How many slots there are.
    pub capacity: u32,
    /// Position in cells; the fourth lane is the volume ratio, or, where it is not positive, the particle's fate.
    pub position: Vec<[R; 4]>,
    /// Displacement of the last step in cells; the fourth lane is the volume fraction measured on the grid; until
    /// `integrate`, with the sign that `stages::believed` gives it.
    pub displacement: Vec<[R; 4]>,
    pub gradient: Vec<Gradient<R>>,
    /// Square of the largest displacement of the last step.
    pub largest_square: R,
    /// Deformation gradient by columns, in worlds with solids or with viscous liquids that stick; the first column's
    /// fourth lane is sand's slack; the fourth lanes of other solids and of such liquids are their
    /// [`correction`](crate::stages::correction).
    pub deformation: Vec<Gradient<R>>,
    /// The slot of each stored particle. All slots that were ever used are stored, in an order of their own.
    pub id: Vec<u32>,
    /// Runs of consecutive particles of the same block, by stretches of particles.
    pub runs: Vec<Vec<Run>>,
    pub order: Vec<u32>,
    /// How long each particle has been at rest, µs, where matter may sleep; with the bit
    /// [`ASLEEP`](crate::stages::bin_sleep::ASLEEP).
    pub rest: Vec<u32>,
    /// For each occupied block whether some of its particles have not been at rest for long enough.
    pub restless: Vec<bool>,
    /// For each occupied block whether it is awake and why: bits of [`bin_wake`](crate::stages::bin_wake).
    pub awake: Vec<AtomicU32>,
    /// Where nothing sleeps in the step.
    pub disturbances: Vec<Disturbance>,
    /// Particles that sleep.
    pub asleep: u32,
    pub table: Table,
    pub blocks: Vec<Block>,
    pub occupied: usize,
    /// For each occupied block the eight blocks of its tile.
    pub links: Vec<[u32; 8]>,
    /// For each block the eight occupied blocks whose tiles reach it, or `NONE`.
    pub sources: Vec<[u32; 8]>,
    /// For each block a bit per collider that can be touched from it, and whether later words have any.
    pub cull: Vec<u32>,
    pub cull_words: usize,
    /// For each block what is recorded of the solids at its nodes beside bodies; empty where the stage `gap` is not
    /// planned.
    pub gaps: Vec<Noted>,
    pub tiles: Vec<[[R::Sum; 4]; TILE_NODES]>,
    /// Sums of each node, then displacement and mass in their place.
    pub grid: Vec<[[R::Sum; 4]; NODES]>,
    /// The largest displacement that a particle scatters to a node; `None` in the published scheme.
    pub largest_motion: Option<R>,
    pub scratch: Vec<[R; 4]>,
    pub scratch_id: Vec<u32>,
    pub tally: Tally,
    /// What the solve keeps for each particle.
    pub search: Vec<Search<R>>,
    /// What it keeps besides, where it solves for more than pressures.
    pub shear: Vec<Shear<R>>,
    /// Deviator of the stress that a particle carries over from the step before, there too: diagonal, and yz, xz, xy.
    pub deviator: Vec<[[R; 4]; 2]>,
    pub force: Vec<[[R::Sum; 4]; NODES]>,
    pub field: Vec<[[R; 4]; NODES]>,
    pub held: Vec<[Held<R>; NODES]>,
    pub solve: Solve<R>,
    /// For each occupied block what a unit of pressure of its liquids pushes at the nodes of its tile. This and the
    /// next two exist only where the liquids of a block share a pressure.
    pub block_tiles: Vec<[[R::Sum; 4]; TILE_NODES]>,
    /// For each occupied block the pressure that its liquids share.
    pub block_pressures: Vec<BlockPressure<R>>,
    /// For each block of nodes how the pressures of the blocks whose tiles reach it act on each other there.
    pub couplings: Vec<Coupling<R>>,
    /// Sums of the loads that are measured.
    pub loads: Vec<Running>,
    /// What the world asks of its steps.
    pub features: Features,
}

/// Value of a position's fourth lane where there is no particle.
pub const VACANT: f64 = 0.0;
/// Value of a position's fourth lane for a particle deleted at an open side.
pub const ESCAPED: f64 = -1.0;
/// Value of a position's fourth lane for a quarantined particle.
pub const QUARANTINED: f64 = -2.0;
/// Value of a position's fourth lane for a particle deleted by a drain.
pub const DRAINED: f64 = -3.0;

impl<R: Real> CpuState<R> {
    /// The viscosity with which bodies drag along the matter before them, where liquids stick to them.
    pub fn wall_viscosity(&self) -> Option<R> {
        self.features.sticks.then(|| drag::wall_viscosity(&self.materials, &self.constants))
    }

    /// Stores a particle that has not moved yet, in a slot that was never used.
    pub fn push(&mut self, (position, displacement, gradient): ([R; 4], [R; 4], Gradient<R>)) {
        self.id.push(self.id.len() as u32);
        self.position.push(position);
        self.displacement.push(displacement);
        self.gradient.push(gradient);
        if self.features.deforms() {
            self.deformation.push(undeformed());
        }
    }

    /// Makes room for so many more particles, with no more than a quarter in reserve.
    pub fn reserve(&mut self, more: usize) {
        fn room<T>(v: &mut Vec<T>, more: usize) {
            if v.capacity() - v.len() < more {
                v.reserve_exact(more + v.len() / 4);
            }
        }
        room(&mut self.id, more);
        room(&mut self.position, more);
        room(&mut self.displacement, more);
        room(&mut self.gradient, more);
        room(&mut self.deformation, if self.features.deforms() { more } else { 0 });
    }

    /// Bytes of particles, grid, bins, and of the rest.
    pub fn bytes(&self) -> [u64; 4] {
        fn of<T>(v: &Vec<T>) -> u64 {
            (v.capacity() * size_of::<T>()) as u64
        }
        let particles = of(&self.position)
            + of(&self.displacement)
            + of(&self.gradient)
            + of(&self.deformation)
            + of(&self.search)
            + of(&self.shear)
            + of(&self.deviator)
            + of(&self.id)
            + of(&self.rest)
            + of(&self.scratch)
            + of(&self.scratch_id);
        let grid = of(&self.tiles)
            + of(&self.grid)
            + of(&self.field)
            + of(&self.held)
            + of(&self.force)
            + of(&self.block_tiles)
            + of(&self.block_pressures)
            + of(&self.couplings);
        let bins = of(&self.order)
            + of(&self.runs)
            + self.runs.iter().map(of).sum::<u64>()
            + self.table.bytes()
            + of(&self.blocks)
            + of(&self.links)
            + of(&self.sources)
            + of(&self.cull)
            + of(&self.gaps)
            + of(&self.vacant)
            + of(&self.restless)
            + of(&self.awake);
        let other = of(&self.materials)
            + of(&self.colliders)
            + of(&self.drains)
            + of(&self.sensors)
            + of(&self.sensed)
            + of(&self.tools)
            + of(&self.candidates)
            + of(&self.accepted)
            + of(&self.disturbances)
            + of(&self.loads);
        [particles, grid, bins, other]
    }
}
