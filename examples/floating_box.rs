//! A floating box: its body lives in a physics engine, rapier, and its surface in the water; each passes its state to
//! the other. `cargo run --release --example floating_box -- cpu` (or `gpu`) prints how deep the box floats.
//!
//! In every step the water gets the body's pose and velocity, takes its step, and returns the impulse that it has
//! exerted; rapier applies that impulse to the body and takes the same step. No relaxation is needed: what the body
//! receives too much in one step it receives too little in the next, and that error dies away as long as the body is
//! heavier than the water that it moves within a step, here a layer of about one and a half cells (as far as sound
//! travels). A box of a tenth of the density of water still settles at once, one of a thirtieth overshoots and keeps
//! rocking.
//!
//! The grid represents a body's bottom by rows of nodes: the box may come to rest half a cell above or below the depth
//! of Archimedes, which is why it is 16 cells high. `floating_box cpu 0.75 -2` starts a box of another density from
//! another height, in cells above where it should float: from 2 below to 4 above it gets there within half a cell, and
//! more is an error.

use clap::Parser;
use pbmpm::{AdapterChoice, Collider, CpuSolver, DQuat, DVec3, Error, Fate, GpuOptions, Headless, Load, Material};
use pbmpm::{Particle, Pose, Scheme, Shape, Simulate, Spawn, World};
use rapier3d::prelude::{ColliderBuilder, LockedAxes, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle, Vector};
use std::ops::RangeInclusive;
use std::process::ExitCode;

/// Cell size, m.
pub const CELL: f64 = 0.02;
/// The channel: length and width, cells; the box reaches from side to side, so that the flow is the same all along it.
const CHANNEL: [f64; 2] = [36.0, 2.0];
/// Length and height of the box, cells.
const BOX: [f64; 2] = [24.0, 16.0];
/// Water below the box at first, cells.
const BELOW: f64 = 4.0;
const WATER: f64 = 1000.0;
const GRAVITY: f64 = 9.81;

/// Depth at which a box floats.
#[derive(Debug)]
pub struct Floating {
    /// From the surface of the water at the channel's ends to the bottom of the box, mean over the last second, in m.
    pub depth: f64,
    /// The depth according to Archimedes, m.
    pub expected: f64,
    /// Rotation of the box about the channel's cross axis at the end, rad.
    pub tilt: f64,
}

/// The channel with a box of `ratio` times the density of water, `lifted` cells above where it should float. If
/// negative, the box starts below, down to the channel's floor at most.
pub fn world(ratio: f64, lifted: f64) -> World {
    let [length, width] = CHANNEL;
    let depth = BELOW + ratio * BOX[1];
    let below = BELOW + lifted.min(0.0);
    let mut world = World::new(DVec3::ZERO, DVec3::new(length, BELOW + BOX[1] + 8.0, width) * CELL, CELL);
    world.gravity = DVec3::new(0.0, -GRAVITY, 0.0);
    world.settings.scheme = Scheme::Published;
    world.settings.dt = 0.004;
    world.settings.iterations = 16;
    world.materials.push(Material::liquid("water"));
    let left = 0.5 * (length - BOX[0]);
    for (lo, hi) in
        [([0.0, 0.0], [length, below]), ([0.0, below], [left, depth]), ([length - left, below], [length, depth])]
    {
        let corner = |at: [f64; 2], z: f64| DVec3::new(at[0], at[1], z) * CELL;
        world.spawns.push(Spawn::cuboid("water", corner(lo, 0.0), corner(hi, width)));
    }
    let half_size = DVec3::new(0.5 * BOX[0], 0.5 * BOX[1], width) * CELL;
    let position = DVec3::new(0.5 * length, BELOW + 0.5 * BOX[1] + lifted, 0.5 * width) * CELL;
    world.colliders.push(Collider { measure: true, ..Collider::new(Shape::Box { half_size }, position) });
    world
}

/// The body in the physics engine.
struct Body {
    physics: PhysicsWorld,
    handle: RigidBodyHandle,
}

fn vector(v: DVec3) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}

fn dvec(v: Vector) -> DVec3 {
    DVec3::new(v.x.into(), v.y.into(), v.z.into())
}

