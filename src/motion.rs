//! Motions of solid bodies that are stated for all time.

use crate::error::{Check, Result};
use crate::shape::{MAX_LENGTH, Pose, Shape, unit, validate_rotation};
use glam::{DQuat, DVec3};
use std::f64::consts::{PI, TAU};

/// The most keyframes of a motion.
pub const MAX_KEYFRAMES: usize = 1 << 16;
/// The fastest that a body may move along an axis, m/s.
const MAX_SPEED: f64 = 1e6;

/// A motion in simulation time, about the position and rotation that the collider states. At the end of every step a
/// body is exactly where its motion has it, whatever the step's length; within a step it moves straight and turns
/// evenly.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum Motion {
    /// At constant velocity.
    Steady {
        /// Velocity of the centre, m/s. Default 0. At most 1e6 on each axis.
        #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
        linear_velocity: DVec3,
        /// Angular velocity about the centre in world axes, rad/s. Default 0. At most 1e4 on each axis, and at most
        /// half a turn per step.
        #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
        angular_velocity: DVec3,
    },
    /// To and fro: with s = sin(2π (frequency · t + phase)), moved by s · `amplitude` and turned by s ·
    /// `angular_amplitude`.
    Oscillate {
        /// Largest distance from the stated position, m. Default 0. At most 1e6 on each axis.
        #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
        amplitude: DVec3,
        /// Periods per second, Hz. 0 … 1e4.
        frequency: f64,
        /// Part of a period by which it is ahead at time 0, turns. Default 0. At most 1e6 in size.
        #[cfg_attr(feature = "scene", serde(default))]
        phase: f64,
        /// Largest turn from the stated rotation: about this vector, in world axes and through the body's centre, by
        /// its length in rad. Default 0. At most 1e4 on each axis, and at most half a turn per step.
        #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
        angular_amplitude: DVec3,
    },
    /// Through stated poses at stated times, straight and evenly from each to the next, by the shorter turn. Before the
    /// first it stays at the first, after the last at the last.
    Keyframes {
        /// When, s; each above the one before. 1 … 65536 of them, at most 1e9 in size.
        times: Vec<f64>,
        /// Where at these times, relative to the stated position, m. As many as `times`, at most 1e6 on each axis.
        #[cfg_attr(feature = "scene", schemars(with = "Vec<[f64; 3]>"))]
        positions: Vec<DVec3>,
        /// How turned at these times, after the stated rotation: quaternions `[x, y, z, w]`. As many as `times`, or
        /// none for no turning, which is the default. At most half a turn per step.
        #[cfg_attr(feature = "scene", schemars(with = "Vec<[f64; 4]>"), serde(default))]
        rotations: Vec<DQuat>,
        /// Begins anew at the last time, for ever, and so before the first. The first and last pose must be the same.
        /// Default false.
        #[cfg_attr(feature = "scene", serde(default))]
        repeat: bool,
    },
}

impl Motion {
    /// Where something is at `time` s that states the pose `rest`, and perhaps a motion about it.
    pub(crate) fn posed(motion: Option<&Motion>, rest: Pose, time: f64) -> Pose {
        let rest = Pose { rotation: unit(rest.rotation), ..rest };
        motion.map_or(rest, |motion| motion.pose(&rest, time))
    }

    /// The pose at `time` s of a body that states the pose `rest`.
    pub fn pose(&self, rest: &Pose, time: f64) -> Pose {
        match self {
            Motion::Steady { linear_velocity, angular_velocity } => {
                rest.advanced(*linear_velocity, *angular_velocity, time)
            }
            Motion::Oscillate { amplitude, frequency, phase, angular_amplitude } => {
                let share = (TAU * (frequency * time + phase)).sin();
                let turn = DQuat::from_scaled_axis(*angular_amplitude * share);
                Pose { position: rest.position + *amplitude * share, rotation: (turn * rest.rotation).normalize() }
            }
            Motion::Keyframes { times, positions, rotations, repeat } => {
                let (key, share) = place(times, *repeat, time);
                let next = if share > 0.0 { key + 1 } else { key };
                let (Some(&a), Some(&b)) = (positions.get(key), positions.get(next)) else {
                    return *rest; // no valid motion
                };
                let turn = match (rotations.get(key), rotations.get(next)) {
                    (Some(from), Some(to)) => from.normalize().slerp(to.normalize(), share),
                    _ => DQuat::IDENTITY,
                };
                Pose { position: rest.position + a + (b - a) * share, rotation: (turn * rest.rotation).normalize() }
            }
        }
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        match self {
            Motion::Steady { linear_velocity, angular_velocity } => {
                check.vector("steady.linear_velocity", *linear_velocity, MAX_SPEED, "finite, at most 1e6 m/s")?;
                check.vector("steady.angular_velocity", *angular_velocity, 1e4, "finite, at most 1e4 rad/s")
            }
            Motion::Oscillate { amplitude, frequency, phase, angular_amplitude } => {
                check.vector("oscillate.amplitude", *amplitude, MAX_LENGTH, "finite, at most 1e6 m")?;
                check.range("oscillate.frequency", *frequency, 0.0, 1e4, "0 to 1e4 Hz")?;
                check.range("oscillate.phase", *phase, -1e6, 1e6, "finite, at most 1e6 turns")?;
                check.vector("oscillate.angular_amplitude", *angular_amplitude, 1e4, "finite, at most 1e4 rad")?;
                let speed = amplitude.abs().max_element() * TAU * frequency;
                check.that(speed <= MAX_SPEED, "oscillate.frequency", frequency, "low enough for at most 1e6 m/s")
            }
            Motion::Keyframes { times, positions, rotations, repeat } => {
                keyframes(&Check { path: &format!("{path}.keyframes") }, times, positions, rotations, *repeat)
            }
        }
    }

