//! Particles that appear and disappear in a step, by emitters and drains and on request of a host.
//!
//! Where and when a particle is due is known here, in f64. The device decides what only it knows: whether the place is
//! free, and which slot.

use super::{ColliderInput, Timeline};
use crate::emitter::{self, Emitter, Rate};
use crate::error::{Check, Result};
use crate::math::fixed::Scales;
use crate::report::MOST_COUNTED;
use crate::spawn::{self, Seed, SplitMix};
use crate::units::FIRST_BETWEEN;
use glam::DVec3;

/// A particle that appears at the end of a step if its place is free, in cell units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    pub position: DVec3,
    /// In the step before its first.
    pub displacement: DVec3,
    /// Rotation per step, about this vector by its length.
    pub turn: DVec3,
    pub mass: f64,
    pub material: u32,
    /// Mass per cell that the grid may hold at most where it appears; below zero it never does.
    pub limit: f64,
}

/// More than any grid can hold.
const UNLIMITED: f64 = 3e38;
/// Units of the mass sums that a particle weighs at least: it falls within 0.5 % as it should.
const LEAST_UNITS: f64 = 4096.0;
/// The largest error of a coordinate in single precision, cells.
const ROUNDED_TO_SINGLE: f64 = 1.0 / 4096.0;
/// For particles outside the domain, or emitted inside a body.
const NEVER: f64 = -1.0;
/// Places tried for one particle before it is left to the next step: far more than any shape but a sieve needs.
const TRIES: u64 = 100_000;
/// Places that an emitter tries for all of a step's particles: this many for each, beside [`TRIES`].
const TRIES_EACH: u64 = 64;
/// The most particles that emitters can be behind with for want of places, each and all together; more are forgotten.
const MOST_OWED: f64 = 1e6;

/// An emitter's progress.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Progress {
    /// Particles that are due and have not appeared, a fraction of one between steps.
    owed: f64,
    /// Points of its sequence that were drawn.
    drawn: u64,
}

impl Progress {
    /// Fails for a progress that no emitter reaches.
    pub fn check(&self, check: &Check<'_>) -> Result<()> {
        check.that(self.drawn <= MOST_COUNTED, "progress.drawn", self.drawn, "at most 2^53")?;
        // By rounding a particle may come before it is due.
        check.range("progress.owed", self.owed, -1.0, MOST_OWED, "-1 to 1e6")
    }
}

impl Timeline {
    /// Changes how fast an emitter emits.
    pub fn set_emission(&mut self, emitter: usize, rate: Rate) -> Result<()> {
        let count = self.emitters.len();
        Check { path: "" }.that(emitter < count, "emitter", emitter, &format!("below the world's {count} emitters"))?;
        let changed = Emitter { rate, ..self.emitters[emitter].0.clone() };
        let cell_size = self.units.cell_size;
        changed.validate(&format!("emitters[{emitter}]"), cell_size)?;
        let others = self.emitters.iter().enumerate().filter(|(i, _)| *i != emitter).map(|(_, (other, _))| other);
        emitter::check_sum(others.chain([&changed]).map(|e| e.particles_per_second(cell_size)))?;
        self.emitters[emitter].0 = changed;
        Ok(())
    }

    /// Chooses scales under which the masses and volumes of these particles and of those to be emitted cannot wrap a
    /// sum. Fails where the lightest particle would then get lost in it.
    pub(super) fn expect_masses(&mut self, seeds: &[Seed]) -> Result<()> {
        let cell_size = self.units.cell_size;
        let emitted = self.emitters.iter().map(|(emitter, material)| (emitter.particle_volume(cell_size), *material));
        let all = seeds.iter().map(|seed| (seed.volume, seed.material)).chain(emitted);
        let (mut heaviest, mut smallest) = (self.heaviest, self.smallest);
        for (volume, material) in all {
            let [least, most] = self.weights(volume, material);
            (heaviest, smallest) = (heaviest.max(most), smallest.min(least));
        }
        let scales = Scales::new(heaviest, self.settings.max_fill, self.settings.max_displacement);
        let least = LEAST_UNITS / scales.mass;
        let [found, least_kg] = [smallest, least].map(|mass| self.units.mass_out(mass));
        let allowed = format!(
            "at least {least_kg:.3e} kg, lest it be rounded away: bring densities and the spacing of particles closer \
             together, or lower settings.max_fill"
        );
        Check { path: "" }.that(smallest >= least, "mass of the lightest particle", found, &allowed)?;
        (self.heaviest, self.smallest, self.scales) = (heaviest, smallest, scales);
        Ok(())
    }

