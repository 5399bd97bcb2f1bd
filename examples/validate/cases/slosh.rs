//! Sloshing in the first mode.

use super::super::chart::{Chart, Curve};
use super::super::measure::{average, mean, oscillation, volume_noise};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, G, Setup, WATER};
use super::block;
use pbmpm::{Fill, Result, Spawn, World};
use std::f64::consts::PI;

/// A tank of 0.64 m, 32 cells.
pub const LENGTH: f64 = 32.0 * DX;
/// Height of the first mode's crest, m.
pub const AMPLITUDE: f64 = 2.0 * DX;

/// Angular frequency of the mode with `n` half waves in water of this depth, rad/s.
pub fn frequency(n: f64, deep: f64) -> f64 {
    let k = n * PI / LENGTH;
    (G * k * (k * deep).tanh()).sqrt()
}

/// Angular frequency of the first mode at a finite amplitude, rad/s, to the third order: Tadjbakhsh and Keller, Journal
/// of Fluid Mechanics 8 (1960) 442. At [`AMPLITUDE`] it is 0.4 % below that of small waves in the deep tank, and 1.0 %
/// above it in the shallow one.
fn frequency_at(deep: f64, amplitude: f64) -> f64 {
    let small = frequency(1.0, deep);
    let k = PI / LENGTH;
    let w = (k * deep).tanh().sqrt();
    let shift = (9.0 * w.powi(-7) - 12.0 * w.powi(-3) - 3.0 * w - 2.0 * w.powi(5)) / 32.0;
    small * (1.0 + 0.5 * (k * amplitude).powi(2) * shift / w)
}

/// A tank whose surface is raised by `amplitude` cos(πx/L) at the start: columns of particles, each of the resulting
/// height.
pub fn tank(setup: &Setup, deep: f64, amplitude: f64) -> World {
    let dx = DX / setup.refine;
    let thick = 4.0 * dx;
    let mut world = setup.world([LENGTH, 2.0 * deep, thick], dx);
    world.materials.push(setup.material("water", WATER, dx));
    let spacing = 0.5 * dx;
    let columns = (LENGTH / spacing).round() as u32;
    for k in 0..columns {
        let x = f64::from(k) * spacing;
        let surface = deep + amplitude * (PI * (x + 0.5 * spacing) / LENGTH).cos();
        let height = (surface / spacing).round() * spacing;
        let column = block(setup, "water", [x, 0.0, 0.0], [x + spacing, height, thick]);
        world.spawns.push(Spawn { fill: Fill::Spacing(spacing), seed: u64::from(k), ..column });
    }
    world
}

pub fn deep(setup: &Setup) -> Result<Outcome> {
    mode(setup, 0.5 * LENGTH)
}

pub fn shallow(setup: &Setup) -> Result<Outcome> {
    mode(setup, 0.25 * LENGTH)
}

/// Frequency and damping over five periods, from the horizontal position of the centre of mass.
fn mode(setup: &Setup, deep: f64) -> Result<Outcome> {
    let exact = frequency_at(deep, AMPLITUDE);
    let mut run = Run::new(setup, &tank(setup, deep, AMPLITUDE))?;
    let mut heights = Vec::new();
    let track = run.sample(5.0 * 2.0 * PI / exact, 300, |run| {
        let particles = run.particles()?;
        heights.push((run.time(), mean(&particles, |p| p.position.y)));
        Ok(mean(&particles, |p| p.position.x) - 0.5 * LENGTH)
    })?;
    let found = oscillation(&track);
    let height = 2.0 * average(&heights[heights.len() / 2..]) / deep;
    let shown = track.iter().map(|(t, x)| (t * exact / (2.0 * PI), x / DX)).collect();
    Ok(Outcome {
        metrics: vec![
            Metric::relative("frequency", Kind::Exact, exact, found.frequency, 0.02, 0.007),
            Metric::zero("damping ratio", Kind::Exact, found.damping, 0.015, 0.005),
            Metric::relative("mean height", Kind::Exact, 1.0, height, 0.02, 0.005),
            Metric::zero("volume noise", Kind::Exact, volume_noise(&run.particles()?), 0.03, 0.01),
        ],
        cost: run.cost()?,
        charts: vec![Chart::new(
            format!("sloshing, {:.0} cells deep", deep / DX),
            "t / T",
            "centre of mass, cells of 2 cm",
            vec![Curve::line(&setup.preset, shown)],
        )],
    })
}
