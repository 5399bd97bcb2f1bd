//! What a host has set and asked for, step by step: steps that have to be taken again are taken as they were asked for,
//! and what the host asks for meanwhile comes after them.

use super::disturbance::Bounds;
use super::edits::Edits;
use super::{Moment, Timeline};
use crate::collider::Collider;
use crate::emitter::{self, Emitter, Rate};
use crate::error::{Check, Result};
use crate::settings::{LONGEST, SHORTEST};
use crate::shape::Pose;
use crate::tool::{MAX_TOOLS, Tool};
#[cfg(feature = "snapshot")]
use crate::world::World;
use glam::{DQuat, DVec3};
use std::sync::Arc;

/// The most steps in flight, and so the most that may have to be taken again.
pub(crate) const MOST_DUE: u32 = 1024;

/// What a host has set, and its requests, for a step.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Asked {
    /// Length of the step, s.
    pub dt: f64,
    pub gravity: DVec3,
    bodies: Arc<[Body]>,
    rates: Arc<[Rate]>,
    pub tools: Arc<[Tool]>,
    pub edits: Arc<Edits>,
}

/// How a collider moves from a step on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
struct Body {
    /// It still follows its script.
    scripted: bool,
    position: DVec3,
    rotation: DQuat,
    linear_velocity: DVec3,
    angular_velocity: DVec3,
}

/// A step as it begins: whatever it takes to take it again.
#[derive(Debug, Clone)]
pub(crate) struct Beginning {
    pub moment: Moment,
    asked: Asked,
}

impl Beginning {
    /// Keeps only once what it has in common with the step before.
    pub fn share(&mut self, before: &Beginning) {
        let (asked, before) = (&mut self.asked, &before.asked);
        if asked.bodies == before.bodies {
            asked.bodies = before.bodies.clone();
        }
        if asked.rates == before.rates {
            asked.rates = before.rates.clone();
        }
    }
}

impl Asked {
    /// Builds the meshes of regions whose removal is pending.
    #[cfg(feature = "snapshot")]
    pub fn build(&mut self, world: &World) -> Result<()> {
        Arc::make_mut(&mut self.edits).build(world)
    }
}

impl Body {
    fn of(collider: &Collider) -> Self {
        Body {
            scripted: collider.motion.is_some(),
            position: collider.position,
            rotation: collider.rotation,
            linear_velocity: collider.linear_velocity,
            angular_velocity: collider.angular_velocity,
        }
    }

    /// A collider of the world, moving like this.
    fn applied(&self, collider: &Collider) -> Collider {
        Collider {
            motion: collider.motion.clone().filter(|_| self.scripted),
            position: self.position,
            rotation: self.rotation,
            linear_velocity: self.linear_velocity,
            angular_velocity: self.angular_velocity,
            ..collider.clone()
        }
    }
}

impl Timeline {
    /// What the host has set and asked for by now.
    pub(super) fn asked(&self) -> Asked {
        Asked {
            dt: self.dt,
            gravity: self.gravity,
            bodies: self.colliders.iter().map(Body::of).collect(),
            rates: self.emitters.iter().map(|(emitter, _)| emitter.rate).collect(),
            tools: self.tools.clone(),
            edits: self.edits.clone(),
        }
    }

    /// The same world at the same time, of which this was asked, and nothing is due.
    pub(super) fn as_asked(&self, asked: &Asked) -> Timeline {
        let Asked { dt, gravity, bodies, rates, tools, edits } = asked;
        let colliders = self.world.colliders.iter().zip(&bodies[..]).map(|(collider, body)| body.applied(collider));
        let emitters = self.emitters.iter().zip(&rates[..]);
        Timeline {
            dt: *dt,
            gravity: *gravity,
            colliders: colliders.collect(),
            emitters: emitters.map(|((e, m), &rate)| (Emitter { rate, ..e.clone() }, *m)).collect(),
            tools: tools.clone(),
            edits: edits.clone(),
            due: Default::default(),
            ..self.clone()
        }
    }

    /// The step that begins now.
    pub fn beginning(&self) -> Beginning {
        Beginning { moment: self.now.clone(), asked: self.due.front().cloned().unwrap_or_else(|| self.asked()) }
    }

