//! How long steps are, and how many make a frame.

use super::Timeline;
use crate::collider::Collider;
use crate::emitter::Emitter;
use crate::error::{Check, Result};
use crate::material::COURANT;
use crate::settings::{SHORTEST, STIFFEST_BLOCK, Scheme, Settings, validate_dt};
use glam::DVec3;

/// Factor by which each step reduces the recent longest length that liquids are softened by: their modulus grows by a
/// thousandth.
pub(super) const RECOVERY: f64 = 0.9995;

/// The longest frame, s.
const LONGEST_FRAME: f64 = 60.0;

impl Timeline {
    /// Changes the length of the steps to come.
    pub fn set_dt(&mut self, dt: f64) -> Result<()> {
        validate_dt(&Check { path: "" }, dt)?;
        for (i, c) in self.colliders.iter().enumerate() {
            c.check_turn(&format!("colliders[{i}]"), dt)?;
        }
        let settings = Settings { dt, ..self.settings.clone() };
        settings.check_stable(self.taking_part(), self.units.cell_size, self.gravity)?;
        self.settings = settings;
        self.dt = dt;
        Ok(())
    }

    /// Divides a frame into equal steps, which sets the length of the steps to come, and returns their number. Steps
    /// that are due come first, as long as they were, and only the rest of the frame is divided. `speed` is the largest
    /// of a particle by a report, m/s; what appeared in the step before need not be in it.
    pub fn plan_frame(&mut self, frame: f64, speed: f64) -> Result<u32> {
        let some = (SHORTEST..=LONGEST_FRAME).contains(&frame);
        Check { path: "" }.that(some || frame == 0.0, "frame", frame, "0, or 1e-5 to 60 s")?;
        // As fast, for a body, as matter that may move as far in a step.
        let bodies = self.colliders.iter().map(Collider::fastest).fold(0.0, f64::max);
        let swept = bodies * self.settings.courant / self.settings.largest_sweep();
        let speed = speed.max(self.now.brought).max(self.coming_speed(frame));
        let speed = self.hastened(frame, speed).max(swept);
        let (mut rest, mut due) = (frame, 0);
        for asked in &self.due {
            // Half a step more or less is no reason for a shorter one.
            if rest < 0.5 * asked.dt && (due > 0 || frame == 0.0) {
                break;
            }
            (rest, due) = (rest - asked.dt, due + 1);
        }
        let last = if due > 0 { self.due[due - 1].dt } else { 0.0 };
        if due < self.due.len() || due > 0 && rest < SHORTEST.max(0.5 * last) {
            return Ok(due as u32);
        }
        let steps = self.settings.substeps(rest, self.units.cell_size, self.falling(frame, speed), speed);
        if steps > 0 {
            // Not longer, by a rounding error, than the settings and stability allow.
            self.dt = (rest / f64::from(steps)).min(self.settings.dt);
        }
        Ok(due as u32 + steps)
    }

    /// Gravity, or in a frame so long that matter cannot fall all the while, as much of it as brings what has this
    /// speed (m/s) to that of a fall through the whole domain. Along periodic axes it can.
    fn falling(&self, frame: f64, speed: f64) -> DVec3 {
        if self.gravity.abs().dot(self.period) > 0.0 {
            return self.gravity;
        }
        let energy = (self.gravity.abs() * (self.domain.max - self.domain.min)).element_sum();
        let fastest = (speed * speed + 2.0 * energy).sqrt() - speed;
        let gained = self.gravity.length() * frame;
        if gained > fastest { self.gravity * (fastest / gained) } else { self.gravity }
    }

    /// The largest speed of particles that appear within a frame, m/s.
    fn coming_speed(&self, frame: f64) -> f64 {
        let now = self.now.time;
        let emits = |e: &Emitter| {
            let works = e.start < now + frame && e.end.is_none_or(|end| end > now);
            works && e.particles_per_second(self.units.cell_size) > 0.0
        };
        let emits = self.emitters.iter().filter(|(e, _)| emits(e));
        let added = self.due.iter().map(|asked| &asked.edits).chain([&self.edits]).map(|edits| edits.max_speed());
        emits.map(|(e, _)| e.fastest()).chain(added).fold(0.0, f64::max)
    }

