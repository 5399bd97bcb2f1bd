//! Tools: what pushes, attracts, grabs or stirs the matter within a radius, without being a body.

use crate::error::{Check, Result};
use crate::motion::{Motion, validate_placement};
use crate::shape::{MAX_LENGTH, Pose};
use crate::units::Units;
use glam::{DQuat, DVec3};

/// The most tools that a world may have at work at a time, and the most that a host may.
pub const MAX_TOOLS: usize = 16;
/// The largest acceleration, m/s².
const MAX_ACCELERATION: f64 = 1e6;

/// What a tool does to the matter around it. Every action is strongest at the centre and falls smoothly to nothing at
/// the radius r: at distance d it is weighted by (1 − d²/r²)². A moving tool acts along the whole of its path in a
/// step, however fast it is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum Action {
    /// Accelerates.
    Push {
        /// m/s². At most 1e6 on each axis.
        #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
        acceleration: DVec3,
    },
    /// Accelerates along the tool's own motion; at rest it does nothing.
    Sweep {
        /// m/s². At most 1e6 in size; below 0 against the motion.
        acceleration: f64,
    },
    /// Accelerates towards the centre; within a tenth of the radius this fades, by the factor r/√(r² + 0.01), with r
    /// the distance in radii.
    Attract {
        /// m/s². At most 1e6 in size; below 0 it repels.
        acceleration: f64,
    },
    /// Drags along: the matter takes on the tool's velocity.
    Grab {
        /// Time constant with which it does, s: by a share of 1 − exp(−t/time) after t. 0 … 1e3; 0: at once.
        time: f64,
    },
    /// Drags along and turns about an axis through the centre.
    Stir {
        /// Angular velocity, rad/s. At most 1e4 on each axis.
        #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
        angular_velocity: DVec3,
        /// Time constant with which the matter follows, s. 0 … 1e3; 0: at once.
        time: f64,
    },
}

impl Action {
    /// The largest speed that matter of `speed` gets within `time` s from a tool of this radius that moves at `moves`,
    /// m/s.
    fn hastened(&self, radius: f64, moves: f64, time: f64, speed: f64) -> f64 {
        let followed = |tool: f64, constant: f64| speed.max((speed + follow(constant, time) * tool).min(tool));
        match *self {
            Action::Push { acceleration } => speed + acceleration.length() * time,
            Action::Sweep { .. } if moves == 0.0 => speed,
            Action::Sweep { acceleration } | Action::Attract { acceleration } => speed + acceleration.abs() * time,
            Action::Grab { time: constant } => followed(moves, constant),
            Action::Stir { angular_velocity, time: constant } => {
                followed(moves + angular_velocity.length() * radius, constant)
            }
        }
    }

    fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        let limit = MAX_ACCELERATION;
        let time_constant = |field: &str, time: f64| check.range(field, time, 0.0, 1e3, "0 to 1e3 s");
        let strength =
            |field: &str, value: f64| check.range(field, value, -limit, limit, "finite, at most 1e6 m/s² in size");
        match *self {
            Action::Push { acceleration } => {
                check.vector("push.acceleration", acceleration, limit, "finite, at most 1e6 m/s²")
            }
            Action::Sweep { acceleration } => strength("sweep.acceleration", acceleration),
            Action::Attract { acceleration } => strength("attract.acceleration", acceleration),
            Action::Grab { time } => time_constant("grab.time", time),
            Action::Stir { angular_velocity, time } => {
                check.vector("stir.angular_velocity", angular_velocity, 1e4, "finite, at most 1e4 rad/s")?;
                time_constant("stir.time", time)
            }
        }
    }
}

/// The share of a tool's velocity that matter takes on in `dt` s, with this time constant.
fn follow(constant: f64, dt: f64) -> f64 {
    if constant > 0.0 { 1.0 - (-dt / constant).exp() } else { 1.0 }
}

/// A tool that a host controls: [`Simulate::set_tools`](crate::Simulate::set_tools).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub struct Tool {
    /// What it does.
    pub action: Action,
    /// How far it reaches, m. 1e-6 … 1e6.
    pub radius: f64,
    /// Its centre at the beginning of the next step, m. At most 1e6 on each axis.
    pub position: DVec3,
    /// Its velocity, m/s, by which it moves on from step to step. At most 1e6 on each axis.
    pub velocity: DVec3,
}

impl Tool {
    /// The largest speed that it brings matter of `speed` to within `time` s, m/s.
    pub(crate) fn hastened(&self, time: f64, speed: f64) -> f64 {
        self.action.hastened(self.radius, self.velocity.length(), time, speed)
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        self.action.validate(&format!("{path}.action"))?;
        validate_radius(&check, self.radius)?;
        check.vector("position", self.position, MAX_LENGTH, "finite, at most 1e6 m")?;
        check.vector("velocity", self.velocity, 1e6, "finite, at most 1e6 m/s")
    }
}

fn validate_radius(check: &Check<'_>, radius: f64) -> Result<()> {
    check.range("radius", radius, 1e-6, MAX_LENGTH, "1e-6 to 1e6 m")
}

