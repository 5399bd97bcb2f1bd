//! What the matter exerts on bodies.
//!
//! Contact changes the momentum of nodes and particles; what it takes from them is what the body receives. Each such
//! change is rounded to a whole number of units and summed as a 64-bit integer that wraps, so that sums do not depend
//! on order. A [`Ledger`] takes the differences between readings and adds them up in 128 bits.

use crate::collider::Collider;
use crate::units::Units;
use glam::DVec3;
use std::sync::atomic::{AtomicU64, Ordering};

/// Units per unit of momentum (the mass of a cell of the densest material at rest, times one cell per step of the
/// length at the start), and per unit of angular momentum (that times one cell). Between two readings a sum may change
/// by ±2³² of these.
pub(crate) const SCALE: f64 = (1u64 << 31) as f64;
/// Not a place of a load: that of the body is not measured.
pub(crate) const NONE: u32 = u32::MAX;
/// Sums per load: impulse, angular impulse.
pub(crate) const SUMS: usize = 6;

/// The sums of one load as the stages add to them.
pub(crate) type Running = [AtomicU64; SUMS];

/// What the matter has exerted on a collider, summed over the steps since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Load {
    /// Force times time, N s.
    pub impulse: DVec3,
    /// Torque about the collider's position times time, N m s. The position is that at the start of each step.
    pub angular_impulse: DVec3,
}

/// What was exerted between an earlier reading, which is subtracted, and this one.
impl std::ops::Sub for Load {
    type Output = Load;

    fn sub(self, earlier: Load) -> Load {
        Load {
            impulse: self.impulse - earlier.impulse,
            angular_impulse: self.angular_impulse - earlier.angular_impulse,
        }
    }
}

/// A mean over some steps of what the matter exerted on a collider.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct MeanLoad {
    /// N
    pub force: DVec3,
    /// About the collider's position, N m.
    pub torque: DVec3,
}

/// The loads of a world's colliders after some step. Sums since the start rather than forces, so that nothing is lost
/// however seldom they are read: two readings give the mean between them.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Loads {
    /// Steps taken so far.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    loads: Vec<Option<Load>>,
}

impl Loads {
    /// The load of the collider with this index; `None` where it is not measured ([`Collider::measure`]).
    pub fn of(&self, collider: usize) -> Option<Load> {
        self.loads.get(collider).copied().flatten()
    }

    /// The mean force and torque on a collider since an earlier reading; `None` where they are not measured, and where
    /// no time has passed.
    pub fn mean_since(&self, earlier: &Loads, collider: usize) -> Option<MeanLoad> {
        let exerted = self.of(collider)? - earlier.of(collider)?;
        let time = self.time - earlier.time;
        (time > 0.0).then(|| MeanLoad { force: exerted.impulse / time, torque: exerted.angular_impulse / time })
    }
}

/// Adds up readings of the running sums.
#[derive(Debug, Clone)]
pub(crate) struct Ledger {
    /// For each collider the place of its load.
    places: Vec<Option<usize>>,
    /// N s per unit of an impulse.
    impulse_unit: f64,
    /// A unit of an angular impulse is a cell times a unit of an impulse.
    units: Units,
    read: Vec<[u64; SUMS]>,
    sums: Vec<[i128; SUMS]>,
}

impl Ledger {
    /// For steps whose length at the start is `dt`.
    pub fn new(colliders: &[Collider], units: &Units, dt: f64) -> Self {
        let places: Vec<_> = places(colliders).map(|place| (place != NONE).then_some(place as usize)).collect();
        let count = places.iter().flatten().count();
        Ledger {
            places,
            impulse_unit: units.impulse_out(1.0, dt) / SCALE,
            units: *units,
            read: vec![[0; SUMS]; count],
            sums: vec![[0; SUMS]; count],
        }
    }

    /// Takes in a reading of all sums.
    pub fn take(&mut self, now: impl Iterator<Item = [u64; SUMS]>) {
        for ((read, sums), now) in self.read.iter_mut().zip(&mut self.sums).zip(now) {
            for ((read, sum), now) in read.iter_mut().zip(sums).zip(now) {
                *sum = sum.saturating_add((now.wrapping_sub(*read) as i64).into());
                *read = now;
            }
        }
    }

    /// The sums since the start.
    pub fn sums(&self) -> &[[i128; SUMS]] {
        &self.sums
    }

    /// Continues from these sums, with running sums at zero.
    pub fn take_up(&mut self, sums: Vec<[i128; SUMS]>) {
        self.read.fill([0; SUMS]);
        self.sums = sums;
    }

    /// The loads after `step` steps, at `time`.
    pub fn loads(&self, step: u64, time: f64) -> Loads {
        let load = |place: usize| {
            let sums = self.sums[place].map(|sum| sum as f64 * self.impulse_unit);
            let [impulse, angular] = [0, 3].map(|first| DVec3::from_slice(&sums[first..]));
            Load { impulse, angular_impulse: self.units.moment_out(angular) }
        };
        Loads { step, time, loads: self.places.iter().map(|place| place.map(load)).collect() }
    }
}

/// For each collider the place of its load, or [`NONE`].
pub(crate) fn places(colliders: &[Collider]) -> impl Iterator<Item = u32> {
    let mut next = 0;
    colliders.iter().map(move |collider| {
        if !collider.measure {
            return NONE;
        }
        next += 1;
        next - 1
    })
}

/// Sums at zero for each load of these colliders.
pub(crate) fn running(colliders: &[Collider]) -> Vec<Running> {
    colliders.iter().filter(|c| c.measure).map(|_| Running::default()).collect()
}

/// A reading of running sums.
pub(crate) fn reading(running: &[Running]) -> impl Iterator<Item = [u64; SUMS]> {
    running.iter().map(|sums| std::array::from_fn(|i| sums[i].load(Ordering::Relaxed)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;
    use crate::world::World;

    #[test]
    fn sums_may_wrap_between_readings() {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.1);
        let body = Collider::new(Shape::HalfSpace, DVec3::ZERO);
        world.colliders = vec![body.clone(), Collider { measure: true, ..body.clone() }, body];
        world.colliders.push(Collider { measure: true, ..world.colliders[0].clone() });
        let mut ledger = Ledger::new(&world.colliders, &Units::new(&world), 0.01);
        let unit = 0.1f64.powi(3) * 0.1 / 0.01 / SCALE;
        let step = 1u64 << 62;
        let mut now = 0u64;
        for _ in 0..9 {
            now = now.wrapping_sub(step);
            ledger.take([[0; SUMS], [0, now, 0, 0, 0, now]].into_iter());
        }
        let loads = ledger.loads(9, 0.5);
        assert_eq!((loads.of(0), loads.of(1), loads.of(2), loads.of(4)), (None, Some(Load::default()), None, None));
        let load = loads.of(3).unwrap();
        let expected = -9.0 * step as f64 * unit;
        assert!((load.impulse / expected).distance(DVec3::Y) < 1e-12);
        assert!((load.angular_impulse / (0.1 * expected)).distance(DVec3::Z) < 1e-12);
        let mean =
            loads.mean_since(&Ledger::new(&world.colliders, &Units::new(&world), 0.01).loads(0, 0.0), 3).unwrap();
        assert_eq!(mean.force, load.impulse / 0.5);
        assert_eq!(loads.mean_since(&loads, 3), None);
    }
}