    /// The largest speed that tools bring matter of `speed` to within a frame, m/s.
    fn hastened(&self, frame: f64, speed: f64) -> f64 {
        let now = self.now.time;
        let speed = self.scripted.iter().fold(speed, |speed, tool| tool.hastened(now, frame, speed));
        let wielded = self.due.iter().map(|asked| &asked.tools).chain([&self.tools]);
        let hastened = wielded.map(|tools| tools.iter().fold(speed, |speed, tool| tool.hastened(frame, speed)));
        hastened.fold(speed, f64::max)
    }

    /// The step length that decides how stiff liquids are in the step that begins: the initial one, or a longer recent
    /// one. Where steps get shorter, the modulus in Pa stays at first, lest compressed matter be thrown up, and grows
    /// from step to step to that of the start.
    pub(super) fn softest(&self) -> f64 {
        self.first_dt.max(self.dt).max(self.now.softest)
    }

    /// What a step bears in stiffness, as the square of the cells that sound travels in it, over what one of the length
    /// that liquids are softened by does.
    fn shortness(&self) -> f64 {
        (self.dt / self.softest()).powi(2)
    }

    /// The largest stiffness of liquids in the step that begins.
    pub(super) fn stiffness_limit(&self) -> f64 {
        let borne = match self.settings.scheme {
            Scheme::Published => return 0.0,
            Scheme::Implicit => self.settings.stiffest(),
            Scheme::Explicit => COURANT * COURANT,
        };
        borne * self.shortness()
    }

    /// How stiff liquids are to the mean compression of a block: as they are by themselves, up to a bound. 0 where that
    /// is no stiffer than particles may be, and where steps have become too long, or gravity too strong, for it.
    pub(super) fn block_stiffness(&self) -> f64 {
        let particles = self.stiffness_limit();
        let fall = self.units.acceleration_in(self.gravity, self.dt);
        let held = self.features.shares_pressure && Settings::bears(particles, self.deepest, fall);
        let sound = self.units.length_in(self.liquid_sound * self.dt).powi(2);
        let stiffness = sound.min(STIFFEST_BLOCK * self.shortness());
        if held && stiffness > particles { stiffness } else { 0.0 }
    }

    /// The relative change of the motion at which iterations end. Where sound takes many steps to cross a cell,
    /// stresses change the motion in each step by less than any fixed tolerance, as the square of the cells that sound
    /// travels, and would never be solved for.
    pub(super) fn tolerance(&self) -> f64 {
        let slowest = self.taking_part().map(|(_, material)| material.sound()).fold(f64::INFINITY, f64::min);
        self.settings.tolerance * self.units.length_in(slowest * self.dt).min(1.0).powi(2)
    }

