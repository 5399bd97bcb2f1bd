//! The state of a timeline, to be kept and resumed.

use super::edits::Edits;
use super::emission::Progress;
use super::{Moment, Timeline};
use crate::collider::Collider;
use crate::emitter::{self, Emitter, Rate};
use crate::error::{Check, Result};
use crate::math::fixed::Scales;
use crate::report::MOST_COUNTED;
use crate::settings::{LONGEST, SHORTEST, Settings};
use crate::shape::{Pose, validate_rotation};
use crate::tool::{MAX_TOOLS, Tool};
#[cfg(feature = "snapshot")]
use crate::world::World;
use glam::{DQuat, DVec3};
use std::sync::Arc;

/// Whatever of a timeline differs from that of its world at the start.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Clock {
    pub step: u64,
    pub time: f64,
    /// See [`Moment`].
    previous: (f64, DVec3),
    impulse: f64,
    softest: f64,
    brought: f64,
    poses: Vec<Pose>,
    progress: Vec<Progress>,
    pub(super) edits: Edits,
    tools: Vec<Tool>,
    tools_due: Vec<Vec<Tool>>,
    /// Length of the steps to come, and the longest.
    dt: f64,
    longest: f64,
    gravity: DVec3,
    bodies: Vec<Body>,
    rates: Vec<Rate>,
    heaviest: f64,
    /// `None` before any particle.
    smallest: Option<f64>,
}

/// How a collider moves from now on.
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

impl Clock {
    /// Length of the step before, s.
    pub fn last_dt(&self) -> f64 {
        self.previous.0
    }

    /// Builds the meshes of regions whose removal is pending.
    #[cfg(feature = "snapshot")]
    pub fn build_edits(&mut self, world: &World) -> Result<()> {
        self.edits.build(world)
    }
}

impl Timeline {
    /// Its present state.
    pub fn clock(&self) -> Clock {
        let Moment { step, time, previous, impulse, softest, brought, .. } = self.now;
        let Moment { poses, progress, edits, tools, .. } = &self.now;
        let body = |c: &Collider| Body {
            scripted: c.motion.is_some(),
            position: c.position,
            rotation: c.rotation,
            linear_velocity: c.linear_velocity,
            angular_velocity: c.angular_velocity,
        };
        Clock {
            step,
            time,
            previous,
            impulse,
            softest,
            brought,
            poses: poses.clone(),
            progress: progress.clone(),
            edits: (**edits).clone(),
            tools: tools.to_vec(),
            tools_due: self.tools_due.iter().map(|tools| tools.to_vec()).collect(),
            dt: self.dt,
            longest: self.settings.dt,
            gravity: self.gravity,
            bodies: self.colliders.iter().map(body).collect(),
            rates: self.emitters.iter().map(|(emitter, _)| emitter.rate).collect(),
            heaviest: self.heaviest,
            smallest: self.smallest.is_finite().then_some(self.smallest),
        }
    }

    /// A timeline of the same world that continues from `clock`.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) where the clock holds what no host could have asked for.
    pub fn resumed(&self, clock: &Clock) -> Result<Timeline> {
        let check = Check { path: "snapshot.clock" };
        let counts = [clock.bodies.len(), clock.poses.len(), clock.rates.len(), clock.progress.len()];
        let (colliders, emitters) = (self.colliders.len(), self.emitters.len());
        let expected = [colliders, colliders, emitters, emitters];
        check.that(counts == expected, "bodies and emitters", counts, &format!("{expected:?}"))?;
        for (name, dt) in [("dt", clock.dt), ("previous.dt", clock.previous.0)] {
            // The steps of a frame may be half as long as the shortest that can be requested.
            check.range(name, dt, 0.5 * SHORTEST, LONGEST, "5e-6 to 0.2 s")?;
        }
        check.vector("previous.gravity", clock.previous.1, 1e6, "finite, at most 1e6 m/s²")?;
        check.range("time", clock.time, 0.0, f64::MAX, "0 or above")?;
        check.that(clock.step <= MOST_COUNTED, "step", clock.step, "at most 2^53")?;
        // Of the shortest step after the longest.
        let most = 0.5 + LONGEST / SHORTEST;
        check.range("impulse", clock.impulse, 0.5, most, &format!("0.5 to {most}"))?;
        check.range("softest", clock.softest, 0.0, LONGEST, "0 to 0.2 s")?;
        check.range("brought", clock.brought, 0.0, f64::MAX, "0 or above")?;
        check.range("heaviest", clock.heaviest, 0.0, 1e30, "0 to 1e30")?;
        let smallest = clock.smallest.unwrap_or(f64::INFINITY);
        check.that(smallest > 0.0, "smallest", smallest, "above 0")?;
        for pose in &clock.poses {
            check.vector("poses.position", pose.position, f64::MAX, "finite")?;
            validate_rotation(&check, "poses.rotation", pose.rotation)?;
        }
        clock.progress.iter().try_for_each(|progress| progress.check(&check))?;
        let mut next = self.clone();
        let bodies = self.world.colliders.iter().zip(&clock.bodies);
        next.colliders = bodies.map(|(collider, body)| body.applied(collider)).collect();
        for (i, collider) in next.colliders.iter().enumerate() {
            collider.validate(&format!("snapshot.clock.bodies[{i}]"))?;
        }
        // Which steps are short enough depends on gravity.
        check.vector("gravity", clock.gravity, 1e6, "finite, at most 1e6 m/s²")?;
        next.gravity = clock.gravity;
        next.set_dt(clock.longest)?;
        check.that(clock.dt <= clock.longest, "dt", clock.dt, "at most the longest step")?;
        next.dt = clock.dt;
        next.emitters =
            self.emitters.iter().zip(&clock.rates).map(|((e, m), &rate)| (Emitter { rate, ..e.clone() }, *m)).collect();
        for (i, (emitter, _)) in next.emitters.iter().enumerate() {
            emitter.validate(&format!("snapshot.clock.rates[{i}]"), self.units.cell_size)?;
        }
        emitter::check_sum(next.emitters.iter().map(|(e, _)| e.particles_per_second(self.units.cell_size)))?;
        for tools in clock.tools_due.iter().chain([&clock.tools]) {
            check.that(tools.len() <= MAX_TOOLS, "tools", tools.len(), "at most 16 tools")?;
            for tool in tools {
                // They move on, also beyond where a host may place them.
                check.vector("tools.position", tool.position, f64::MAX, "finite")?;
                Tool { position: DVec3::ZERO, ..*tool }.validate("snapshot.clock.tools")?;
            }
        }
        (next.heaviest, next.smallest) = (clock.heaviest, smallest);
        next.know_edits(&clock.edits)?;
        next.tools_due = clock.tools_due.iter().map(|tools| tools[..].into()).collect();
        let Settings { max_fill, max_displacement, .. } = next.settings;
        next.scales = Scales::new(clock.heaviest, max_fill, max_displacement);
        next.now = Moment {
            step: clock.step,
            time: clock.time,
            previous: clock.previous,
            impulse: clock.impulse,
            softest: clock.softest,
            brought: clock.brought,
            poses: clock.poses.clone(),
            progress: clock.progress.clone(),
            edits: Arc::new(clock.edits.clone()),
            tools: clock.tools[..].into(),
        };
        Ok(next)
    }
}

impl Body {
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
