//! How a world develops over time: step length, gravity and collider poses, in f64, advanced in simulation time. Both
//! solvers draw the inputs of each step from here, so that they step the same world.

pub(crate) mod asked;
mod bodies;
pub(crate) mod clock;
pub(crate) mod disturbance;
mod edits;
pub(crate) mod emission;
mod joints;
mod length;

use crate::collider::Collider;
use crate::domain::Domain;
use crate::emitter::Emitter;
use crate::error::{Check, Result};
use crate::features::Features;
use crate::load;
use crate::material::Material;
use crate::math::distance_grid::DistanceGrid;
use crate::math::fixed::{MAX_GRADIENT, Scales};
use crate::plan::Needs;
use crate::region::Region;
use crate::settings::{Scheme, Settings};
use crate::shape::Pose;
use crate::spawn::Seed;
use crate::stages::matter::CLEARANCE;
use crate::stages::walls::FAR;
use crate::tool::{MAX_TOOLS, ScriptedTool, Tool, ToolInput};
use crate::units::{MARGIN, Units, lower_corner};
use crate::world::World;
use asked::Asked;
use bodies::sides;
use disturbance::{Bounds, SleepInput};
use edits::Edits;
use emission::{Candidate, Progress};
use glam::{DMat3, DVec3};
use joints::Joints;
use std::collections::VecDeque;
use std::sync::Arc;

/// The largest distance, in cells, by which a particle found inside a body is moved out in one step. It never becomes
/// velocity.
const PUSH_OUT: f64 = 0.5;

/// Everything a step reads besides the particles, in cell units.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StepInput {
    /// Displacement that gravity adds to the grid in the first iteration.
    pub kick: DVec3,
    /// Factor for displacements and their gradients, because the step length changed; 1 otherwise.
    pub rescale: f64,
    /// What a force adds to a displacement in the step, over the square of the step's length: 1 where the step before
    /// was as long.
    pub impulse: f64,
    /// Factor for the pressures that particles carry, in the unit of what they add to a displacement.
    pub pressure_rescale: f64,
    /// Largest particle displacement.
    pub max_displacement: f64,
    /// Largest Frobenius norm of a scattered displacement gradient.
    pub max_gradient: f64,
    /// Share by which the carried volume ratio moves to the measured one.
    pub volume_gain: f64,
    /// Volume ratio above which a liquid does not resist being stretched.
    pub tension_limit: f64,
    /// Largest push out of a body.
    pub push_out: f64,
    /// Bounds of particle positions; out of reach along periodic axes.
    pub lo: DVec3,
    /// See `lo`.
    pub hi: DVec3,
    /// Lengths along the axes after which matter is repeated; 0 where it is not.
    pub period: DVec3,
    /// Bit `2·axis + upper` is set where the side is open.
    pub open_sides: u32,
    /// Fixed-point scales.
    pub scales: Scales,
    /// Length of the step, s.
    pub seconds: f64,
    /// Largest stiffness of liquids, as the square of their speed of sound in cells per step.
    pub stiffness_limit: f64,
    /// The stiffness of liquids to the mean compression of a block, likewise; 0 where blocks share no pressure.
    pub block_stiffness: f64,
    /// See [`Settings`].
    pub tolerance: f64,
    /// Units of a load per unit of momentum in this step.
    pub load_scale: f64,
    /// Mass of a cell of the lightest material at rest, in mass units.
    pub lightest: f64,
    /// The domain's closed sides, then the world's colliders.
    pub colliders: Vec<ColliderInput>,
    /// Regions that are emptied at the end of the step, at rest where they are then.
    pub drains: Vec<ColliderInput>,
    /// Whether the slots of quarantined particles are given back at the end of the step.
    pub release: bool,
    /// Sensors, where they are at the end of the step.
    pub sensors: Vec<ColliderInput>,
    /// Tools at work in the step.
    pub tools: Vec<ToolInput>,
    /// Inputs of the decision about sleep, where matter may sleep.
    pub sleep: Option<SleepInput>,
    /// Particles that may appear at the end of the step.
    pub candidates: Vec<Candidate>,
    /// The emitters' progress by then.
    progress: Vec<Progress>,
}

