//! Solid bodies that the matter cannot enter.

use crate::error::{Check, Result};
use crate::math::sdf;
use crate::motion::Motion;
use crate::shape::{MAX_LENGTH, Pose, Shape, unit, validate_rotation};
use glam::{DQuat, DVec3};

/// How matter in contact with a surface moves along it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum Boundary {
    /// Frictionless; only motion into the surface is stopped.
    #[default]
    Slip,
    /// Coulomb friction with this coefficient, 0 … 10: the tangential motion lost is at most the coefficient times
    /// the normal motion stopped.
    Friction(f64),
    /// Matter in contact moves with the surface (no slip); it may leave it. Matter within a quarter of a cell is in
    /// contact. Viscous liquids are dragged along according to their viscosity, in worlds with several of them
    /// according to the largest one.
    Stick,
    /// Matter inside the body moves with it, in both directions: a clamp. In the explicit and implicit schemes solids
    /// other than sand begin to deform at its face, wherever that lies between nodes, unless the body turns. Meshes,
    /// heightfields and bodies turned inside out hold nothing inside: there it acts as stick.
    Fixed,
}

impl Boundary {
    pub(crate) fn validate(self, check: &Check<'_>, name: &str) -> Result<()> {
        match self {
            Boundary::Friction(mu) => check.range(name, mu, 0.0, 10.0, "a friction coefficient of 0 to 10"),
            Boundary::Slip | Boundary::Stick | Boundary::Fixed => Ok(()),
        }
    }

    /// Coefficient for the kernels, where sticking is a coefficient beyond any contact.
    pub(crate) fn coefficient(self) -> f64 {
        match self {
            Boundary::Slip => 0.0,
            Boundary::Friction(mu) => mu,
            Boundary::Stick => 1e30,
            Boundary::Fixed => 1e31,
        }
    }
}

/// The shapes of a world's bodies. Half-spaces, which the domain's sides are, need no shader text of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Shapes {
    /// There is a box.
    pub boxes: bool,
    /// There is a sphere.
    pub spheres: bool,
    /// There is a capsule.
    pub capsules: bool,
    /// There is a cylinder.
    pub cylinders: bool,
    /// There is a body that is turned inside out.
    pub containers: bool,
    /// There are meshes or heightfields: how many distance grids the world has.
    pub meshes: u32,
}

impl Shapes {
    /// Those of bodies of these kinds in a world with so many distance grids.
    pub(crate) fn of_kinds(kinds: impl Iterator<Item = u32>, grids: u32) -> Self {
        let mut shapes = Shapes::default();
        for kind in kinds {
            shapes.containers |= sdf::is_inverted(kind);
            match kind & !sdf::INVERTED {
                sdf::BOX => shapes.boxes = true,
                sdf::SPHERE => shapes.spheres = true,
                sdf::CAPSULE => shapes.capsules = true,
                sdf::CYLINDER => shapes.cylinders = true,
                sdf::GRID => shapes.meshes = grids,
                _ => {}
            }
        }
        shapes
    }

    /// These and others.
    pub(crate) fn and(self, others: Self) -> Self {
        Shapes {
            boxes: self.boxes | others.boxes,
            spheres: self.spheres | others.spheres,
            capsules: self.capsules | others.capsules,
            cylinders: self.cylinders | others.cylinders,
            containers: self.containers | others.containers,
            meshes: self.meshes.max(others.meshes),
        }
    }
}

