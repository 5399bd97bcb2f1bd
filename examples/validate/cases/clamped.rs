//! Elastic bodies with one end clamped. Nodes in the clamp and on its face are held; it reaches two cells into the
//! body.

use super::super::chart::{Chart, Curve};
use super::super::measure::{average, oscillation};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{G, Matter, Setup};
use super::{block, hung};
use pbmpm::{Boundary, Collider, DVec3, Particle, Result, Shape};
use std::f64::consts::TAU;

/// A clamp between two corners, m.
fn clamp(lo: DVec3, hi: DVec3) -> Collider {
    let mut body = Collider::new(Shape::Box { half_size: 0.5 * (hi - lo) }, 0.5 * (lo + hi));
    body.boundary = Boundary::Fixed;
    body
}

/// Mean distance, m, by which the particles that satisfied `chosen` at the start have sunk.
fn sag(particles: &[Particle], start: &[Particle], chosen: impl Fn(&Particle) -> bool) -> f64 {
    let pairs = start.iter().zip(particles).filter(|(s, _)| chosen(s));
    let (sum, count) = pairs.fold((0.0, 0.0), |(sum, n), (s, p)| (sum + s.position.y - p.position.y, n + 1.0));
    sum / count
}

/// A hanging bar of 1 m and 16 cells, 4 by 4 cells across, whose weight is applied over half a second, ρ g L/E = 0.03.
pub fn hanging(setup: &Setup) -> Result<Outcome> {
    const LENGTH: f64 = 1.0;
    const YOUNG: f64 = 3e5;
    const CELL: f64 = LENGTH / 16.0;
    let dx = CELL / setup.refine;
    let (lo, hi, face) = (4.0 * CELL, 8.0 * CELL, 4.0 * CELL + LENGTH);
    let top = face + 2.0 * CELL;
    let mut world = setup.world([12.0 * CELL, top + 2.0 * CELL, 12.0 * CELL], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("rubber", Matter::Rubber { young: YOUNG, poisson: 0.0 }, dx));
    world.spawns.push(block(setup, "rubber", [lo, lo, lo], [hi, top, hi]));
    let reach = DVec3::new(1.0, 0.0, 1.0) * CELL;
    world.colliders.push(clamp(DVec3::new(lo, face, lo) - reach, DVec3::new(hi, top + CELL, hi) + reach));
    let mut run = Run::new(setup, &world)?;
    let start = run.particles()?;
    run.ramp_gravity(DVec3::NEG_Y * G, 0.5)?;
    let track = run.sample(1.5, 60, |run| Ok(sag(&run.particles()?, &start, |p| p.position.y < face)))?;
    let expected = LENGTH * hung(1000.0 * G * LENGTH / YOUNG);
    Ok(Outcome {
        metrics: vec![Metric::relative("mean sag, m", Kind::Exact, expected, average(&track), 0.1, 0.03)],
        cost: run.cost()?,
        charts: vec![Chart::new("hanging bar", "t, s", "mean sag, m", vec![Curve::line(&setup.preset, track)])],
    })
}

/// A beam of 1 m by 0.2 m, 4 cells high and thick, of 2e7 Pa, clamped at its left end. Its weight is applied over half
/// a second and removed after another. Bending and shear follow Timoshenko.
pub fn cantilever(setup: &Setup) -> Result<Outcome> {
    const LENGTH: f64 = 1.0;
    const HEIGHT: f64 = 0.2;
    const YOUNG: f64 = 2e7;
    const CELL: f64 = HEIGHT / 4.0;
    let dx = CELL / setup.refine;
    let (face, lo, hi) = (4.0 * CELL, 4.0 * CELL, 4.0 * CELL + HEIGHT);
    let mut world = setup.world([face + LENGTH + 4.0 * CELL, hi + 4.0 * CELL, hi + 4.0 * CELL], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("rubber", Matter::Rubber { young: YOUNG, poisson: 0.0 }, dx));
    world.spawns.push(block(setup, "rubber", [face - 2.0 * CELL, lo, lo], [face + LENGTH, hi, hi]));
    let reach = DVec3::splat(CELL);
    let end = DVec3::new(face, hi + CELL, hi + CELL);
    world.colliders.push(clamp(DVec3::new(face - 2.0 * CELL, lo, lo) - reach, end));
    let mut run = Run::new(setup, &world)?;
    let start = run.particles()?;
    let tip = |p: &Particle| p.position.x > face + LENGTH - 0.5 * CELL;
    let tips: Vec<f64> = start.iter().filter(|p| tip(p)).map(|p| p.position.x - face).collect();
    let x = tips.iter().sum::<f64>() / tips.len() as f64;
    run.ramp_gravity(DVec3::NEG_Y * G, 0.5)?;
    let sagging = run.sample(1.0, 60, |run| Ok(sag(&run.particles()?, &start, tip)))?;
    run.solver.set_gravity(DVec3::ZERO)?;
    let swinging = run.sample(2.0, 240, |run| Ok(sag(&run.particles()?, &start, tip)))?;
    // Per volume, for a section of width 1: second moment h³/12, shear modulus E/2, shear coefficient 5/6.
    let weight = 1000.0 * G;
    let bending = weight * x * x * (6.0 * LENGTH * LENGTH - 4.0 * LENGTH * x + x * x) / (2.0 * YOUNG * HEIGHT * HEIGHT);
    let shear = weight * (LENGTH * x - 0.5 * x * x) / (5.0 / 6.0 * 0.5 * YOUNG);
    let found = oscillation(&swinging);
    let track = sagging.iter().chain(&swinging).copied().collect();
    Ok(Outcome {
        metrics: vec![
            Metric::relative("sag of the tip, m", Kind::Exact, bending + shear, average(&sagging), 0.1, 0.03),
            Metric::relative("frequency, Hz", Kind::Exact, 4.454, found.frequency / TAU, 0.05, 0.02),
            Metric::zero("damping ratio", Kind::Exact, found.damping, 0.05, 0.01),
        ],
        cost: run.cost()?,
        charts: vec![Chart::new("cantilever", "t, s", "sag of the tip, m", vec![Curve::line(&setup.preset, track)])],
    })
}
