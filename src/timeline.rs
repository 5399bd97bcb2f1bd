//! What a world does over time: step length, gravity and collider poses, in f64, advanced in simulation time. Both
//! solvers draw the inputs of each step from here, so that they step the same world.

pub(crate) mod clock;
pub(crate) mod emission;
mod length;

use crate::collider::Collider;
use crate::emitter::Emitter;
use crate::error::{Check, Result};
use crate::load;
use crate::material::Material;
use crate::math::distance_grid::DistanceGrid;
use crate::math::fixed::{MAX_GRADIENT, Scales};
use crate::math::sdf;
use crate::plan::Needs;
use crate::region::Region;
use crate::settings::{Scheme, Settings};
use crate::shape::{Pose, Shape};
use crate::spawn::Seed;
use crate::tool::{MAX_TOOLS, ScriptedTool, Tool, ToolInput};
use crate::units::{MARGIN, Units};
use crate::world::{Domain, World};
use emission::{Candidate, Edits, Progress};
use glam::{DMat3, DQuat, DVec3};
use std::collections::VecDeque;
use std::sync::Arc;

/// Most distance, in cells, by which a particle found inside a body is moved out in one step. It never becomes velocity.
const PUSH_OUT: f64 = 0.5;
/// Distance, in cells, that particles keep from the domain's sides.
const SIDE_GAP: f64 = 1e-3;

/// Everything a step reads besides the particles, in cell units.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StepInput {
    /// Displacement that gravity adds to the grid in the first iteration.
    pub kick: DVec3,
    /// Factor for displacements and their gradients, because the step length changed; 1 otherwise.
    pub rescale: f64,
    /// What a force adds to a displacement in the step, over its length squared: 1 where the step before was as long.
    pub impulse: f64,
    /// Factor for what particles carry of pressures, as what they add to a displacement.
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
    /// Bounds of particle positions.
    pub lo: DVec3,
    /// See `lo`.
    pub hi: DVec3,
    /// Bit `2·axis + upper` is set where the side is open.
    pub open_sides: u32,
    /// Fixed-point scales.
    pub scales: Scales,
    /// Length of the step, s.
    pub seconds: f64,
    /// The stiffest that liquids are taken for, as the square of their speed of sound, cells per step.
    pub stiffness_limit: f64,
    /// See [`Settings`].
    pub tolerance: f64,
    /// Units of a load per unit of momentum in this step.
    pub load_scale: f64,
    /// The domain's closed sides, then the world's colliders.
    pub colliders: Vec<ColliderInput>,
    /// What is deleted at the end of the step, at rest where it is then.
    pub drains: Vec<ColliderInput>,
    /// Whether the slots of quarantined particles are given back at the end of the step.
    pub release: bool,
    /// Sensors, where they are at the end of the step.
    pub sensors: Vec<ColliderInput>,
    /// What acts on the matter without being a body.
    pub tools: Vec<ToolInput>,
    /// What appears at the end of the step.
    pub candidates: Vec<Candidate>,
    /// What the emitters have come to by then.
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
    /// Of a shape that is known by its distances, the number of the grid.
    pub size: DVec3,
    pub grid: Option<Arc<DistanceGrid>>,
    pub friction: f64,
    /// Columns: the body's axes in the world at the start of the step.
    pub axes: DMat3,
    /// Displacement of the centre in the step.
    pub shift: DVec3,
    /// Rotation of the step minus the identity: the displacement of a point is `shift + turn · (x − position)`.
    pub turn: DMat3,
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
    open_sides: u32,
    extent: DVec3,
    domain: Domain,
    materials: Vec<Material>,
    /// With the indices of their materials.
    emitters: Vec<(Emitter, u32)>,
    drains: Vec<Region>,
    sensors: Vec<Region>,
    scripted: Vec<ScriptedTool>,
    /// Tools of the steps after the one that begins, where they are known: those of steps that were not taken, and at the end
    /// what the host wields since.
    tools_due: VecDeque<Arc<[Tool]>>,
    /// The largest mass of a particle, in mass units.
    heaviest: f64,
    /// Materials differ in density.
    pub volumes: bool,
    /// Length of a step at the start, in which loads are counted, and by which liquids are softened.
    pub first_dt: f64,
    now: Moment,
}

/// What changes from step to step; kept for each step in flight, so that a step that was not taken can be taken again.
#[derive(Debug, Clone)]
pub(crate) struct Moment {
    /// Steps taken.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Step length and gravity of the step before. Before the first step: the length in which the particles' displacements
    /// were written down, and no gravity.
    previous: (f64, DVec3),
    /// [`StepInput::impulse`] of that step.
    impulse: f64,
    pub poses: Vec<Pose>,
    progress: Vec<Progress>,
    /// What the host asked for in the step that begins.
    edits: Arc<Edits>,
    /// What the host wields in it.
    tools: Arc<[Tool]>,
}

