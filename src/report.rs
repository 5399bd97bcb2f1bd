//! What a solver reports about a run.

use crate::math::real::Real;
use crate::settings::Scheme;
use crate::timeline::{Moment, Timeline};

/// Irregularities inside steps that a user may want to remedy, counted since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(any(feature = "scene", feature = "snapshot"), derive(serde::Serialize))]
#[cfg_attr(feature = "snapshot", derive(serde::Deserialize))]
#[non_exhaustive]
pub struct Faults {
    /// Grid nodes, summed over iterations, whose mass reached the next power of two from
    /// [`Settings::max_fill`](crate::Settings::max_fill) on, in rest masses of a cell. Up to twice that power the sums
    /// are still right. Remedy: more iterations, a smaller step, or a larger `max_fill`.
    pub saturated_nodes: u64,
    /// Particles, summed over iterations, that were slowed to
    /// [`Settings::max_displacement`](crate::Settings::max_displacement) as they entered the grid. Nodes that
    /// gravity, tools or stresses make faster within a step are slowed without being counted. Remedy: a smaller step,
    /// or a larger bound.
    pub speed_clamped: u64,
    /// Particles, summed over iterations, whose displacement gradient was scaled down to a norm of 1.5 per step.
    /// Remedy: a smaller step.
    pub gradient_clamped: u64,
    /// Particles, summed over steps, whose strain was cut to what they can store: a liquid's volume ratio below 0.1, a
    /// solid's principal stretch outside 0.1 to 10. The excess is lost. Remedy: more iterations, a smaller step, or a
    /// stiffer material.
    pub strain_clamped: u64,
    /// Particles deleted because they crossed an open side of the domain.
    pub escaped: u64,
    /// Particles taken out, before they could affect others, because their state (the deformation gradient excepted)
    /// was not finite, or their volume ratio negative. They keep slot and state ([`Fate::Quarantined`]) until a host
    /// frees the slots ([`Simulate::release_quarantined`](crate::Simulate::release_quarantined)). Remedy: correct what
    /// wrote the state, which no step does by itself; if one seems to, use a smaller
    /// [`Settings::dt`](crate::Settings::dt) and report it.
    pub quarantined: u64,
    /// Particles that were not made because every slot was taken. Remedy: a larger
    /// [`Settings::capacity`](crate::Settings::capacity).
    pub refused: u64,
    /// Steps that were not taken because the grid had too few blocks; the solver grows and takes them again.
    pub steps_deferred: u64,
}

/// Iterations and remaining error of one solve of the [implicit scheme](crate::Scheme::Implicit).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Solved {
    /// Iterations taken, at most [`Settings::iterations`](crate::Settings::iterations).
    pub iterations: u32,
    /// Relative change of the grid's velocities (root mean square by mass) that the next iteration would have made,
    /// where the solve ended because that is at most [`Settings::tolerance`](crate::Settings::tolerance); where the
    /// iterations ran out, the change that the last one made.
    pub change: f64,
}

impl Solved {
    /// From the iterations and the square of the change.
    fn new((iterations, change): (u32, f64)) -> Self {
        Solved { iterations, change: change.sqrt() }
    }
}

/// The square of a change of the velocities relative to these, from the squares of both.
pub(crate) fn share<R: Real>(change: R, motion: R) -> R {
    if motion > R::of(0.0) { change * (R::of(1.0) / motion) } else { R::of(0.0) }
}

/// Totals of the iterations since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Spent {
    /// Iterations taken.
    pub iterations: u64,
    /// Steps of the implicit scheme whose iterations ended at [`Settings::iterations`](crate::Settings::iterations),
    /// not at [`Settings::tolerance`](crate::Settings::tolerance).
    pub capped: u64,
    /// The largest [`Solved::change`] of a step of the implicit scheme.
    pub worst_change: f64,
}