impl Body {
    fn new(ratio: f64, at: DVec3, dt: f64) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.gravity = vector(DVec3::new(0.0, -GRAVITY, 0.0));
        physics.integration_parameters.dt = dt as f32;
        // The flow is plane, and so is the body's motion.
        let plane = LockedAxes::TRANSLATION_LOCKED_Z | LockedAxes::ROTATION_LOCKED_X | LockedAxes::ROTATION_LOCKED_Y;
        let body = RigidBodyBuilder::dynamic().translation(vector(at)).locked_axes(plane).can_sleep(false);
        let handle = physics.bodies.insert(body);
        let half = DVec3::new(BOX[0], BOX[1], CHANNEL[1]) * 0.5 * CELL;
        let shape =
            ColliderBuilder::cuboid(half.x as f32, half.y as f32, half.z as f32).density((ratio * WATER) as f32);
        physics.colliders.insert_with_parent(shape, handle, &mut physics.bodies);
        Body { physics, handle }
    }

    /// Pose, velocity and angular velocity.
    fn state(&self) -> (Pose, DVec3, DVec3) {
        let body = &self.physics.bodies[self.handle];
        let q = body.rotation();
        let rotation = DQuat::from_xyzw(q.x.into(), q.y.into(), q.z.into(), q.w.into()).normalize();
        (Pose { position: dvec(body.translation()), rotation }, dvec(body.linvel()), dvec(body.angvel()))
    }

    /// Takes a step during which the water has exerted `load`.
    fn step(&mut self, load: Load) {
        let body = &mut self.physics.bodies[self.handle];
        body.apply_impulse(vector(load.impulse), true);
        body.apply_torque_impulse(vector(load.angular_impulse), true);
        self.physics.step();
    }
}

/// Height of the water at the channel's ends, m: its volume there over the area.
fn surface(particles: &[Particle]) -> f64 {
    let reach = 4.0 * CELL;
    let at_the_ends = |p: &&Particle| p.position.x.min(CHANNEL[0] * CELL - p.position.x) < reach;
    let there = particles.iter().filter(|p| p.fate == Fate::Alive).filter(at_the_ends);
    there.map(|p| p.mass / WATER * p.volume_ratio).sum::<f64>() / (2.0 * reach * CHANNEL[1] * CELL)
}

/// Steps water and body together for `seconds`, of which the last is measured.
pub fn float(solver: &mut dyn Simulate, ratio: f64, seconds: f64) -> Result<Floating, Error> {
    let dt = solver.dt();
    let mut body = Body::new(ratio, solver.poses()[0].position, dt);
    let total = |solver: &mut dyn Simulate| Ok(solver.loads()?.of(0).unwrap_or_default());
    let mut before: Load = total(solver)?;
    let (steps, measured) = ((seconds / dt) as u32, (1.0 / dt) as u32);
    let (mut depth, mut count) = (0.0, 0.0);
    for step in 0..steps {
        let (pose, velocity, angular_velocity) = body.state();
        solver.set_collider(0, Some(pose), velocity, angular_velocity)?;
        solver.step()?;
        let now = total(solver)?;
        body.step(now - before);
        before = now;
        if step + measured >= steps && step % 10 == 0 {
            depth += surface(&solver.particles()?) - (body.state().0.position.y - 0.5 * BOX[1] * CELL);
            count += 1.0;
        }
    }
    let tilt = body.state().0.rotation.to_scaled_axis().z;
    Ok(Floating { depth: depth / count, expected: ratio * BOX[1] * CELL, tilt })
}

/// Lets a box float, and says how deep.
#[derive(Debug, clap::Parser)]
#[command(name = "floating_box", max_term_width = 110)]
struct Args {
    /// What takes the steps of the water.
    #[arg(default_value = "cpu")]
    backend: Backend,
    /// Density of the box over that of water, 0.01 to 1.
    #[arg(default_value_t = 0.5, value_parser = ratio, allow_negative_numbers = true)]
    ratio: f64,
    /// Where the box starts, in cells above where it should float, -4 to 4.
    #[arg(default_value_t = 1.5, value_parser = lift, allow_negative_numbers = true)]
    lifted: f64,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Backend {
    Cpu,
    Gpu,
}

fn number(text: &str, range: RangeInclusive<f64>) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("must be {} to {}", range.start(), range.end()))
}

fn ratio(text: &str) -> Result<f64, String> {
    number(text, 0.01..=1.0)
}

fn lift(text: &str) -> Result<f64, String> {
    number(text, -BELOW..=4.0)
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Result<(), Box<dyn std::error::Error>> {
    let Args { backend, ratio, lifted } = *args;
    let world = world(ratio, lifted);
    let mut solver: Box<dyn Simulate> = match backend {
        Backend::Cpu => Box::new(CpuSolver::<f32>::new(&world)?),
        Backend::Gpu => Box::new(Headless::new(&world, &AdapterChoice::default(), &GpuOptions::default())?),
    };
    let found = float(&mut *solver, ratio, 3.0)?;
    println!("a box of {ratio} times the density of water, dropped from {lifted} cells above where it is to float");
    println!("depth {:.4} m, expected {:.4} m: {:+.1} %", found.depth, found.expected, percent(&found));
    println!("tilt {:+.3} rad", found.tilt);
    if (found.depth - found.expected).abs() > 0.5 * CELL {
        return Err("the depth is off by more than half a cell".into());
    }
    Ok(())
}

fn percent(found: &Floating) -> f64 {
    100.0 * (found.depth / found.expected - 1.0)
}