impl Moment {
    /// Length of the step before.
    pub fn last_dt(&self) -> f64 {
        self.previous.0
    }
}

impl Timeline {
    pub fn new(world: &World, seeds: &[Seed]) -> Self {
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
            grids: world.distance_grids().map(|grid| Arc::new(grid.scaled(1.0 / units.cell_size))).collect(),
            domain: world.domain,
            materials: world.materials.clone(),
            emitters: world.emitters.iter().map(|e| (e.clone(), index(e))).collect(),
            drains: world.drains.clone(),
            sensors: world.sensors.clone(),
            scripted: world.tools.clone(),
            tools_due: VecDeque::new(),
            heaviest: 0.0,
            volumes: world.materials.iter().any(|m| m.rest_density != world.materials[0].rest_density),
            sides,
            open_sides,
            extent: world.domain.extent_cells(),
            first_dt: world.settings.dt,
            now: Moment {
                step: 0,
                time: 0.0,
                previous: (world.settings.dt, DVec3::ZERO),
                impulse: 1.0,
                poses: world.colliders.iter().map(Collider::pose).collect(),
                progress: vec![Progress::default(); world.emitters.len()],
                edits: Arc::default(),
                tools: Arc::default(),
            },
        };
        timeline.expect_masses(seeds);
        timeline
    }

    pub fn now(&self) -> &Moment {
        &self.now
    }

    /// Goes back to the first of these moments, whose steps were not taken. What the host asked for in the steps after that one, and
    /// since, is done in it; tools are wielded again step by step.
    pub fn restore<'m>(&mut self, untaken: impl IntoIterator<Item = &'m Moment>) {
        let mut untaken = untaken.into_iter();
        let Some(first) = untaken.next() else { return };
        let last = std::mem::replace(&mut self.now, first.clone());
        let mut after: Vec<&Moment> = untaken.collect();
        after.push(&last);
        for moment in after.iter().rev() {
            self.tools_due.push_front(moment.tools.clone());
        }
        let later: Vec<_> = after.iter().map(|moment| &moment.edits).filter(|e| !e.is_empty()).collect();
        if !later.is_empty() {
            let edits = Arc::make_mut(&mut self.now.edits);
            for more in later {
                more.placed.iter().for_each(|(i, pose)| self.now.poses[*i] = *pose);
                edits.then(more);
            }
        }
    }

    /// What the host wields from now on, in place of what it did.
    pub fn set_tools(&mut self, tools: &[Tool]) -> Result<()> {
        let check = Check { path: "" };
        check.that(tools.len() <= MAX_TOOLS, "tools", tools.len(), "at most 16 tools")?;
        tools.iter().enumerate().try_for_each(|(i, tool)| tool.validate(&format!("tools[{i}]")))?;
        *self.tools_due.back_mut().unwrap_or(&mut self.now.tools) = tools.into();
        Ok(())
    }

    /// Whether the world has tools of its own.
    pub fn has_tools(&self) -> bool {
        !self.scripted.is_empty()
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
        if let Some(pose) = pose {
            self.now.poses[index] = pose;
            Arc::make_mut(&mut self.now.edits).placed.push((index, pose));
        }
        self.colliders[index] = changed;
        Ok(())
    }

    /// The inputs of the step that begins now.
    pub fn input(&self) -> StepInput {
        let dt = self.dt;
        let half = |dt: f64, gravity: DVec3| self.units.acceleration_in(gravity, dt) * 0.5;
        let next = half(dt, self.gravity);
        // Half a step's gravity ends the previous step, half begins this one, so that a parabola is met exactly.
        let (before, gravity) = self.now.previous;
        let rescale = dt / before;
        let kick = half(before, gravity) * rescale + next;
        // As gravity's: a force acts from the middle of the step before to that of this one.
        let impulse = 0.5 + 0.5 / rescale;
        let (candidates, progress) = self.candidates();
        let scripted = self.scripted.iter().filter_map(|t| ToolInput::scripted(t, self.now.time, dt, &self.units));
        let wielded = self.now.tools.iter().map(|t| ToolInput::wielded(t, dt, &self.units));
        let bodies = self.colliders.iter().zip(&self.now.poses).zip(load::places(&self.colliders));
        let bodies = bodies.map(|((c, pose), load)| self.collider_input(c, pose, load));
        let colliders = self.sides.iter().cloned().chain(bodies);
        StepInput {
            kick,
            rescale,
            impulse,
            pressure_rescale: rescale * rescale * (impulse / self.now.impulse),
            max_displacement: self.settings.max_displacement,
            max_gradient: MAX_GRADIENT,
            volume_gain: 1.0 - (-dt / self.settings.volume_correction_time).exp(),
            tension_limit: self.settings.tension_limit,
            push_out: PUSH_OUT,
            lo: DVec3::splat(MARGIN + SIDE_GAP),
            hi: DVec3::splat(MARGIN - SIDE_GAP) + self.extent,
            open_sides: self.open_sides,
            scales: self.scales,
            seconds: dt,
            stiffness_limit: self.stiffness_limit() * impulse,
            tolerance: self.settings.tolerance,
            load_scale: load::SCALE * (self.first_dt / dt),
            colliders: colliders.collect(),
            drains: self.drained(),
            release: self.now.edits.release,
            sensors: self.sensed(),
            tools: scripted.chain(wielded).collect(),
            candidates,
            progress,
        }
    }

    /// Which passes the step with these inputs needs.
    pub fn needs(&self, input: &StepInput) -> Needs {
        Needs {
            scheme: self.settings.scheme,
            iterations: self.settings.iterations,
            colliders: !input.colliders.is_empty(),
            rescale: input.rescale != 1.0
                || (self.settings.scheme == Scheme::Implicit && input.pressure_rescale != 1.0),
            volumes: self.volumes,
            drains: !input.drains.is_empty() || input.release,
            sensors: !input.sensors.is_empty(),
            emission: !input.candidates.is_empty(),
        }
    }

    /// Moves on by the step that begins now and has these inputs.
    pub fn advance(&mut self, input: &StepInput) {
        let dt = self.dt;
        let end = self.now.time + dt;
        for (pose, c) in self.now.poses.iter_mut().zip(&self.colliders) {
            *pose = match &c.motion {
                Some(motion) => motion.pose(&c.stated_pose(), end),
                None => pose.advanced(c.linear_velocity, c.angular_velocity, dt),
            };
        }
        self.now.previous = (dt, self.gravity);
        self.now.impulse = input.impulse;
        self.now.step += 1;
        self.now.time = end;
        self.now.progress.clone_from(&input.progress);
        self.now.edits = Arc::default();
        if let Some(known) = self.tools_due.pop_front() {
            self.now.tools = known;
        } else if !self.now.tools.is_empty() {
            let moved = |tool: &Tool| Tool { position: tool.position + tool.velocity * dt, ..*tool };
            self.now.tools = self.now.tools.iter().map(moved).collect();
        }
    }

    fn collider_input(&self, collider: &Collider, pose: &Pose, load: u32) -> ColliderInput {
        let dt = self.dt;
        let (shift, turn) = match &collider.motion {
            Some(motion) => {
                let end = motion.pose(&collider.stated_pose(), self.now.time + dt);
                let turn = end.rotation * pose.rotation.inverse();
                // A body that does not turn is to be known by zeros, without rounding.
                let turn = if end.rotation == pose.rotation { DQuat::IDENTITY } else { turn.normalize() };
                ((end.position - pose.position) / self.units.cell_size, turn)
            }
            None => (
                self.units.velocity_in(collider.linear_velocity, dt),
                DQuat::from_scaled_axis(collider.angular_velocity * dt),
            ),
        };
        ColliderInput {
            load,
            friction: collider.boundary.coefficient(),
            shift,
            turn: DMat3::from_quat(turn) - DMat3::IDENTITY,
            ..self.body(&collider.shape, collider.inverted, pose)
        }
    }

    /// A frictionless body at rest.
    fn body(&self, shape: &Shape, inverted: bool, pose: &Pose) -> ColliderInput {
        let (kind, size) = match *shape {
            Shape::Mesh(_) | Shape::Heightfield(_) => (sdf::GRID, DVec3::ZERO),
            Shape::Box { half_size } => (sdf::BOX, half_size),
            Shape::Sphere { radius } => (sdf::SPHERE, DVec3::splat(radius)),
            Shape::Capsule { radius, half_height } => (sdf::CAPSULE, DVec3::new(radius, half_height, radius)),
            Shape::Cylinder { radius, half_height } => (sdf::CYLINDER, DVec3::new(radius, half_height, radius)),
            Shape::HalfSpace => (sdf::HALF_SPACE, DVec3::ZERO),
        };
        let grid = shape.grid().and_then(|grid| {
            let known = |(_, known): &(usize, &Arc<DistanceGrid>)| Arc::ptr_eq(&known.values, &grid.values);
            self.grids.iter().enumerate().find(known)
        });
        ColliderInput {
            kind: if inverted { kind | sdf::INVERTED } else { kind },
            load: load::NONE,
            position: self.units.position_in(pose.position),
            size: grid.map_or(size / self.units.cell_size, |(number, _)| DVec3::X * number as f64),
            grid: grid.map(|(_, grid)| grid.clone()),
            friction: 0.0,
            axes: DMat3::from_quat(pose.rotation.normalize()),
            shift: DVec3::ZERO,
            turn: DMat3::ZERO,
        }
    }
}

