//! Free elastic bodies.

use super::super::chart::{Chart, Curve};
use super::super::measure::{average, kinetic, mean, oscillation};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, Matter, Setup};
use super::block;
use pbmpm::{DVec3, Fill, Particle, Result, Shape, Spawn};
use std::f64::consts::PI;

/// A bar of 1 m and 16 cells, 4 by 4 cells across, of 1e5 Pa and zero Poisson's ratio: c = 10 m/s.
const LENGTH: f64 = 1.0;
const YOUNG: f64 = 1e5;
const CELERITY: f64 = 10.0;

/// The layers of particles, half a cell thick, of a bar along x that begins at `gap` on each axis.
fn layers(setup: &Setup, gap: f64, [length, y, z]: [f64; 3], cell_size: f64) -> impl Iterator<Item = Spawn> {
    let spacing = 0.5 * cell_size;
    (0..(length / spacing).round() as u32).map(move |k| {
        let x = gap + f64::from(k) * spacing;
        let layer = block(setup, "rubber", [x, gap, gap], [x + spacing, gap + y, gap + z]);
        Spawn { fill: Fill::Spacing(spacing), seed: u64::from(k), ..layer }
    })
}

/// Its first longitudinal mode, v = V cos(πx/L), over five periods of 0.2 s: the motion of a bar of half the length
/// that is held at one end. The mode's amplitude is the mean of each particle's displacement times the mode there.
fn vibrate(setup: &Setup, outcome: &mut Outcome) -> Result<(f64, f64)> {
    let dx = LENGTH / 16.0 / setup.refine;
    let thick = 4.0 * LENGTH / 16.0;
    let gap = 0.25 * LENGTH;
    let mut world = setup.world([LENGTH + 2.0 * gap, thick + 2.0 * gap, thick + 2.0 * gap], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("rubber", Matter::Rubber { young: YOUNG, poisson: 0.0 }, dx));
    for layer in layers(setup, gap, [LENGTH, thick, thick], dx) {
        let speed = 0.005 * CELERITY * (PI * (layer.position.x - gap) / LENGTH).cos();
        world.spawns.push(Spawn { velocity: DVec3::X * speed, ..layer });
    }
    let mut run = Run::new(setup, &world)?;
    let start: Vec<f64> = run.particles()?.iter().map(|p| p.position.x).collect();
    let track = run.sample(5.0 * 2.0 * LENGTH / CELERITY, 240, |run| {
        let motion = run.particles()?;
        let along = motion.iter().zip(&start).map(|(p, x)| (p.position.x - x) * (PI * (x - gap) / LENGTH).cos());
        Ok(along.sum::<f64>() / start.len() as f64)
    })?;
    outcome.cost.add(run.cost()?);
    let found = oscillation(&track);
    let shown = track.iter().map(|(t, q)| (*t, q / dx)).collect();
    outcome.charts.push(Chart::new("bar", "t, s", "mode, cells", vec![Curve::line(&setup.preset, shown)]));
    Ok((found.frequency / (PI * CELERITY / LENGTH), found.damping))
}

pub fn bar(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let (frequency, damping) = vibrate(setup, &mut outcome)?;
    outcome.metrics = vec![
        Metric::relative("frequency", Kind::Exact, 1.0, frequency, 0.05, 0.02),
        Metric::relative("Young's modulus", Kind::Exact, 1.0, frequency * frequency, 0.1, 0.03),
        Metric::zero("damping ratio", Kind::Exact, damping, 0.05, 0.01),
    ];
    Ok(outcome)
}

/// Largest over smallest modulus, less 1, and the worst error.
pub fn spread(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for hertz in [60.0, 120.0, 240.0, 480.0] {
        for iterations in [setup.iterations, 4 * setup.iterations] {
            let other = Setup { iterations, dt: 1.0 / hertz, ..setup.clone() };
            let (frequency, _) = vibrate(&other, &mut outcome)?;
            // Where it does not oscillate the stiffness counts as 0.
            let modulus = if frequency.is_finite() { frequency * frequency } else { 0.0 };
            least = least.min(modulus);
            most = most.max(modulus);
        }
    }
    let worst = if 1.0 - least > most - 1.0 { least } else { most };
    outcome.charts.clear();
    outcome.metrics = vec![
        Metric::zero("spread of Young's modulus", Kind::Exact, most / least - 1.0, 0.1, 0.03),
        Metric::relative("worst Young's modulus", Kind::Exact, 1.0, worst, 0.1, 0.03),
    ];
    Ok(outcome)
}