/// The state of a solver after a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct StepReport {
    /// Steps taken so far.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Particles in the simulation.
    pub alive: u32,
    /// Particles that emitters and hosts have added since the start.
    pub emitted: u64,
    /// Particles that drains and hosts have deleted since the start.
    pub drained: u64,
    /// Particles that emitters have withheld since the start because their place was full, in a body or outside the
    /// domain, and those that hosts had asked for in places where they then set a body.
    pub withheld: u64,
    /// Grid blocks (4³ nodes) that held particles in the last step.
    pub occupied_blocks: u32,
    /// Grid blocks that were cleared and solved in the last step.
    pub active_blocks: u32,
    /// Particles that slept in the last step, where matter [may](crate::Settings::sleep).
    pub asleep: u32,
    /// Largest speed of a particle that was awake, averaged over the last step, m/s; before the first step the largest
    /// initial speed.
    pub max_speed: f64,
    /// Of the last step in the implicit scheme; `None` in the others.
    pub solved: Option<Solved>,
    /// What was spent since the start.
    pub spent: Spent,
    /// Counted since the start.
    pub faults: Faults,
}

/// More than any run counts; sums of such numbers do not overflow.
pub(crate) const MOST_COUNTED: u64 = 1 << 53;

/// What a solver has counted since the start, and how its last step ended.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Counts {
    pub spawned: u64,
    pub emitted: u64,
    pub drained: u64,
    pub withheld: u64,
    pub faults: Faults,
    /// Of the implicit scheme.
    pub iterations: u64,
    pub capped: u64,
    /// The square.
    pub worst_change: f64,
    pub occupied: u32,
    pub active: u32,
    pub asleep: u32,
    /// Square of the largest displacement.
    pub largest_square: f64,
    /// Of the last solve: iterations, and the square of [`Solved::change`].
    pub solved: (u32, f64),
}

impl Counts {
    /// Whether a run can have counted so many.
    pub fn can_be(&self) -> bool {
        let Counts { spawned, emitted, drained, withheld, faults, iterations, capped, .. } = *self;
        let Faults { saturated_nodes, speed_clamped, gradient_clamped, strain_clamped, .. } = faults;
        let Faults { escaped, quarantined, refused, steps_deferred, .. } = faults;
        let of_run = [spawned, emitted, drained, withheld, iterations, capped, saturated_nodes, speed_clamped];
        let others = [gradient_clamped, strain_clamped, escaped, quarantined, refused, steps_deferred];
        of_run.into_iter().chain(others).all(|count| count <= MOST_COUNTED)
    }

    /// As a report after `step` steps, the last of which ended at `moment`.
    pub fn report(&self, timeline: &Timeline, step: u64, moment: &Moment) -> StepReport {
        let gone = self.drained.saturating_add(self.faults.escaped).saturating_add(self.faults.quarantined);
        let implicit = timeline.settings.scheme == Scheme::Implicit;
        StepReport {
            step,
            time: moment.time,
            alive: self.spawned.saturating_add(self.emitted).saturating_sub(gone) as u32,
            emitted: self.emitted,
            drained: self.drained,
            withheld: self.withheld,
            occupied_blocks: self.occupied,
            active_blocks: self.active,
            asleep: self.asleep,
            max_speed: timeline.units.speed_out(self.largest_square.sqrt(), moment.last_dt()),
            solved: implicit.then(|| Solved::new(self.solved)),
            spent: Spent {
                iterations: timeline.iterations(step, self.iterations),
                capped: self.capped,
                worst_change: self.worst_change.sqrt(),
            },
            faults: self.faults,
        }
    }
}

/// Bytes owned by a solver.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Memory {
    /// State of the particles.
    pub particles: u64,
    /// Nodes of the grid and tiles of the scatter.
    pub grid: u64,
    /// The structures that find blocks and order particles.
    pub bins: u64,
    /// Constants, colliders, counters, staging.
    pub other: u64,
}

impl Memory {
    /// All of it.
    pub fn total(&self) -> u64 {
        self.particles + self.grid + self.bins + self.other
    }
}