    /// Mass of a particle of this volume, in mass units, and the larger of its mass and its volume, as volumes are summed
    /// in the same unit.
    fn weights(&self, volume: f64, material: u32) -> [f64; 2] {
        let (volume, density) = (self.units.volume_in(volume), self.density(material));
        [volume * density, volume * density.max(1.0)]
    }

    /// Whether the scales are chosen for particles like this.
    pub(super) fn counts(&self, seed: &Seed) -> bool {
        let [least, most] = self.weights(seed.volume, seed.material);
        least >= self.smallest && most <= self.heaviest
    }

    /// Mass of a particle, in mass units.
    pub fn mass_in(&self, seed: &Seed) -> f64 {
        self.units.volume_in(seed.volume) * self.density(seed.material)
    }

    fn density(&self, material: u32) -> f64 {
        self.units.density_in(self.materials[material as usize].rest_density)
    }

    /// The regions that are emptied at the end of the step, where they are then.
    pub(super) fn drained(&self) -> Vec<ColliderInput> {
        let end = self.now.time + self.dt;
        let all = self.drains.iter().chain(&self.edits.removed);
        all.map(|drain| self.body(&drain.shape, drain.inverted, &drain.pose(end))).collect()
    }

    /// The sensors where they are at the end of the step.
    pub(super) fn sensed(&self) -> Vec<ColliderInput> {
        let end = self.now.time + self.dt;
        self.sensors.iter().map(|sensor| self.body(&sensor.shape, sensor.inverted, &sensor.pose(end))).collect()
    }

    /// The particles that may appear at the end of the step, and the emitters' progress by then.
    pub(super) fn candidates(&self) -> (Vec<Candidate>, Vec<Progress>) {
        let mut candidates = Vec::new();
        let mut progress = self.now.progress.clone();
        for ((emitter, material), progress) in self.emitters.iter().zip(&mut progress) {
            self.emit(emitter, *material, progress, &mut candidates);
        }
        // Bodies may have been set into places that were free when particles were added there.
        candidates.extend(self.edits.added.iter().map(|seed| self.candidate(seed, 0.0, UNLIMITED)));
        self.keep_out(&mut candidates);
        (candidates, progress)
    }

    /// The most particles that emitters at their present rates emit in a step.
    pub(super) fn most_emitted(&self) -> usize {
        let rates = self.emitters.iter().map(|(emitter, _)| emitter.particles_per_second(self.units.cell_size));
        rates.map(|rate| (rate * self.settings.dt).ceil() as usize + 1).sum()
    }

    /// The largest speed of those of these particles that may appear, m/s.
    pub(super) fn appearing_speed(&self, candidates: &[Candidate]) -> f64 {
        let may_appear = candidates.iter().filter(|c| c.limit >= 0.0);
        let farthest = may_appear.map(|c| c.displacement.length()).fold(0.0, f64::max);
        self.units.speed_out(farthest, self.dt)
    }

    /// Withholds what would appear in bodies, where they are at the end of the step.
    fn keep_out(&self, candidates: &mut [Candidate]) {
        if candidates.is_empty() {
            return;
        }
        let bounds = spawn::bounds(candidates.iter().map(|c| self.units.position_out(c.position)));
        for (body, pose) in self.colliders.iter().zip(&self.now.poses) {
            let pose = self.end_pose(body, pose);
            if spawn::is_beyond(body, &pose, bounds) {
                continue;
            }
            let inside = |c: &Candidate| {
                let position = self.units.position_out(c.position);
                spawn::begins_inside(body, &pose, position, self.units.cell_size)
            };
            candidates.iter_mut().filter(|c| inside(c)).for_each(|c| c.limit = NEVER);
        }
    }