    /// Goes back to the first of these steps, which were not taken. Each is due again as it was; what the host has asked
    /// for since then is done in the step after them.
    pub fn restore<'b>(&mut self, untaken: impl IntoIterator<Item = &'b Beginning>) {
        let untaken: Vec<_> = untaken.into_iter().collect();
        if let Some(first) = untaken.first() {
            self.now = first.moment.clone();
        }
        untaken.iter().rev().for_each(|step| self.due.push_front(step.asked.clone()));
    }

    /// Time and poses of the bodies at the end of the step that the host's present requests are for.
    pub(super) fn end(&self) -> (f64, Vec<Pose>) {
        let (mut time, mut poses) = (self.now.time, self.now.poses.clone());
        if self.due.is_empty() {
            return (time + self.dt, self.end_poses(&poses));
        }
        for asked in self.due.iter().chain([&self.asked()]) {
            asked.edits.placed.iter().for_each(|(i, pose)| poses[*i] = *pose);
            let mut step = self.as_asked(asked);
            step.now.time = time;
            poses = step.end_poses(&poses);
            time += asked.dt;
        }
        (time, poses)
    }

    /// Sets the bodies where the step that begins, one after others that were due, has them placed.
    pub(super) fn place_bodies(&mut self) {
        if let Some(asked) = self.due.front() {
            asked.edits.placed.iter().for_each(|(i, pose)| self.now.poses[*i] = *pose);
        } else if !self.edits.placed.is_empty() {
            let edits = Arc::make_mut(&mut self.edits);
            for (i, pose) in &edits.placed {
                let before = std::mem::replace(&mut self.now.poses[*i], *pose);
                edits.disturbed.push(Bounds::of_shape(&self.colliders[*i].shape, self.colliders[*i].inverted, &before));
            }
        }
    }

    /// This timeline with all of it, where a host can have asked for it.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) otherwise. `longest` is the longest step that the settings then allow.
    pub(super) fn with_asked(&self, asked: &Asked, longest: f64) -> Result<Timeline> {
        let check = Check { path: "snapshot.clock" };
        let counts = [asked.bodies.len(), asked.rates.len()];
        let expected = [self.colliders.len(), self.emitters.len()];
        check.that(counts == expected, "bodies and emitters", counts, &format!("{expected:?}"))?;
        // The steps of a frame may be half as long as the shortest that can be requested.
        check.range("dt", asked.dt, 0.5 * SHORTEST, LONGEST, "5e-6 to 0.2 s")?;
        check.that(asked.dt <= longest, "dt", asked.dt, "at most the longest step")?;
        check.vector("gravity", asked.gravity, 1e6, "finite, at most 1e6 m/s²")?;
        let mut next = self.as_asked(asked);
        for (i, collider) in next.colliders.iter().enumerate() {
            collider.validate(&format!("snapshot.clock.bodies[{i}]"))?;
        }
        // Which steps are short enough depends on gravity.
        next.set_dt(longest)?;
        next.dt = asked.dt;
        for (i, (emitter, _)) in next.emitters.iter().enumerate() {
            emitter.validate(&format!("snapshot.clock.rates[{i}]"), self.units.cell_size)?;
        }
        emitter::check_sum(next.emitters.iter().map(|(e, _)| e.particles_per_second(self.units.cell_size)))?;
        check.that(asked.tools.len() <= MAX_TOOLS, "tools", asked.tools.len(), "at most 16 tools")?;
        for tool in &asked.tools[..] {
            // They move on, also beyond where a host may place them.
            check.vector("tools.position", tool.position, f64::MAX, "finite")?;
            Tool { position: DVec3::ZERO, ..*tool }.validate("snapshot.clock.tools")?;
        }
        next.know_edits(&asked.edits)?;
        Ok(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::region::Region;
    use crate::shape::Shape;
    use crate::spawn::Spawn;
    use crate::tool::Action;
    use crate::world::World;

    /// A box with an emitter and a body.
    fn timeline() -> Timeline {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
        world.materials.push(Material::liquid("water"));
        world.settings.capacity = Some(10_000);
        let ball = Shape::Sphere { radius: 0.1 };
        world.colliders.push(Collider::new(ball.clone(), DVec3::splat(0.5)));
        world.emitters.push(Emitter::new("water", ball, DVec3::splat(0.2), Rate::Particles(0.0)));
        Timeline::new(&world, &[]).unwrap()
    }

    /// Asks for something else of everything in each step.
    fn ask(timeline: &mut Timeline, n: u32) {
        let x = f64::from(n);
        let at = DVec3::new(0.2 + 0.05 * x, 0.2, 0.8);
        timeline.set_dt(1e-3 * (1.0 + 0.1 * x)).unwrap();
        timeline.set_gravity(DVec3::new(x, -9.81, 0.0)).unwrap();
        timeline.set_emission(0, Rate::Particles(2000.0 * x)).unwrap();
        let pose = Pose { position: DVec3::splat(0.5 + 0.01 * x), rotation: DQuat::IDENTITY };
        timeline.set_collider(0, (n != 2).then_some(pose), DVec3::X * x, DVec3::Y * x).unwrap();
        let action = Action::Sweep { acceleration: x };
        timeline.set_tools(&[Tool { action, radius: 0.1, position: at, velocity: DVec3::X }]).unwrap();
        let size = DVec3::splat(0.03);
        timeline.add(&Spawn::cuboid("water", at - size, at + size), 10_000, |_| Ok(())).unwrap();
        timeline.remove(&Region::new(Shape::Box { half_size: size }, at), |_| Ok(())).unwrap();
        if n == 1 {
            timeline.release_quarantined();
        }
    }

    fn inputs(timeline: &mut Timeline, steps: usize) -> Vec<crate::timeline::StepInput> {
        let step = |_| {
            let input = timeline.input();
            timeline.advance(&input);
            input
        };
        (0..steps).map(step).collect()
    }

    /// Steps that were not taken are the same when they are taken, also where that takes two attempts, and the clock is
    /// kept and resumed in between; what is asked for meanwhile is done after them.
    #[test]
    fn steps_are_taken_again_as_they_were() {
        let (mut timeline, mut untaken, mut expected) = (timeline(), Vec::new(), Vec::new());
        for n in 0..4 {
            ask(&mut timeline, n);
            untaken.push(timeline.beginning());
            expected.extend(inputs(&mut timeline, 1));
        }
        let mut straight = timeline.clone();
        timeline.restore(&untaken);
        let begun: Vec<_> = (0..2).map(|_| (timeline.beginning(), inputs(&mut timeline, 1)).0).collect();
        timeline.restore(&begun);
        timeline = timeline.resumed(&timeline.clock()).unwrap();
        assert_eq!(inputs(&mut timeline, 1), expected[..1]);
        ask(&mut timeline, 4);
        ask(&mut straight, 4);
        assert_eq!(inputs(&mut timeline, 3), expected[1..]);
        expected = inputs(&mut straight, 2);
        assert_eq!(inputs(&mut timeline, 2), expected);
        assert_eq!(timeline.now().poses, straight.now().poses);
    }

    /// Matter that is asked for while steps are due keeps out of where bodies will be by then.
    #[test]
    fn what_is_added_keeps_out_of_bodies_after_steps_that_are_due() {
        let mut timeline = timeline();
        timeline.set_dt(0.01).unwrap();
        timeline.set_collider(0, None, DVec3::X * 10.0, DVec3::ZERO).unwrap();
        let mut untaken = Vec::new();
        for _ in 0..3 {
            untaken.push(timeline.beginning());
            inputs(&mut timeline, 1);
        }
        timeline.restore(&untaken);
        let mut add = |x: f64| {
            let (centre, half) = (DVec3::new(x, 0.5, 0.5), DVec3::splat(0.02));
            timeline.add(&Spawn::cuboid("water", centre - half, centre + half), 10_000, |_| Ok(())).unwrap()
        };
        assert!(add(0.5) > 0, "it is at 0.5 now and at 0.9 then");
        assert_eq!(add(0.9), 0);
    }
}
