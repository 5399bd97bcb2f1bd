//! What a host asks of the GPU solver between steps: their length, gravity, bodies, matter, emission and tools.

use super::layout::Sizes;
use super::{GpuSolver, requirements};
use crate::emitter::Rate;
use crate::error::Result;
use crate::region::Region;
use crate::shape::Pose;
use crate::spawn::Spawn;
use crate::tool::Tool;
use glam::DVec3;

impl GpuSolver {
    /// Changes the length of the steps to come, s, and the longest step that frames are divided into; velocities stay.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) outside 1e-5 … 0.2, if a collider would turn more than half a turn, or
    /// if the step is too long for the scheme ([`Settings::dt`](crate::Settings::dt)).
    pub fn set_dt(&mut self, dt: f64) -> Result<()> {
        self.timeline.set_dt(dt)
    }

    /// Divides a frame of `frame` seconds into equal steps by [`Settings::substeps`](crate::Settings::substeps), with
    /// the largest speed in the newest report that has arrived. The steps to come have that length; returns how many of
    /// them to record: those that make up the frame, one at least unless `frame` is 0, or fewer where the
    /// [ring](crate::GpuOptions::steps_in_flight) has no room for so many. The rest of such a frame is left out, so
    /// that the matter moves more slowly rather than the device falling further behind. Steps that have to be
    /// [taken again](Self::encode_step) come first, as long as they were, and count for the frame. With frames in flight
    /// the report is as old as they are. Where there is no room and nothing on its way that would tell of any, it is one
    /// step, and `encode_step` fails. A program that measures its frames has to bound them, say to 1e-3 … 0.1 s, lest
    /// each take longer than the one before.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) unless `frame` is 0 or 1e-5 … 60;
    /// [`Error::StepsLost`](crate::Error::StepsLost) and [`Error::Device`](crate::Error::Device) as
    /// [`encode_step`](Self::encode_step).
    pub fn plan_frame(&mut self, frame: f64) -> Result<u32> {
        self.learn()?;
        let mut room = u64::from(self.options.steps_in_flight).saturating_sub(self.flight.unfinished());
        if room == 0 && !self.readback.on_its_way() {
            // The copies that would have made room were dropped with their steps: a call of `encode_step` records
            // another, and says so. Without it nothing would ever change.
            room = 1;
        }
        Ok(self.divide_frame(frame)?.min(room as u32))
    }

    /// The same for a caller that waits for the ring to have room.
    pub(crate) fn divide_frame(&mut self, frame: f64) -> Result<u32> {
        // What has appeared since the report, and in its step, moves all the same.
        let since = self.flight.from(self.report.step).map(|beginning| beginning.moment.brought);
        let speed = since.fold(self.report.max_speed, f64::max);
        self.timeline.plan_frame(frame, speed)
    }

    /// Changes gravity for the steps to come, m/s². Step and stiffness stay those that a
    /// [`Quality`](crate::Quality) has chosen for the world's gravity: make the world with the strongest that will act.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) unless finite and at most 1e6, or if the steps are too long for it
    /// ([`Settings::dt`](crate::Settings::dt)).
    pub fn set_gravity(&mut self, gravity: DVec3) -> Result<()> {
        self.timeline.set_gravity(gravity)
    }

    /// Changes a collider's motion from the next step on: its pose, if one is given, its velocity (m/s) and its angular
    /// velocity (rad/s). A [`Motion`](crate::Motion) of the collider ends for good; without a pose the collider
    /// continues from where it is. A pose is a jump, which carries no matter along: for a body that goes from a to b
    /// within a frame, state the pose a and the velocity (b − a) over the frame's time.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if there is no such collider or a value is out of range.
    pub fn set_collider(&mut self, index: usize, pose: Option<Pose>, linear: DVec3, angular: DVec3) -> Result<()> {
        self.timeline.set_collider(index, pose, linear, angular)
    }

    /// Adds the particles of `spawn` at the end of the next step, with the velocity that the spawn states for that
    /// time, whether or not their places are taken, except those that would then be inside a body. Returns how many are
    /// asked for. Of these, the ones in whose places a body is set before the step are withheld
    /// ([`StepReport::withheld`](crate::StepReport::withheld)). Those for which no slot is free then are not made and
    /// counted in [`Faults::refused`](crate::Faults::refused): where [`Settings::capacity`](crate::Settings::capacity)
    /// is not stated, there are no slots beyond what is spawned and emitted. The first use while a world runs compiles
    /// pipelines.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if the spawn is not valid in this world, any of its particles is outside
    /// the domain, or there are more, together with those already to be added in that step, than the
    /// [capacity](crate::Settings::capacity); [`Error::Unsupported`](crate::Error::Unsupported) if they need larger
    /// buffers than the device has. Then none is added.
    pub fn add(&mut self, spawn: &Spawn) -> Result<usize> {
        let (limits, sizes) = (self.device.limits(), self.sizes);
        self.timeline.add(spawn, sizes.particles as usize, |count| {
            requirements::check(&limits, &Sizes { candidates: count as u32, ..sizes })
        })
    }

    /// Deletes what is in `region` at the end of the next step, before anything is added there. The first use while a
    /// world runs compiles a pipeline, and so does a shape that is new.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if the region is not valid, [`MAX_REGIONS`](crate::MAX_REGIONS) are to
    /// be emptied in that step already, or there are [`MAX_MESHES`](crate::MAX_MESHES) different meshes already, those
    /// of regions emptied so far included; [`Error::Unsupported`](crate::Error::Unsupported) if its mesh does not fit the
    /// device.
    pub fn remove(&mut self, region: &Region) -> Result<()> {
        let (limits, sizes) = (self.device.limits(), self.sizes);
        self.timeline.remove(region, |grids| requirements::check(&limits, &sizes.with_grids(grids)))
    }

    /// Frees the slots of quarantined particles at the end of the next step, before anything is added; if their state
    /// is of interest, read it before. [`Faults::quarantined`](crate::Faults::quarantined) goes on counting them. The
    /// first use in a world without drains compiles a pipeline.
    pub fn release_quarantined(&mut self) {
        self.timeline.release_quarantined();
    }

    /// Changes the rate of an emitter, counted from 0 in the order of the world, from the next step on. The slots that
    /// there are do not change: without a stated [`Settings::capacity`](crate::Settings::capacity) they follow from the
    /// rates at the start.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if there is no such emitter, the rate is out of range, or all
    /// emitters together would emit more than 1e7 particles per second.
    pub fn set_emission(&mut self, emitter: usize, rate: Rate) -> Result<()> {
        self.timeline.set_emission(emitter, rate)
    }

    /// Replaces the host's tools from the next recorded step on; the world's own tools stay beside them. They act until
    /// they are replaced, and each moves on by its velocity from step to step. The first use in a world without tools
    /// compiles a pipeline.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if there are more than [`MAX_TOOLS`](crate::MAX_TOOLS) or one is not
    /// valid.
    pub fn set_tools(&mut self, tools: &[Tool]) -> Result<()> {
        self.timeline.set_tools(tools)
    }
}