    /// A particle that has flown for `age` s at the end of the step.
    fn candidate(&self, seed: &Seed, age: f64, limit: f64) -> Candidate {
        let position = seed.position + seed.velocity * age + self.gravity * (0.5 * age * age);
        // The next step's kick begins with half of this step's.
        let velocity = seed.velocity + self.gravity * (age - 0.5 * self.dt);
        let inside = position.clamp(self.domain.min, self.domain.max).cmpeq(position);
        let inside = (inside | self.period.cmpgt(DVec3::ZERO)).all();
        let limit = if inside { limit } else { NEVER };
        Candidate { limit, ..self.particle(&Seed { position, velocity, ..*seed }) }
    }

    /// Where a particle begins, in cells, from m: between periodic sides.
    pub fn place(&self, position: DVec3) -> DVec3 {
        let mut place = self.units.position_in(position);
        for axis in (0..3).filter(|axis| self.period[*axis] > 0.0) {
            let along = (place[axis] - FIRST_BETWEEN).rem_euclid(self.period[axis]);
            // Not so near to the upper side that rounding to single precision would lead there.
            let ends = along > self.period[axis] - ROUNDED_TO_SINGLE;
            place[axis] = FIRST_BETWEEN + if ends { 0.0 } else { along };
        }
        place
    }

    /// A particle before the first step.
    pub fn particle(&self, seed: &Seed) -> Candidate {
        let dt = self.dt;
        Candidate {
            position: self.place(seed.position),
            displacement: self.units.velocity_in(seed.velocity, dt),
            turn: self.units.turn_in(seed.angular_velocity, dt),
            mass: self.mass_in(seed),
            material: seed.material,
            limit: UNLIMITED,
        }
    }

    fn emit(&self, emitter: &Emitter, material: u32, progress: &mut Progress, out: &mut Vec<Candidate>) {
        let (begin, dt) = (self.now.time, self.dt);
        let end = begin + dt;
        let rate = emitter.particles_per_second(self.units.cell_size);
        let from = begin.max(emitter.start);
        let span = end.min(emitter.end.unwrap_or(end)) - from;
        if rate <= 0.0 || span <= 0.0 {
            return;
        }
        let most = MOST_OWED / self.emitters.len() as f64;
        let before = progress.owed.min(most);
        // A rounding error short of a particle counts as one.
        let due = (before + rate * span + 1e-6).floor();
        let limit = emitter.fill_limit * self.density(material);
        let mut made = 0.0;
        let mut tries = TRIES + TRIES_EACH * due.max(0.0) as u64;
        while made < due {
            let Some(local) = place(emitter, progress, &mut tries) else { break };
            made += 1.0;
            let time = (from + ((made - before) / rate).max(0.0)).min(end);
            let pose = emitter.pose(time);
            let at = |time: f64| {
                let pose = emitter.pose(time);
                pose.position + pose.rotation * local
            };
            let seed = Seed {
                position: pose.position + pose.rotation * local,
                velocity: pose.rotation * emitter.velocity + (at(end) - at(begin)) / dt,
                angular_velocity: DVec3::ZERO,
                volume: emitter.particle_volume(self.units.cell_size),
                material,
            };
            out.push(self.candidate(&seed, end - time, limit));
        }
        progress.owed = (before + rate * span - made).min(most);
    }
}