/// A tool whose use is stated for all time.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct ScriptedTool {
    /// Name, for people; may be empty.
    #[cfg_attr(feature = "scene", serde(default))]
    pub name: String,
    /// What it does.
    pub action: Action,
    /// How far it reaches, m. 1e-6 … 1e6.
    pub radius: f64,
    /// Its centre, m. With a `motion`, the position that the motion is relative to.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// A motion over time about `position`. Default none.
    #[cfg_attr(feature = "scene", serde(default))]
    pub motion: Option<Motion>,
    /// When it begins, s: with the first step that does not begin earlier. −1e9 … 1e9, default 0.
    #[cfg_attr(feature = "scene", serde(default))]
    pub start: f64,
    /// When it ends, s: it acts in no step that begins then or later. Not before `start`, at most 1e9. Default
    /// never.
    #[cfg_attr(feature = "scene", serde(default))]
    pub end: Option<f64>,
}

impl ScriptedTool {
    /// One at rest and always at work.
    pub fn new(action: Action, radius: f64, position: DVec3) -> Self {
        ScriptedTool { name: String::new(), action, radius, position, motion: None, start: 0.0, end: None }
    }

    /// Where it is at `time` s.
    pub fn position_at(&self, time: f64) -> DVec3 {
        let stated = Pose { position: self.position, rotation: DQuat::IDENTITY };
        Motion::posed(self.motion.as_ref(), stated, time).position
    }

    /// The largest speed that it brings matter of `speed` to within a frame of `frame` s that begins at `time`, m/s.
    pub(crate) fn hastened(&self, time: f64, frame: f64, speed: f64) -> f64 {
        if self.start >= time + frame || self.end.is_some_and(|end| end <= time) {
            return speed;
        }
        let moves = self.motion.as_ref().map_or(0.0, |motion| motion.fastest()[0]);
        self.action.hastened(self.radius, moves, frame, speed)
    }

    /// Whether it is at work in a step that begins at `time` and lasts `dt` s.
    fn acts(&self, time: f64, dt: f64) -> bool {
        // Step times are sums of step lengths, hence the rounding margin.
        let time = time + 1e-6 * dt;
        self.start <= time && self.end.is_none_or(|end| time < end)
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        self.action.validate(&format!("{path}.action"))?;
        validate_radius(&check, self.radius)?;
        validate_placement(path, self.position, DQuat::IDENTITY, self.motion.as_ref())?;
        check.range("start", self.start, -1e9, 1e9, "finite, at most 1e9 s")?;
        check.range("end", self.end.unwrap_or(self.start), self.start, 1e9, "from `start` to 1e9 s")
    }
}

/// Fails where more tools are at work at a time than may be.
pub(crate) fn validate_all(tools: &[ScriptedTool]) -> Result<()> {
    for (i, tool) in tools.iter().enumerate() {
        tool.validate(&format!("tools[{i}]"))?;
        let at_work = tools.iter().filter(|other| other.acts(tool.start, 0.0)).count();
        let allowed = "the start of no more than 16 tools at work at a time";
        Check { path: "" }.that(at_work <= MAX_TOOLS, &format!("tools[{i}].start"), tool.start, allowed)?;
    }
    Ok(())
}

/// A tool during one step, in cell units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ToolInput {
    /// Centre at the start of the step.
    pub start: DVec3,
    /// Its displacement in the step.
    pub way: DVec3,
    pub radius: f64,
    /// What it adds to a displacement.
    pub push: DVec3,
    /// The same towards the centre.
    pub pull: f64,
    /// Share by which displacements become the tool's.
    pub share: f64,
    /// Rotation per step of what follows it, about this vector by its length.
    pub spin: DVec3,
}

impl ToolInput {
    fn new(action: &Action, radius: f64, [from, to]: [DVec3; 2], dt: f64, units: &Units) -> Self {
        let gained = |acceleration: DVec3| units.acceleration_in(acceleration, dt);
        let (mut push, mut pull, mut share, mut spin) = (DVec3::ZERO, 0.0, 0.0, DVec3::ZERO);
        match *action {
            Action::Push { acceleration } => push = gained(acceleration),
            Action::Sweep { acceleration } => push = gained((to - from).normalize_or_zero() * acceleration),
            Action::Attract { acceleration } => pull = gained(DVec3::X * acceleration).x,
            Action::Grab { time } => share = follow(time, dt),
            Action::Stir { angular_velocity, time } => {
                (share, spin) = (follow(time, dt), units.turn_in(angular_velocity, dt))
            }
        }
        let (start, end) = (units.position_in(from), units.position_in(to));
        ToolInput { start, way: end - start, radius: units.length_in(radius), push, pull, share, spin }
    }

    /// Of a tool that a host controls.
    pub fn wielded(tool: &Tool, dt: f64, units: &Units) -> Self {
        let way = [tool.position, tool.position + tool.velocity * dt];
        ToolInput::new(&tool.action, tool.radius, way, dt, units)
    }

    /// Of a scripted tool in the step that begins at `time`; `None` where it is not at work.
    pub fn scripted(tool: &ScriptedTool, time: f64, dt: f64, units: &Units) -> Option<Self> {
        tool.acts(time, dt).then(|| {
            let way = [time, time + dt].map(|time| tool.position_at(time));
            ToolInput::new(&tool.action, tool.radius, way, dt, units)
        })
    }
}