/// A rigid body with prescribed motion. Velocities act in simulation time, whatever the frame rate.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Collider {
    /// Name, for people; may be empty.
    #[cfg_attr(feature = "scene", serde(default))]
    pub name: String,
    /// The body's shape.
    pub shape: Shape,
    /// Position of its centre (a half-space: of a point on its plane) at time 0, m. With a `motion`, the position that
    /// the motion is relative to.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Rotation from the shape's frame to the world at time 0 (with a `motion`, before it), quaternion `[x, y, z, w]`.
    /// Default none.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 4]"), serde(default = "crate::shape::no_rotation"))]
    pub rotation: DQuat,
    /// Velocity of its centre, m/s. At most 1e6 on each axis, default 0.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
    pub linear_velocity: DVec3,
    /// Angular velocity about its centre in world axes, rad/s. At most 1e4 on each axis and half a turn per step,
    /// default 0.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
    pub angular_velocity: DVec3,
    /// How matter moves along its surface. Default slip.
    #[cfg_attr(feature = "scene", serde(default))]
    pub boundary: Boundary,
    /// The body fills everything outside of its shape, which thereby becomes a container. Default false.
    #[cfg_attr(feature = "scene", serde(default))]
    pub inverted: bool,
    /// Sums up what the matter exerts on the body, to be read by [`Simulate::loads`](crate::Simulate::loads) or
    /// [`GpuSolver::loads`](crate::GpuSolver::loads). Where faces coincide, the first in order bears all: closed sides
    /// of the domain, then colliders in their order. A plate that is flush with a side therefore reads nothing. Worlds
    /// with [`Sleep`](crate::Sleep) refuse it. Default false.
    #[cfg_attr(feature = "scene", serde(default))]
    pub measure: bool,
    /// A motion over time about `position` and `rotation`, in place of the two velocities, which must be 0 then.
    /// Default none. [`Simulate::set_collider`](crate::Simulate::set_collider) ends it.
    #[cfg_attr(feature = "scene", serde(default))]
    pub motion: Option<Motion>,
}

impl Collider {
    /// A frictionless body at rest, unturned.
    pub fn new(shape: Shape, position: DVec3) -> Self {
        Collider {
            name: String::new(),
            shape,
            position,
            rotation: DQuat::IDENTITY,
            linear_velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            boundary: Boundary::Slip,
            inverted: false,
            measure: false,
            motion: None,
        }
    }

    /// Signed distance from the body's surface in its own frame, m; negative where the body is solid.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        let distance = self.shape.signed_distance(p);
        if self.inverted { -distance } else { distance }
    }

    /// Whether it holds what is inside.
    pub(crate) fn clamps(&self) -> bool {
        let convex = !self.inverted && !matches!(self.shape, Shape::Mesh(_) | Shape::Heightfield(_));
        convex && self.boundary == Boundary::Fixed
    }

    /// Its boundary, for the kernels: only clamps are fixed.
    pub(crate) fn acting_boundary(&self) -> Boundary {
        if self.boundary == Boundary::Fixed && !self.clamps() { Boundary::Stick } else { self.boundary }
    }

    /// The pose at time 0.
    pub fn pose(&self) -> Pose {
        Motion::posed(self.motion.as_ref(), self.stated_pose(), 0.0)
    }

    /// The largest speed of a point of it, at first or by its motion, m/s.
    pub(crate) fn fastest(&self) -> f64 {
        let begun = self.shape.outermost([self.linear_velocity.length(), self.angular_velocity.length()]);
        begun.max(self.motion.as_ref().map_or(0.0, |motion| motion.fastest_of(&self.shape)))
    }

    pub(crate) fn stated_pose(&self) -> Pose {
        Pose { position: self.position, rotation: unit(self.rotation) }
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        self.shape.validate(&format!("{path}.shape"))?;
        check.vector("position", self.position, MAX_LENGTH, "finite, at most 1e6 m")?;
        validate_rotation(&check, "rotation", self.rotation)?;
        check.vector("linear_velocity", self.linear_velocity, 1e6, "finite, at most 1e6 m/s")?;
        check.vector("angular_velocity", self.angular_velocity, 1e4, "finite, at most 1e4 rad/s")?;
        if let Some(motion) = &self.motion {
            for (name, velocity) in
                [("linear_velocity", self.linear_velocity), ("angular_velocity", self.angular_velocity)]
            {
                check.that(velocity == DVec3::ZERO, name, velocity.to_array(), "0 for a body with a `motion`")?;
            }
            motion.validate(&format!("{path}.motion"))?;
        }
        self.boundary.validate(&check, "boundary")
    }

    /// Fails for a body that turns by more than half a turn in a step of `dt` s: it has no definite direction.
    pub(crate) fn check_turn(&self, path: &str, dt: f64) -> Result<()> {
        if let Some(motion) = &self.motion {
            return motion.check_turn(&format!("{path}.motion"), dt);
        }
        Check { path }.that(
            self.angular_velocity.length() * dt <= std::f64::consts::PI,
            "angular_velocity",
            self.angular_velocity.to_array(),
            "at most half a turn per time step",
        )
    }
}