    /// The largest speed of the centre, m/s, and of turning, rad/s.
    pub(crate) fn fastest(&self) -> [f64; 2] {
        match self {
            Motion::Steady { linear_velocity, angular_velocity } => {
                [linear_velocity.length(), angular_velocity.length()]
            }
            Motion::Oscillate { amplitude, frequency, angular_amplitude, .. } => {
                [amplitude, angular_amplitude].map(|most| most.length() * TAU * frequency)
            }
            Motion::Keyframes { times, positions, rotations, .. } => {
                let fastest = |ways: &mut dyn Iterator<Item = f64>| {
                    ways.zip(times.windows(2)).map(|(way, t)| way / (t[1] - t[0])).fold(0.0, f64::max)
                };
                [
                    fastest(&mut positions.windows(2).map(|p| p[0].distance(p[1]))),
                    fastest(&mut rotations.windows(2).map(|r| 2.0 * likeness(r[0], r[1]).acos())),
                ]
            }
        }
    }

    /// The largest speed that it brings a point of the shape to, m/s.
    pub(crate) fn fastest_of(&self, shape: &Shape) -> f64 {
        shape.outermost(self.fastest())
    }

    /// Fails if the body at any time turns by more than half a turn in a step of `dt` s.
    pub(crate) fn check_turn(&self, path: &str, dt: f64) -> Result<()> {
        let field = match self {
            Motion::Steady { .. } => "steady.angular_velocity",
            Motion::Oscillate { .. } => "oscillate.angular_amplitude",
            Motion::Keyframes { .. } => "keyframes.rotations",
        };
        let [_, fastest] = self.fastest();
        Check { path }.that(fastest * dt <= PI, field, format!("{fastest} rad/s"), "at most half a turn per time step")
    }
}

/// Checks where something is, and its motion if it has one.
pub(crate) fn validate_placement(path: &str, position: DVec3, rotation: DQuat, motion: Option<&Motion>) -> Result<()> {
    let check = Check { path };
    check.vector("position", position, MAX_LENGTH, "finite, at most 1e6 m")?;
    validate_rotation(&check, "rotation", rotation)?;
    motion.map_or(Ok(()), |motion| motion.validate(&format!("{path}.motion")))
}

/// The last key at or before `time`, and the share of the way to the next.
fn place(times: &[f64], repeat: bool, time: f64) -> (usize, f64) {
    let [first, .., last] = times else { return (0, 0.0) };
    let time = if repeat { first + (time - first).rem_euclid(last - first) } else { time };
    match times.partition_point(|&t| t <= time) {
        0 => (0, 0.0),
        n if n == times.len() => (n - 1, 0.0),
        n => (n - 1, (time - times[n - 1]) / (times[n] - times[n - 1])),
    }
}

/// Cosine of half the angle between two rotations: 1 for equal ones.
fn likeness(a: DQuat, b: DQuat) -> f64 {
    a.normalize().dot(b.normalize()).abs().min(1.0)
}