/// A ball of 0.1 m and 5 cells hits a smooth floor at 1 m/s without gravity; 1 MPa, Poisson's ratio 0.3. Hertz's
/// contact lasts T = 30.9 ms. Contact is measured from when the ball has lost a hundredth of its speed to when it has
/// all but a hundredth of its final speed. The ball's speed at the depth x, in units of the greatest depth, is √(1 −
/// x^(5/2)) of its initial one, with T/2.943 as the unit of time. The first hundredth is thus reached at x = 0.02^(2/5)
/// = 0.209, after 0.210/2.943 of T, and the last takes as long: 0.858 T are left, 26.5 ms.
pub fn ball(setup: &Setup) -> Result<Outcome> {
    const RADIUS: f64 = 0.1;
    let dx = RADIUS / 5.0 / setup.refine;
    let mut world = setup.world([4.0 * RADIUS, 8.0 * RADIUS, 4.0 * RADIUS], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("rubber", Matter::Rubber { young: 1e6, poisson: 0.3 }, dx));
    let cube = block(setup, "rubber", [RADIUS; 3], [3.0 * RADIUS; 3]);
    world.spawns.push(Spawn {
        shape: Shape::Sphere { radius: RADIUS },
        position: DVec3::new(2.0 * RADIUS, 1.3 * RADIUS, 2.0 * RADIUS),
        velocity: DVec3::NEG_Y,
        ..cube
    });
    let mut run = Run::new(setup, &world)?;
    let before = kinetic(&run.particles()?);
    let mut most = 0.0f64;
    let track = run.sample(0.25, 500, |run| {
        let particles = run.particles()?;
        most = most.max(kinetic(&particles) / before);
        Ok(mean(&particles, |p| p.velocity.y))
    })?;
    let leaving = average(&track[track.len() * 4 / 5..]);
    let passes = |speed: f64| {
        let next = track.iter().position(|(_, v)| *v > speed).filter(|k| *k > 0)?;
        let ((t0, v0), (t1, v1)) = (track[next - 1], track[next]);
        Some(t0 + (t1 - t0) * (speed - v0) / (v1 - v0))
    };
    let duration = passes(-0.99).zip(passes(0.99 * leaving)).map_or(f64::NAN, |(begun, ended)| ended - begun);
    let lowest = run.particles()?.iter().map(|p| p.position.y).fold(f64::INFINITY, f64::min) / dx;
    Ok(Outcome {
        metrics: vec![
            Metric::absolute("restitution", Kind::Exact, 1.0, leaving, 0.2, 0.07),
            Metric::relative("duration of the contact, s", Kind::Exact, 0.0265, duration, 0.2, 0.07),
            Metric::zero("energy gained", Kind::Exact, (most - 1.0).max(0.0), 1e-3, 1e-5),
            Metric::zero("sticking", Kind::Exact, if lowest > 1.0 { 0.0 } else { 1.0 }, 0.0, 0.0),
        ],
        cost: run.cost()?,
        charts: vec![Chart::new("ball", "t, s", "speed, m/s", vec![Curve::line(&setup.preset, track)])],
    })
}

/// First torsional mode of a free bar of 0.8 m and 6 by 6 cells of 2 cm, of 1e5 Pa and a Poisson's ratio of 0.3: layers
/// turn by ω cos(πx/L). Torsion travels at √(G J/(ρ Iₚ)), with J = 0.140577 a⁴ (Saint-Venant) and Iₚ = a⁴/6 of a square
/// section. Over four periods, as the layers' angular momentum in that mode.
pub fn torsion(setup: &Setup) -> Result<Outcome> {
    const LONG: f64 = 40.0 * DX;
    const ACROSS: f64 = 6.0 * DX;
    const TURN: f64 = 1.0;
    let dx = DX / setup.refine;
    let gap = 4.0 * DX;
    let mut world = setup.world([LONG + 2.0 * gap, ACROSS + 2.0 * gap, ACROSS + 2.0 * gap], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("rubber", Matter::Rubber { young: YOUNG, poisson: 0.3 }, dx));
    let axis = DVec3::splat(gap + 0.5 * ACROSS);
    let mode = |x: f64| (PI * (x - gap) / LONG).cos();
    for layer in layers(setup, gap, [LONG, ACROSS, ACROSS], dx) {
        let angular_velocity = DVec3::X * (TURN * mode(layer.position.x));
        world.spawns.push(Spawn { angular_velocity, ..layer });
    }
    let celerity = (YOUNG / 2.6 / 1000.0 * 0.140577 * 6.0f64).sqrt();
    let frequency = 0.5 * celerity / LONG;
    let mut run = Run::new(setup, &world)?;
    let track = run.sample(4.0 / frequency, 240, |run| {
        let turning = |p: &Particle| (p.position - axis).cross(p.velocity).x * mode(p.position.x);
        Ok(mean(&run.particles()?, turning))
    })?;
    let found = oscillation(&track);
    let measured = found.frequency / (2.0 * PI);
    Ok(Outcome {
        metrics: vec![
            Metric::relative("frequency, Hz", Kind::Exact, frequency, measured, 0.05, 0.02),
            Metric::zero("damping ratio", Kind::Exact, found.damping, 0.05, 0.01),
        ],
        cost: run.cost()?,
        charts: Vec::new(),
    })
}