/// A collider during one step, in cell units.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ColliderInput {
    pub kind: u32,
    /// Place of its load, or [`load::NONE`].
    pub load: u32,
    /// Centre at the start of the step.
    pub position: DVec3,
    /// For a shape that is given by distances, the number of the grid.
    pub size: DVec3,
    pub grid: Option<Arc<DistanceGrid>>,
    pub friction: f64,
    /// Columns: the body's axes in the world at the start of the step.
    pub axes: DMat3,
    /// Displacement of the centre in the step.
    pub shift: DVec3,
    /// Rotation of the step minus the identity: the displacement of a point is `shift + turn · (x − position)`.
    pub turn: DMat3,
    /// Its [faces that go through nodes](crate::stages::faces); 0 for the domain's sides.
    pub faces: u32,
    /// Its [joints](crate::stages::joint), for a box.
    pub joints: u32,
}

/// The state of a world's clock and bodies.
#[derive(Debug, Clone)]
pub(crate) struct Timeline {
    /// As it was stated.
    pub world: Arc<World>,
    pub units: Units,
    pub scales: Scales,
    pub settings: Settings,
    /// Length of the steps to come, s: at most the settings'.
    pub dt: f64,
    pub gravity: DVec3,
    colliders: Vec<Collider>,
    /// The distance grids of the colliders in cells, each once.
    pub grids: Vec<Arc<DistanceGrid>>,
    sides: Vec<ColliderInput>,
    joints: Joints,
    open_sides: u32,
    extent: DVec3,
    period: DVec3,
    domain: Domain,
    materials: Vec<Material>,
    /// Indices of the materials that take part.
    present: Vec<usize>,
    /// The slowest sound in a liquid that no setting softens, m/s; infinite without liquids.
    liquid_sound: f64,
    /// With the indices of their materials.
    emitters: Vec<(Emitter, u32)>,
    drains: Vec<Region>,
    sensors: Vec<Region>,
    scripted: Vec<ScriptedTool>,
    /// The host's tools and requests for the step that begins or, where steps are due, for the one after these.
    tools: Arc<[Tool]>,
    edits: Arc<Edits>,
    /// Steps that have to be taken again, as they were asked for, before anything else.
    due: VecDeque<Asked>,
    /// The largest mass of a particle in mass units, or volume in cells, whichever is more.
    heaviest: f64,
    /// The least mass of a particle of the world's or of a host's, in mass units.
    smallest: f64,
    pub features: Features,
    /// Along each axis the cells of matter that may come to lie beside each other.
    deepest: DVec3,
    /// Length of a step at the start, in which loads are counted, and by which liquids are softened.
    pub first_dt: f64,
    now: Moment,
}

/// What changes from step to step by itself.
#[derive(Debug, Clone)]
pub(crate) struct Moment {
    /// Steps taken.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Length and gravity of the step before. Before the first step: the length that the particles' initial
    /// displacements refer to, and no gravity.
    previous: (f64, DVec3),
    /// [`StepInput::impulse`] of that step.
    impulse: f64,
    /// The longest recent step, s: liquids stay as soft as in it, and recover from step to step (`length::RECOVERY`).
    softest: f64,
    /// The largest speed of particles that appeared at the end of the step before, m/s. That step's own report does not
    /// know them.
    pub brought: f64,
    pub poses: Vec<Pose>,
    progress: Vec<Progress>,
}

impl Moment {
    /// Length of the step before.
    pub fn last_dt(&self) -> f64 {
        self.previous.0
    }
}

impl Timeline {
    pub fn new(world: &World, seeds: &[Seed]) -> Result<Self> {
        let settings = world.settings.clone();
        let (sides, open_sides) = sides(world);
        let index = |e: &Emitter| world.materials.iter().position(|m| m.name == e.material).unwrap_or(0) as u32;
        let units = Units::new(world);
        let mut timeline = Timeline {
            world: Arc::new(world.clone()),
            scales: Scales::new(0.0, settings.max_fill, settings.max_displacement),
            units,
            dt: settings.dt,
            settings,
            gravity: world.gravity,
            colliders: world.colliders.clone(),
            grids: world.distance_grids().map(|grid| Arc::new(grid.scaled(units.length_in(1.0)))).collect(),
            domain: world.domain,
            materials: world.materials.iter().map(|m| world.settings.softened(m)).collect(),
            present: world.taking_part().map(|(i, _)| i).collect(),
            liquid_sound: world.liquids().map(Material::sound).fold(f64::INFINITY, f64::min),
            emitters: world.emitters.iter().map(|e| (e.clone(), index(e))).collect(),
            drains: world.drains.clone(),
            sensors: world.sensors.clone(),
            scripted: world.tools.clone(),
            tools: Arc::default(),
            edits: Arc::default(),
            due: VecDeque::new(),
            heaviest: 0.0,
            smallest: f64::INFINITY,
            features: Features::of(world),
            deepest: world.deepest(),
            sides,
            joints: Joints::default(),
            open_sides,
            extent: world.domain.extent_cells(),
            period: world.domain.period_cells(),
            first_dt: world.settings.dt,
            now: Moment {
                step: 0,
                time: 0.0,
                previous: (world.settings.dt, DVec3::ZERO),
                impulse: 1.0,
                softest: world.settings.dt,
                brought: 0.0,
                poses: world.colliders.iter().map(Collider::pose).collect(),
                progress: vec![Progress::default(); world.emitters.len()],
            },
        };
        timeline.expect_masses(seeds)?;
        Ok(timeline)
    }