/// The domain's closed sides as half-spaces, and the mask of the open ones.
fn sides(world: &World) -> (Vec<ColliderInput>, u32) {
    let extent = world.domain.extent_cells();
    let mut open = 0;
    let mut closed = Vec::new();
    for (axis, upper, wall, _) in world.domain.walls.sides() {
        let Some(boundary) = wall.boundary() else {
            open |= 1 << (2 * axis + usize::from(upper));
            continue;
        };
        let mut normal = DVec3::ZERO;
        normal[axis] = if upper { -1.0 } else { 1.0 };
        let position = DVec3::splat(MARGIN) + if upper { extent } else { DVec3::ZERO };
        closed.push(ColliderInput {
            kind: sdf::HALF_SPACE,
            load: load::NONE,
            position,
            size: DVec3::ZERO,
            grid: None,
            friction: boundary.coefficient(),
            axes: DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Y, normal)),
            shift: DVec3::ZERO,
            turn: DMat3::ZERO,
        });
    }
    (closed, open)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Motion;

    /// The motion that a step is told of leads from the pose at its beginning to that at its end, scripted or not, for steps of
    /// any lengths.
    #[test]
    fn steps_lead_from_pose_to_pose() {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
        let steady = Collider {
            linear_velocity: DVec3::new(0.3, 0.1, -0.2),
            angular_velocity: DVec3::new(2.0, -1.0, 0.5),
            ..Collider::new(Shape::Sphere { radius: 0.1 }, DVec3::splat(0.5))
        };
        let still = Collider::new(Shape::Sphere { radius: 0.1 }, DVec3::splat(0.4));
        let rotation = DQuat::from_rotation_x(0.4);
        let oscillate = Motion::Oscillate {
            amplitude: DVec3::new(0.1, 0.2, 0.0),
            frequency: 1.5,
            phase: 0.1,
            angular_amplitude: DVec3::new(0.0, 2.0, 1.0),
        };
        let turns = [0.0, 1.5, 3.0].map(DQuat::from_rotation_z);
        let keyframes = |rotations: &[DQuat]| Motion::Keyframes {
            times: vec![0.05, 0.11, 0.3],
            positions: vec![DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1],
            rotations: rotations.to_vec(),
            repeat: false,
        };
        world.colliders = vec![
            steady,
            Collider { motion: Some(oscillate), rotation, ..still.clone() },
            Collider { motion: Some(keyframes(&turns)), rotation, ..still.clone() },
            Collider { motion: Some(keyframes(&[])), rotation, inverted: true, ..still },
        ];
        let mut timeline = Timeline::new(&world, &[]);
        for (k, dt) in [0.01, 0.013, 0.002, 0.03].into_iter().cycle().take(30).enumerate() {
            timeline.set_dt(dt).unwrap();
            let (input, before) = (timeline.input(), timeline.now().poses.clone());
            timeline.advance(&input);
            let now = timeline.now();
            for (i, c) in input.colliders.iter().skip(6).enumerate() {
                let position = timeline.units.position_out(c.position + c.shift);
                assert!(position.distance(now.poses[i].position) < 1e-12, "body {i}, step {k}");
                let axes = (c.turn + DMat3::IDENTITY) * c.axes - DMat3::from_quat(now.poses[i].rotation);
                assert!(axes.to_cols_array().iter().all(|x| x.abs() < 1e-12), "body {i}, step {k}");
                assert!(i != 3 || c.turn == DMat3::ZERO, "what does not turn has no turn");
                if let Some(motion) = &world.colliders[i].motion {
                    let exact = motion.pose(&world.colliders[i].stated_pose(), now.time);
                    assert_eq!(exact, now.poses[i], "body {i}, step {k}");
                }
            }
            assert!(before != now.poses);
        }
        // What a host says of a body ends its script, from where the body is.
        let at = timeline.now().poses[1];
        timeline.set_collider(1, None, DVec3::X, DVec3::ZERO).unwrap();
        let input = timeline.input();
        timeline.advance(&input);
        let moved = timeline.now().poses[1];
        assert!(moved.position.distance(at.position + DVec3::X * timeline.dt) < 1e-12);
        assert!(moved.rotation.angle_between(at.rotation) < 1e-7);
    }
}
