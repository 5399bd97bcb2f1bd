//! Flight, and what it must conserve.

use super::super::measure::{angular_momentum, kinetic, mean_vector, rms};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, G, Matter, Setup, WATER};
use super::block;
use pbmpm::{DVec3, Particle, Result, Shape, Spawn, World};

const START: DVec3 = DVec3::new(1.5, 2.0, 0.0);
const DURATION: f64 = 0.5;

/// A cube of 8³ cells in flight. Jittered matter is pushed apart where it reads too dense; a lattice must keep its
/// shape.
fn flying(setup: &Setup, velocity: DVec3, jitter: f64) -> World {
    let dx = DX / setup.refine;
    let mut world = setup.world([8.0, 4.0, 0.8], dx);
    world.materials.push(setup.material("water", WATER, dx));
    let cube = block(setup, "water", [0.32, 1.6, 0.32], [0.48, 1.76, 0.48]);
    world.spawns.push(Spawn { velocity, jitter, ..cube });
    world
}

fn displacements(before: &[Particle], after: &[Particle]) -> Vec<DVec3> {
    before.iter().zip(after).map(|(a, b)| b.position - a.position).collect()
}

pub fn fall(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let mut errors = [0.0; 2];
    for (error, jitter) in errors.iter_mut().zip([setup.jitter, 0.0]) {
        let mut run = Run::new(setup, &flying(setup, START, jitter))?;
        let before = run.particles()?;
        run.to(DURATION)?;
        let (t, after) = (run.time(), run.particles()?);
        let fall = DVec3::NEG_Y * (0.5 * G * t * t);
        let moved = displacements(&before, &after);
        let centre = moved.iter().copied().sum::<DVec3>() / moved.len() as f64;
        *error = (centre - START * t - fall).length() / fall.length();
        if jitter == 0.0 {
            let shape = rms(moved.iter().map(|m| (*m - centre).length())) * setup.refine / DX;
            outcome.metrics.push(Metric::zero("change of a lattice's shape, cells", Kind::Exact, shape, 1e-2, 1e-4));
        }
        outcome.cost.add(run.cost()?);
    }
    let worst = errors[0].max(errors[1]);
    outcome.metrics.insert(0, Metric::zero("fall of the centre", Kind::Exact, worst, 1e-4, 1e-6));
    Ok(outcome)
}

/// Whole cells per step leave every weight unchanged. Rounding of positions of about 50 cells in f32 adds up to 1e-5
/// cells within a few steps.
pub fn drift(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let drift = DVec3::X * (DX / setup.refine / setup.dt);
    let steps = (DURATION / setup.dt).round().min(60.0) as u32;
    let mut ends = Vec::new();
    for velocity in [START, START + drift] {
        let mut run = Run::new(setup, &flying(setup, velocity, setup.jitter))?;
        run.steps(steps)?;
        ends.push(run.particles()?);
        outcome.cost.add(run.cost()?);
    }
    let moved = drift * (f64::from(steps) * setup.dt);
    let apart = rms(displacements(&ends[0], &ends[1]).iter().map(|m| (*m - moved).length())) * setup.refine / DX;
    outcome.metrics.push(Metric::zero("difference by a drift, cells", Kind::Exact, apart, 1e-3, 1e-5));
    Ok(outcome)
}

pub fn momentum(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let dx = DX / setup.refine;
    let steps = 1000u32.div_ceil(setup.transfers_per_step());
    let mut drifts = [0.0; 2];
    for (drift, cells) in drifts.iter_mut().zip([0.1, 0.01]) {
        let mut world = flying(setup, DVec3::new(0.6, 0.0, 0.8) * (cells * dx / setup.dt), setup.jitter);
        world.gravity = DVec3::ZERO;
        world.domain.max.z += 0.1 * dx * f64::from(steps);
        let mut run = Run::new(setup, &world)?;
        let before = run.particles()?;
        run.steps(steps)?;
        let after = run.particles()?;
        let velocity = |particles: &[Particle]| mean_vector(particles, |p| p.velocity);
        *drift = (velocity(&after) - velocity(&before)).length() * setup.dt / dx;
        let mass = |particles: &[Particle]| particles.iter().map(|p| p.mass).sum::<f64>();
        if cells == 0.1 {
            outcome.metrics.push(Metric::relative("mass", Kind::Exact, mass(&before), mass(&after), 1e-6, 0.0));
        }
        outcome.cost.add(run.cost()?);
    }
    let worst = drifts[0].max(drifts[1]);
    outcome.metrics.push(Metric::zero("drift of momentum, cells/step", Kind::Exact, worst, 1e-5, 2e-6));
    Ok(outcome)
}

/// Matter without resistance that turns: a step must return the rotation that it was given.
pub fn transfer(setup: &Setup) -> Result<Outcome> {
    let (dx, setup) = (DX / setup.refine, &Setup { iterations: 1, ..setup.clone() });
    let mut world = setup.world([0.8; 3], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("dust", Matter::Passive, dx));
    let (velocity, turn) = (DVec3::new(0.2, -0.1, 0.3), DVec3::new(1.0, 2.0, -1.5));
    let cube = block(setup, "dust", [0.32; 3], [0.48; 3]);
    let centre = cube.position;
    world.spawns.push(Spawn { velocity, angular_velocity: turn, ..cube });
    let mut run = Run::new(setup, &world)?;
    let before = run.particles()?;
    run.steps(1)?;
    let after = run.particles()?;
    let expected = |p: &Particle| velocity + turn.cross(p.position - centre);
    let fastest = before.iter().map(|p| expected(p).length()).fold(0.0, f64::max);
    let worst = before.iter().zip(&after).map(|(a, b)| (b.velocity - expected(a)).length()).fold(0.0, f64::max);
    Ok(Outcome {
        metrics: vec![Metric::zero("rotation through a transfer", Kind::Exact, worst / fastest, 1e-6, 1e-7)],
        cost: run.cost()?,
        charts: Vec::new(),
    })
}

/// A ball of 8 cells' radius at 2.4 rad/s.
pub fn spin(setup: &Setup) -> Result<Outcome> {
    let dx = DX / setup.refine;
    let mut world = setup.world([0.8; 3], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("rubber", Matter::Rubber { young: 1e5, poisson: 0.0 }, dx));
    let cube = block(setup, "rubber", [0.24; 3], [0.56; 3]);
    let turn = DVec3::new(0.0, 0.0, 2.4);
    world.spawns.push(Spawn { shape: Shape::Sphere { radius: 0.16 }, angular_velocity: turn, ..cube });
    let mut run = Run::new(setup, &world)?;
    let before = run.particles()?;
    run.to(std::f64::consts::TAU / turn.z)?;
    let after = run.particles()?;
    let [l0, l1] = [&before, &after].map(|p| angular_momentum(p, dx));
    // The first of the two velocities is instantaneous, the second is a mean over a step, which on a circle is smaller.
    let energy = kinetic(&after) / kinetic(&before);
    let per_1000 = 1000.0 * (l1 - l0).length() / l0.length() / run.cost()?.passes;
    Ok(Outcome {
        metrics: vec![
            Metric::relative("energy after a turn", Kind::Exact, 1.0, energy, 0.02, 0.001),
            Metric::zero("angular momentum per 1000 passes", Kind::Exact, per_1000, 1e-5, 1e-6),
        ],
        cost: run.cost()?,
        charts: Vec::new(),
    })
}