    pub fn now(&self) -> &Moment {
        &self.now
    }

    /// Replaces the host's tools from now on.
    pub fn set_tools(&mut self, tools: &[Tool]) -> Result<()> {
        let check = Check { path: "" };
        check.that(tools.len() <= MAX_TOOLS, "tools", tools.len(), "at most 16 tools")?;
        tools.iter().enumerate().try_for_each(|(i, tool)| tool.validate(&format!("tools[{i}]")))?;
        self.tools = tools.into();
        Ok(())
    }

    /// Whether the world has tools of its own.
    pub fn has_tools(&self) -> bool {
        !self.scripted.is_empty()
    }

    /// The upper bound of particle positions, in cells.
    pub fn hi(&self) -> DVec3 {
        lower_corner(self.period) - CLEARANCE + self.extent
    }

    /// Length of the step that made the present displacements.
    pub fn last_dt(&self) -> f64 {
        self.now.last_dt()
    }

    /// How many colliders a step has, sides included.
    pub fn collider_count(&self) -> usize {
        self.sides.len() + self.colliders.len()
    }

    pub fn set_gravity(&mut self, gravity: DVec3) -> Result<()> {
        Check { path: "" }.vector("gravity", gravity, 1e6, "finite, at most 1e6 m/s²")?;
        self.settings.check_stable(self.taking_part(), self.units.cell_size, gravity)?;
        self.gravity = gravity;
        Ok(())
    }

    /// Replaces a collider's motion, scripted or not, and its pose if one is given.
    pub fn set_collider(&mut self, index: usize, pose: Option<Pose>, linear: DVec3, angular: DVec3) -> Result<()> {
        let count = self.colliders.len();
        Check { path: "" }.that(index < count, "collider", index, &format!("below the world's {count} colliders"))?;
        let mut changed = self.colliders[index].clone();
        changed.motion = None;
        changed.linear_velocity = linear;
        changed.angular_velocity = angular;
        if let Some(pose) = pose {
            changed.position = pose.position;
            changed.rotation = pose.rotation;
        }
        changed.validate(&format!("colliders[{index}]"))?;
        changed.check_turn(&format!("colliders[{index}]"), self.settings.dt)?;
        if pose.is_some() {
            let pose = changed.stated_pose();
            let edits = Arc::make_mut(&mut self.edits);
            let first = edits.place(index, pose);
            if self.due.is_empty() {
                let before = std::mem::replace(&mut self.now.poses[index], pose);
                if first {
                    edits.disturbed.push(Bounds::of_shape(&changed.shape, changed.inverted, &before));
                }
            }
        }
        self.colliders[index] = changed;
        Ok(())
    }

    /// The inputs of the step that begins now.
    pub fn input(&self) -> StepInput {
        self.due.front().map_or_else(|| self.present_input(), |asked| self.as_asked(asked).present_input())
    }