/// The next point of the emitter's sequence that lies in its shape, in its own frame; `None` if none is found in
/// [`TRIES`] or in the `tries` that are left, of which those that it took are subtracted.
///
/// Additive recurrence by powers of the plastic number's analogue in three dimensions, g⁴ = g + 1 (M. Roberts, "The
/// Unreasonable Effectiveness of Quasirandom Sequences", 2018), in fixed point so that it never loses precision.
fn place(emitter: &Emitter, progress: &mut Progress, tries: &mut u64) -> Option<DVec3> {
    const STEPS: [u64; 3] = [0xD1B5_4A32_D192_ED03, 0xABC9_8388_FB8F_AC03, 0x8CB9_2BA7_2F3D_8DD7];
    let half = emitter.shape.half_extent()?;
    let mut random = SplitMix(emitter.seed);
    let offset = [random.next(), random.next(), random.next()];
    let least = tries.saturating_sub(TRIES);
    while *tries > least {
        *tries -= 1;
        let share = |axis: usize| {
            let point = offset[axis].wrapping_add(STEPS[axis].wrapping_mul(progress.drawn));
            (point >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
        };
        let local = DVec3::new(share(0), share(1), share(2)) * half;
        progress.drawn = progress.drawn.wrapping_add(1);
        if emitter.shape.signed_distance(local) <= 0.0 {
            return Some(local);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::motion::Motion;
    use crate::shape::Shape;
    use crate::world::World;

    fn timeline(emitter: Emitter) -> Timeline {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
        world.materials.push(Material::liquid("water"));
        world.emitters.push(emitter);
        world.validate().unwrap();
        Timeline::new(&world, &[]).unwrap()
    }

    fn emitter(rate: Rate) -> Emitter {
        Emitter::new("water", Shape::Sphere { radius: 0.1 }, DVec3::splat(0.5), rate)
    }

    /// A coarse light material beside a dense one brings more volume than mass, in the same sums.
    #[test]
    fn volumes_count_for_scales_as_masses_do() {
        let mut world = World::new(DVec3::ZERO, DVec3::splat(10.0), 1.0);
        world.materials = vec![Material::liquid("water"), Material { rest_density: 1.0, ..Material::liquid("air") }];
        let seed = |material: u32, volume: f64| {
            let [position, zero] = [DVec3::ONE, DVec3::ZERO];
            Seed { position, velocity: zero, angular_velocity: zero, volume, material }
        };
        let timeline = Timeline::new(&world, &[seed(0, 0.125), seed(1, 100.0)]).unwrap();
        assert!(timeline.heaviest >= 100.0, "{}", timeline.heaviest);
    }

    /// As many as the rate gives over any period, whatever the steps are.
    #[test]
    fn rates_are_kept_exactly() {
        let litres = 0.05f64.powi(3) / 8.0 * 1000.0 * 12_345.0;
        for rate in [Rate::Particles(12_345.0), Rate::Litres(litres)] {
            let mut timeline = timeline(Emitter { start: 0.25, end: Some(1.25), ..emitter(rate) });
            let mut emitted = 0;
            for dt in [0.011, 0.003, 0.0275].into_iter().cycle().take(120) {
                timeline.set_dt(dt).unwrap();
                let input = timeline.input();
                emitted += input.candidates.len();
                timeline.advance(&input);
                let due = 12_345.0 * (timeline.now().time.clamp(0.25, 1.25) - 0.25);
                assert!((emitted as f64 - due).abs() <= 1.0, "{emitted} for {due}");
            }
            assert_eq!(emitted, 12_345);
        }
    }

    /// Evenly in the shape: each octant of a ball gets its eighth, and no two particles the same place.
    #[test]
    fn places_fill_the_shape() {
        let mut progress = Progress::default();
        let emitter = emitter(Rate::Particles(1.0));
        let points: Vec<_> = (0..8000).map(|_| place(&emitter, &mut progress, &mut 8).unwrap()).collect();
        for octant in 0..8 {
            let side = |p: &DVec3| (0..3).all(|a| (p[a] > 0.0) == (octant >> a & 1 == 1));
            let count = points.iter().filter(|p| side(p)).count();
            assert!((950..=1050).contains(&count), "octant {octant}: {count}");
        }
        assert!(points.iter().all(|p| p.length() <= 0.1));
        let mean: DVec3 = points.iter().sum::<DVec3>() / 8000.0;
        assert!(mean.length() < 1e-3, "{mean}");
        // 500 points of radius r fill the ball at r = 0.1/500^(1/3) = 0.0126; random ones come arbitrarily near.
        let nearest = (0..500)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| points[i].distance(points[j]))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.003, "{nearest}");
    }

    /// What tries do not suffice for in one step is found in later ones, at the same places.
    #[test]
    fn places_wait_for_tries() {
        let emitter = emitter(Rate::Particles(1.0));
        let (mut whole, mut cut) = (Progress::default(), Progress::default());
        let mut misses = 0;
        for _ in 0..100 {
            let wanted = place(&emitter, &mut whole, &mut 1000);
            let found = loop {
                let mut tries = 1;
                if let Some(found) = place(&emitter, &mut cut, &mut tries) {
                    break found;
                }
                assert_eq!(tries, 0);
                misses += 1;
            };
            assert_eq!(Some(found), wanted);
        }
        // A ball fills 0.52 of its box.
        assert!((60..140).contains(&misses) && cut == whole, "{misses}, {cut:?}");
    }

    /// Emitters whose rotation is off length 1 emit neither faster nor wider.
    #[test]
    fn rotations_do_not_stretch() {
        let candidates = |rotation| {
            let emitter = Emitter { velocity: DVec3::X, rotation, ..emitter(Rate::Particles(1e4)) };
            timeline(emitter).input().candidates
        };
        let turn = glam::DQuat::from_rotation_y(0.785);
        for (a, b) in candidates(turn).iter().zip(candidates(turn * 1.0008)) {
            let apart = a.position.distance(b.position) + a.displacement.distance(b.displacement);
            assert!(apart < 1e-10, "{apart} cells");
        }
    }

    /// A particle emitted within a step is where its flight has brought it at the end, whatever the step's length, and
    /// what an emitter emits moves with it.
    #[test]
    fn flight_begins_within_the_step() {
        let motion = Motion::Steady { linear_velocity: DVec3::X, angular_velocity: DVec3::ZERO };
        let moving = Emitter {
            velocity: DVec3::new(0.0, 2.0, 0.0),
            shape: Shape::Sphere { radius: 1e-9 },
            motion: Some(motion),
            position: DVec3::new(0.1, 0.2, 0.5),
            ..emitter(Rate::Particles(50.0))
        };
        let mut timeline = timeline(moving);
        timeline.set_dt(0.1).unwrap();
        let input = timeline.input();
        assert_eq!(input.candidates.len(), 5);
        for (k, candidate) in input.candidates.iter().enumerate() {
            let age = 0.1 - 0.02 * (k + 1) as f64;
            let g = DVec3::new(0.0, -9.81, 0.0);
            let v = DVec3::new(1.0, 2.0, 0.0);
            let there = DVec3::new(0.1 + 0.1 - age, 0.2, 0.5) + v * age + g * (0.5 * age * age);
            assert!(timeline.units.position_out(candidate.position).distance(there) < 1e-8, "{candidate:?}");
            // With the kick of the next step: its mean velocity in that step.
            let next = timeline.units.velocity_out(candidate.displacement, 0.1) + g * 0.1;
            assert!(next.distance(v + g * (age + 0.05)) < 1e-8, "{next}");
        }
    }

    #[test]
    fn what_is_outside_is_withheld() {
        let at_the_wall = Emitter { position: DVec3::new(0.0, 0.5, 0.5), ..emitter(Rate::Particles(1e5)) };
        let candidates = timeline(at_the_wall).input().candidates;
        let withheld = candidates.iter().filter(|c| c.limit < 0.0).count();
        assert!(withheld.abs_diff(candidates.len() / 2) < 20, "{withheld} of {}", candidates.len());
        assert!(candidates.iter().all(|c| (c.limit < 0.0) == (c.position.x < crate::units::MARGIN)));
    }
}