fn keyframes(check: &Check<'_>, times: &[f64], positions: &[DVec3], rotations: &[DQuat], repeat: bool) -> Result<()> {
    let count = times.len();
    check.that((1..=MAX_KEYFRAMES).contains(&count), "times", count, "1 to 65536 times")?;
    for (i, &time) in times.iter().enumerate() {
        check.range(&format!("times[{i}]"), time, -1e9, 1e9, "finite, at most 1e9 s")?;
        check.that(i == 0 || times[i - 1] < time, &format!("times[{i}]"), time, "above the time before it")?;
    }
    let as_many = format!("as many as `times`, which are {count}");
    check.that(positions.len() == count, "positions", positions.len(), &as_many)?;
    check.that([0, count].contains(&rotations.len()), "rotations", rotations.len(), &format!("{as_many}, or none"))?;
    for (i, &position) in positions.iter().enumerate() {
        check.vector(&format!("positions[{i}]"), position, MAX_LENGTH, "finite, at most 1e6 m")?;
    }
    for (i, &rotation) in rotations.iter().enumerate() {
        validate_rotation(check, &format!("rotations[{i}]"), rotation)?;
    }
    for i in 1..count {
        let speed = (positions[i] - positions[i - 1]).abs().max_element() / (times[i] - times[i - 1]);
        let slow = speed <= MAX_SPEED;
        check.that(slow, &format!("positions[{i}]"), positions[i].to_array(), "near enough for at most 1e6 m/s")?;
    }
    if repeat {
        check.that(count > 1, "times", count, "at least 2 times where `repeat` is set")?;
        let last = count - 1;
        let allowed = "the same as the first where `repeat` is set";
        check.that(
            positions[last] == positions[0],
            &format!("positions[{last}]"),
            positions[last].to_array(),
            allowed,
        )?;
        if let (Some(&a), Some(&b)) = (rotations.first(), rotations.last()) {
            check.that(likeness(a, b) > 1.0 - 1e-9, &format!("rotations[{last}]"), b.to_array(), allowed)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: Pose = Pose { position: DVec3::new(1.0, 2.0, 3.0), rotation: DQuat::IDENTITY };

    #[test]
    fn an_oscillation_is_a_sine() {
        let motion = Motion::Oscillate {
            amplitude: DVec3::new(0.0, 0.5, 0.0),
            frequency: 2.0,
            phase: 0.25,
            angular_amplitude: DVec3::new(0.0, 0.0, 0.3),
        };
        for (time, share) in [(0.0, 1.0), (0.125, 0.0), (0.25, -1.0), (0.5, 1.0), (1.0 / 24.0, 0.75f64.sqrt())] {
            let pose = motion.pose(&REST, time);
            assert!(pose.position.distance(DVec3::new(1.0, 2.0 + 0.5 * share, 3.0)) < 1e-12, "{time}: {pose:?}");
            assert!(pose.rotation.angle_between(DQuat::from_rotation_z(0.3 * share)) < 1e-7, "{time}: {pose:?}");
        }
    }

    #[test]
    fn keyframes_are_met_and_joined() {
        let turn = DQuat::from_rotation_y;
        let motion = |repeat| Motion::Keyframes {
            times: vec![1.0, 2.0, 4.0],
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::ZERO],
            rotations: vec![turn(0.0), turn(2.0), turn(0.0)],
            repeat,
        };
        for (time, x, angle, repeat) in [
            (-5.0, 0.0, 0.0, false),
            (1.0, 0.0, 0.0, false),
            (1.25, 0.25, 0.5, false),
            (2.0, 1.0, 2.0, false),
            (3.5, 0.25, 0.5, false),
            (4.0, 0.0, 0.0, false),
            (9.0, 0.0, 0.0, false),
            (4.25, 0.25, 0.5, true),
            (0.5, 0.25, 0.5, true), // 3.5 of the time before
            (31.0, 0.0, 0.0, true),
        ] {
            let pose = motion(repeat).pose(&REST, time);
            assert!(pose.position.distance(REST.position + DVec3::X * x) < 1e-12, "{time}: {pose:?}");
            assert!(pose.rotation.angle_between(turn(angle)) < 1e-7, "{time}: {pose:?}");
        }
        let one = Motion::Keyframes { times: vec![3.0], positions: vec![DVec3::Y], rotations: vec![], repeat: false };
        assert_eq!(one.pose(&REST, 7.0), Pose { position: DVec3::new(1.0, 3.0, 3.0), ..REST });
        let none = Motion::Keyframes { times: vec![], positions: vec![], rotations: vec![], repeat: true };
        assert_eq!(none.pose(&REST, 7.0), REST);
    }

    /// A whole turn in three parts, each of which is shorter that way than the other.
    #[test]
    fn a_repeated_turn_goes_on() {
        let third = |k: f64| DQuat::from_rotation_y(TAU * k / 3.0);
        let (times, rotations) = (vec![0.0, 1.0, 2.0, 3.0], (0..4).map(|k| third(f64::from(k))).collect());
        let motion = Motion::Keyframes { times, positions: vec![DVec3::ZERO; 4], rotations, repeat: true };
        assert_eq!(motion.validate("motion"), Ok(()));
        for k in 0..40 {
            let time = 0.173 * f64::from(k);
            assert!(motion.pose(&REST, time).rotation.angle_between(third(time)) < 1e-6, "{time}");
        }
        assert!(motion.check_turn("motion", 1.49).is_ok() && motion.check_turn("motion", 1.51).is_err());
    }
}