    /// Those of the step that the host's present requests are for.
    fn present_input(&self) -> StepInput {
        let dt = self.dt;
        let half = |dt: f64, gravity: DVec3| self.units.acceleration_in(gravity, dt) * 0.5;
        let next = half(dt, self.gravity);
        // Half a step's gravity ends the previous step, half begins this one, so that a ballistic parabola is exact.
        let (before, gravity) = self.now.previous;
        let rescale = dt / before;
        let kick = half(before, gravity) * rescale + next;
        // As with gravity, a force acts from the middle of the step before to that of this one.
        let impulse = 0.5 + 0.5 / rescale;
        let (candidates, progress) = self.candidates();
        let bodies = self.colliders.iter().zip(&self.now.poses).zip(load::places(&self.colliders));
        let bodies = bodies.map(|((c, pose), load)| self.collider_input(c, pose, load));
        let bodies: Vec<_> = bodies.collect();
        let tools: Vec<_> = self.wielded().collect();
        let sleep = self.sleep(&bodies, &tools);
        let mut colliders: Vec<_> = self.sides.iter().cloned().chain(bodies).collect();
        self.joints.note(&mut colliders);
        let periodic = self.period.cmpgt(DVec3::ZERO);
        StepInput {
            kick,
            rescale,
            impulse,
            pressure_rescale: if self.settings.scheme == Scheme::Implicit {
                rescale * rescale * (impulse / self.now.impulse)
            } else {
                1.0
            },
            max_displacement: self.settings.max_displacement,
            max_gradient: MAX_GRADIENT,
            volume_gain: 1.0 - (-dt / self.settings.volume_correction_time).exp(),
            tension_limit: self.settings.tension_limit,
            push_out: PUSH_OUT,
            lo: DVec3::select(periodic, DVec3::splat(-FAR), DVec3::splat(MARGIN + CLEARANCE)),
            hi: DVec3::select(periodic, DVec3::splat(FAR), self.hi()),
            period: self.period,
            open_sides: self.open_sides,
            scales: self.scales,
            seconds: dt,
            stiffness_limit: self.stiffness_limit() * impulse,
            block_stiffness: self.block_stiffness() * impulse,
            tolerance: self.tolerance(),
            load_scale: load::SCALE * (self.first_dt / dt),
            lightest: self.lightest(),
            colliders,
            drains: self.drained(),
            release: self.edits.release,
            sensors: self.sensed(),
            tools,
            sleep,
            candidates,
            progress,
        }
    }

    /// The materials that take part, as limited by the settings, with their indices.
    fn taking_part(&self) -> impl Iterator<Item = (usize, &Material)> {
        self.present.iter().map(|&i| (i, &self.materials[i]))
    }

    /// Mass of a cell of the lightest material at rest, in mass units.
    fn lightest(&self) -> f64 {
        let densities = self.taking_part().map(|(_, material)| self.units.density_in(material.rest_density));
        densities.fold(1.0, f64::min)
    }

    /// The tools that are at work in the step that begins.
    fn wielded(&self) -> impl Iterator<Item = ToolInput> {
        let scripted = self.scripted.iter().filter_map(|t| ToolInput::scripted(t, self.now.time, self.dt, &self.units));
        scripted.chain(self.tools.iter().map(|t| ToolInput::wielded(t, self.dt, &self.units)))
    }

    /// Where a body that is at `pose` now is at the end of the step that begins.
    fn end_pose(&self, collider: &Collider, pose: &Pose) -> Pose {
        match &collider.motion {
            Some(motion) => motion.pose(&collider.stated_pose(), self.now.time + self.dt),
            None => pose.advanced(collider.linear_velocity, collider.angular_velocity, self.dt),
        }
    }

    /// Where the bodies that are at these poses are then.
    fn end_poses(&self, poses: &[Pose]) -> Vec<Pose> {
        self.colliders.iter().zip(poses).map(|(collider, pose)| self.end_pose(collider, pose)).collect()
    }

    /// Which passes the step with these inputs needs.
    pub fn needs(&self, input: &StepInput) -> Needs {
        Needs {
            features: self.features,
            iterations: self.settings.iterations,
            colliders: !input.colliders.is_empty(),
            rescale: input.rescale != 1.0 || input.pressure_rescale != 1.0,
            drains: !input.drains.is_empty() || input.release,
            sensors: !input.sensors.is_empty(),
            fused: false,
            emission: !input.candidates.is_empty(),
        }
    }

    /// Moves on by the step that begins now and has these inputs.
    pub fn advance(&mut self, input: &StepInput) {
        let Some(asked) = self.due.pop_front() else {
            self.advance_present(input);
            return;
        };
        let mut step = self.as_asked(&asked);
        step.advance_present(input);
        (self.now, self.joints) = (step.now, step.joints);
        self.place_bodies();
    }

    fn advance_present(&mut self, input: &StepInput) {
        let dt = self.dt;
        let end = self.now.time + dt;
        if !self.joints.are_of(&input.colliders) {
            self.joints = Joints::of(&input.colliders);
        }
        self.now.poses = self.end_poses(&self.now.poses);
        self.now.previous = (dt, self.gravity);
        self.now.impulse = input.impulse;
        self.now.softest = self.softest() * length::RECOVERY;
        self.now.brought = self.appearing_speed(&input.candidates);
        self.now.step += 1;
        self.now.time = end;
        self.now.progress.clone_from(&input.progress);
        self.edits = Arc::default();
        if !self.tools.is_empty() {
            let moved = |tool: &Tool| Tool { position: tool.position + tool.velocity * dt, ..*tool };
            self.tools = self.tools.iter().map(moved).collect();
        }
    }
}
