//! The CPU path's state as a snapshot, and back.

use super::CpuSolver;
use super::state::{Block, Tally};
use crate::bins::NONE;
use crate::cpu::solve::Solve;
use crate::error::Result;
use crate::load;
use crate::math::real::Real;
use crate::report::{Counts, Faults, share};
use crate::snapshot::{Room, Snapshot, Unpacked, check_inside, halves, whole};
use crate::stages::bin_sleep::ASLEEP;
use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

impl<R: Real> CpuSolver<R> {
    fn room(&self) -> Room {
        Room {
            capacity: self.state.capacity,
            features: self.state.features,
            materials: self.state.materials.len() as u32,
        }
    }

    pub(super) fn counts(&self) -> Counts {
        let (s, t) = (&self.state, &self.state.tally);
        let count = |c: &AtomicU64| c.load(Ordering::Relaxed);
        Counts {
            spawned: self.spawned,
            emitted: t.emitted,
            drained: count(&t.drained),
            withheld: t.withheld,
            faults: Faults {
                saturated_nodes: count(&t.saturated_nodes),
                speed_clamped: count(&t.speed_clamped),
                gradient_clamped: count(&t.gradient_clamped),
                strain_clamped: count(&t.strain_clamped),
                escaped: count(&t.escaped),
                quarantined: count(&t.quarantined),
                refused: t.refused,
                steps_deferred: self.steps_deferred,
            },
            iterations: t.iterations,
            capped: t.capped,
            worst_change: t.worst_change,
            occupied: s.occupied as u32,
            active: s.blocks.len() as u32,
            asleep: s.asleep,
            largest_square: s.largest_square.f64(),
            solved: (s.solve.count, share(s.solve.change, s.solve.motion).f64()),
        }
    }

    pub(super) fn saved(&self) -> Snapshot {
        let s = &self.state;
        let (tensors, sleep) = (self.state.features.tensors(), self.state.features.sleep);
        // Particles that have appeared since the last step have none of these yet.
        let mut deviator = s.deviator.clone();
        deviator.resize(if tensors { s.id.len() } else { 0 }, Default::default());
        let mut rest: Vec<u32> = s.rest.iter().map(|rest| rest & !ASLEEP).collect();
        rest.resize(if sleep { s.id.len() } else { 0 }, 0);
        let particles = Unpacked {
            id: s.id.clone(),
            rest,
            position: s.position.clone(),
            displacement: s.displacement.clone(),
            gradient: s.gradient.clone(),
            deformation: s.deformation.clone(),
            deviator,
        };
        Snapshot {
            world: self.timeline.world.clone(),
            clock: self.timeline.clock(),
            counts: self.counts(),
            loads: self.ledger.sums().iter().map(|sums| sums.map(halves)).collect(),
            sensed: s.sensed.iter().map(|sums| std::array::from_fn(|i| sums[i].load(Ordering::Relaxed))).collect(),
            particles: particles.pack(),
        }
    }

    pub(super) fn take_up(&mut self, snapshot: &Snapshot) -> Result<()> {
        snapshot.check_world(&self.timeline.world)?;
        let particles = snapshot.particles.unpack::<R>(self.room())?;
        let timeline = self.timeline.resumed(&snapshot.clock)?;
        check_inside(&particles.position, timeline.hi())?;
        snapshot.check_counts(self.state.loads.len(), self.state.sensed.len(), self.state.capacity)?;
        self.timeline = timeline;
        let c = &snapshot.counts;
        self.spawned = c.spawned;
        self.steps_deferred = c.faults.steps_deferred;
        self.ledger.take_up(snapshot.loads.iter().map(|sums| sums.map(whole)).collect());
        let s = &mut self.state;
        s.loads = load::running(&self.timeline.world.colliders);
        s.sensed = snapshot.sensed.iter().map(|sums| sums.map(AtomicI64::new)).collect();
        s.tally = Tally {
            saturated_nodes: c.faults.saturated_nodes.into(),
            speed_clamped: c.faults.speed_clamped.into(),
            gradient_clamped: c.faults.gradient_clamped.into(),
            strain_clamped: c.faults.strain_clamped.into(),
            escaped: c.faults.escaped.into(),
            quarantined: c.faults.quarantined.into(),
            drained: c.drained.into(),
            emitted: c.emitted,
            withheld: c.withheld,
            refused: c.faults.refused,
            iterations: c.iterations,
            capped: c.capped,
            worst_change: c.worst_change,
        };
        s.largest_square = R::of(c.largest_square);
        let (count, change) = c.solved;
        s.solve = Solve { count, change: R::of(change), motion: R::of(1.0), ..Solve::default() };
        // The next step finds its blocks anew; of those of the last step only the number is reported.
        s.occupied = c.occupied as usize;
        s.asleep = c.asleep;
        s.blocks.clear();
        s.blocks.resize(c.active as usize, Block::new(NONE, 0));
        s.runs.clear();
        s.rest = particles.rest;
        (s.id, s.position, s.displacement) = (particles.id, particles.position, particles.displacement);
        (s.gradient, s.deformation, s.deviator) = (particles.gradient, particles.deformation, particles.deviator);
        Ok(())
    }
}