    /// Iterations that `steps` steps have taken; the implicit scheme counts its own.
    pub fn iterations(&self, steps: u64, counted: u64) -> u64 {
        match self.settings.scheme {
            Scheme::Published => steps * u64::from(self.settings.iterations),
            Scheme::Implicit => counted,
            Scheme::Explicit => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::spawn::Spawn;
    use crate::tool::{Action, ScriptedTool, Tool};
    use crate::world::World;

    /// A weightless box with cells of 0.05 m, in which a frame of 0.01 s at 10 m/s takes four steps.
    fn timeline() -> Timeline {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
        world.gravity = DVec3::ZERO;
        world.materials.push(Material::liquid("water"));
        world.settings = Settings { dt: 0.01, courant: 0.5, capacity: Some(1000), ..world.settings };
        Timeline::new(&world, &[]).unwrap()
    }

    fn step(timeline: &mut Timeline) {
        let input = timeline.input();
        timeline.advance(&input);
    }

    /// Matter counts for the frame in which it is asked for and, since the report of the step in which it appears does
    /// not know it, for one that begins right after; also where the clock is resumed, and where that step is taken
    /// again.
    #[test]
    fn what_has_just_appeared_counts_once() {
        let mut timeline = timeline();
        let fast = Spawn::cuboid("water", DVec3::splat(0.4), DVec3::splat(0.6));
        timeline.add(&Spawn { velocity: DVec3::X * 9.9, ..fast }, 1000, |_| Ok(())).unwrap();
        assert_eq!(timeline.plan_frame(0.01, 0.0), Ok(4));
        let before = timeline.beginning();
        step(&mut timeline);
        assert!((timeline.now().brought - 9.9).abs() < 1e-9);
        assert_eq!(timeline.plan_frame(0.01, 0.0), Ok(4));
        assert_eq!(timeline.resumed(&timeline.clock()).unwrap().plan_frame(0.01, 0.0), Ok(4));
        step(&mut timeline);
        assert_eq!(timeline.plan_frame(0.01, 0.0), Ok(1));
        timeline.restore([&before]);
        assert_eq!(timeline.plan_frame(0.01, 0.0), Ok(4));
    }

    /// Steps that are due keep their length and count for the frame, of which the rest is divided.
    #[test]
    fn steps_that_are_due_come_first() {
        let mut timeline = timeline();
        timeline.set_dt(0.004).unwrap();
        let mut untaken = Vec::new();
        for _ in 0..4 {
            untaken.push(timeline.beginning());
            step(&mut timeline);
        }
        timeline.restore(&untaken);
        timeline.set_dt(0.01).unwrap();
        let mut lengths = Vec::new();
        for _ in 0..3 {
            for _ in 0..timeline.plan_frame(0.01, 0.0).unwrap() {
                let before = timeline.now().time;
                step(&mut timeline);
                lengths.push(((timeline.now().time - before) * 1e6).round());
            }
        }
        // Three in the first frame; the fourth leaves 6 ms of the second.
        assert_eq!(lengths, [4e3, 4e3, 4e3, 4e3, 6e3, 10e3]);
        timeline.restore(&untaken);
        assert_eq!([0.0, 0.001, 0.006, 0.1].map(|frame| timeline.plan_frame(frame, 0.0)), [0, 1, 2, 13].map(Ok));
    }

    /// Each tool as fast as it makes matter within the frame, while it is at work.
    #[test]
    fn tools_count_as_they_act() {
        let still = DVec3::ZERO;
        let fast = DVec3::X * 9.9;
        let stirs = |time: f64| Action::Stir { angular_velocity: DVec3::Y * 49.5, time };
        for (action, velocity, steps) in [
            (Action::Grab { time: 0.0 }, still, 1),
            (Action::Grab { time: 0.0 }, fast, 4),
            // 1 − exp(−0.7) of the tool's speed: half of it.
            (Action::Grab { time: 0.01 / 2f64.ln() }, fast, 2),
            (Action::Grab { time: 100.0 }, fast, 1),
            (stirs(0.0), still, 4),
            (stirs(0.0), fast, 8),
            (Action::Push { acceleration: DVec3::Z * 990.0 }, still, 4),
            (Action::Attract { acceleration: -990.0 }, still, 4),
            (Action::Sweep { acceleration: 990.0 }, still, 1),
            (Action::Sweep { acceleration: 990.0 }, fast, 4),
        ] {
            let mut timeline = timeline();
            let tool = Tool { action, radius: 0.2, position: DVec3::splat(0.5), velocity };
            timeline.set_tools(&[tool]).unwrap();
            assert_eq!(timeline.plan_frame(0.01, 0.0), Ok(steps), "{tool:?}");
        }
        // Two that push add up; what already moves as one that grabs gets no faster.
        let push = Tool {
            action: Action::Push { acceleration: DVec3::Z * 490.0 },
            radius: 0.2,
            position: DVec3::splat(0.5),
            velocity: still,
        };
        let mut timeline = timeline();
        timeline.set_tools(&[push, push]).unwrap();
        assert_eq!(timeline.plan_frame(0.01, 0.0), Ok(4));
        timeline.set_tools(&[Tool { action: Action::Grab { time: 0.0 }, velocity: fast, ..push }]).unwrap();
        assert_eq!(timeline.plan_frame(0.01, 9.9), Ok(4));
    }

    #[test]
    fn scripted_tools_count_while_they_act() {
        let action = Action::Push { acceleration: DVec3::Z * 990.0 };
        let tool = ScriptedTool::new(action, 0.2, DVec3::splat(0.5));
        let mut world = World::clone(&timeline().world);
        world.tools.push(ScriptedTool { start: 0.025, end: Some(0.035), ..tool });
        let mut timeline = Timeline::new(&world, &[]).unwrap();
        let steps: Vec<u32> = (0..5)
            .map(|_| {
                let steps = timeline.plan_frame(0.01, 0.0).unwrap();
                timeline.set_dt(0.01).unwrap();
                step(&mut timeline);
                steps
            })
            .collect();
        assert_eq!(steps, [1, 1, 4, 4, 1]);
    }
}