/// Whether a particle takes part; if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fate {
    /// In the simulation.
    Alive,
    /// Deleted at an open side; the state is that of its last step, until the slot is used again.
    Escaped,
    /// Deleted by a drain; the state is that of its last step, until the slot is used again.
    Drained,
    /// Taken out because its state was not finite, or its volume ratio negative; the state is kept for inspection, and
    /// the slot with it, until [`Simulate::release_quarantined`](crate::Simulate::release_quarantined).
    Quarantined,
    /// There is no particle in this slot: there has been none, or it was quarantined and its slot given back.
    Vacant,
}

/// A particle as users see it, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Particle {
    /// m
    pub position: glam::DVec3,
    /// Mean velocity over the last step, m/s.
    pub velocity: glam::DVec3,
    /// Velocity gradient, 1/s.
    pub velocity_gradient: glam::DMat3,
    /// Volume over volume at rest: below 1 is compressed.
    pub volume_ratio: f64,
    /// kg
    pub mass: f64,
    /// Index into [`World::materials`](crate::World::materials).
    pub material: u32,
    /// Whether it takes part.
    pub fate: Fate,
}

/// Sums over the particles that are alive.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct State {
    /// kg
    pub mass_kg: f64,
    /// m
    pub centre_of_mass_m: [f64; 3],
    /// kg m/s
    pub momentum: [f64; 3],
    /// About the world's origin, kg m²/s, without the particles' own spin.
    pub angular_momentum: [f64; 3],
    /// J, of the mean velocities over the last step, without the particles' own spin.
    pub kinetic_j: f64,
    /// J, against gravity, zero at the world's origin.
    pub potential_j: f64,
    /// m/s
    pub max_speed_m_s: f64,
    /// Lower and upper corner of what the particles span, m.
    pub bounds_m: [[f64; 3]; 2],
    /// Volume over volume at rest.
    pub volume_ratio: VolumeRatio,
}

/// Distribution of the volume ratio over the particles.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize))]
#[non_exhaustive]
pub struct VolumeRatio {
    /// Most compressed.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Most expanded.
    pub max: f64,
    /// Root mean square of the ratio minus 1.
    pub rms: f64,
}

impl State {
    /// Sums over `particles` in a fixed order.
    pub fn of(particles: &[Particle], gravity: glam::DVec3) -> State {
        use glam::DVec3;
        let alive = || particles.iter().filter(|p| p.fate == Fate::Alive);
        let count = alive().count();
        if count == 0 {
            return State::default();
        }
        let mut s = State::default();
        let (mut moment, mut momentum, mut angular) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut ratio = VolumeRatio { min: f64::INFINITY, mean: 0.0, max: f64::NEG_INFINITY, rms: 0.0 };
        for p in alive() {
            s.mass_kg += p.mass;
            moment += p.position * p.mass;
            momentum += p.velocity * p.mass;
            angular += p.position.cross(p.velocity) * p.mass;
            s.kinetic_j += 0.5 * p.mass * p.velocity.length_squared();
            s.potential_j -= p.mass * gravity.dot(p.position);
            s.max_speed_m_s = s.max_speed_m_s.max(p.velocity.length());
            lo = lo.min(p.position);
            hi = hi.max(p.position);
            ratio.min = ratio.min.min(p.volume_ratio);
            ratio.max = ratio.max.max(p.volume_ratio);
            ratio.mean += p.volume_ratio;
            ratio.rms += (p.volume_ratio - 1.0).powi(2);
        }
        ratio.mean /= count as f64;
        ratio.rms = (ratio.rms / count as f64).sqrt();
        s.centre_of_mass_m = (moment / s.mass_kg).to_array();
        s.momentum = momentum.to_array();
        s.angular_momentum = angular.to_array();
        s.bounds_m = [lo.to_array(), hi.to_array()];
        s.volume_ratio = ratio;
        s
    }
}

/// FNV-1a over the bits of every particle's position, velocity and volume ratio, slot by slot: equal states have
/// equal hashes.
pub fn state_hash(particles: &[Particle]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut eat = |x: f64| {
        for byte in x.to_bits().to_le_bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    };
    for p in particles {
        p.position.to_array().into_iter().chain(p.velocity.to_array()).chain([p.volume_ratio]).for_each(&mut eat);
    }
    hash
}
