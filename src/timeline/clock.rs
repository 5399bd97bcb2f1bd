//! The state of a timeline, to be kept and resumed.

use super::asked::{Asked, MOST_DUE};
use super::emission::Progress;
use super::{Moment, Timeline};
use crate::error::{Check, Result};
use crate::math::fixed::Scales;
use crate::report::MOST_COUNTED;
use crate::settings::{LONGEST, SHORTEST, Settings};
use crate::shape::{Pose, validate_rotation};
#[cfg(feature = "snapshot")]
use crate::world::World;
use glam::DVec3;

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
    asked: Asked,
    /// Steps to be taken before that.
    due: Vec<Asked>,
    /// The longest of the steps to come, s.
    longest: f64,
    heaviest: f64,
    /// `None` before any particle.
    smallest: Option<f64>,
}

impl Clock {
    /// Length of the step before, s.
    pub fn last_dt(&self) -> f64 {
        self.previous.0
    }

    /// Builds the meshes of regions whose removal is pending.
    #[cfg(feature = "snapshot")]
    pub fn build_edits(&mut self, world: &World) -> Result<()> {
        self.due.iter_mut().chain([&mut self.asked]).try_for_each(|asked| asked.build(world))
    }
}

impl Timeline {
    /// Its present state.
    pub fn clock(&self) -> Clock {
        let Moment { step, time, previous, impulse, softest, brought, .. } = self.now;
        let Moment { poses, progress, .. } = &self.now;
        Clock {
            step,
            time,
            previous,
            impulse,
            softest,
            brought,
            poses: poses.clone(),
            progress: progress.clone(),
            asked: self.asked(),
            due: self.due.iter().cloned().collect(),
            longest: self.settings.dt,
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
        let counts = [clock.poses.len(), clock.progress.len()];
        let expected = [self.colliders.len(), self.emitters.len()];
        check.that(counts == expected, "poses and progress", counts, &format!("{expected:?}"))?;
        // The steps of a frame may be half as long as the shortest that can be requested.
        check.range("previous.dt", clock.previous.0, 0.5 * SHORTEST, LONGEST, "5e-6 to 0.2 s")?;
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
        check.that(clock.due.len() <= MOST_DUE as usize, "due", clock.due.len(), "at most 1024 steps")?;
        let mut next = Timeline { heaviest: clock.heaviest, smallest, ..self.clone() };
        for asked in &clock.due {
            next.grids = next.with_asked(asked, asked.dt.max(SHORTEST))?.grids;
        }
        next = next.with_asked(&clock.asked, clock.longest)?;
        next.due = clock.due.iter().cloned().collect();
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
        };
        Ok(next)
    }
}
