//! Dam breaks.

use super::super::chart::{Chart, Curve};
use super::super::measure::{at, line, quantile, rms, volume_noise};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, G, Setup, WATER};
use super::block;
use pbmpm::{Particle, Result};

/// Martin and Moyce 1952, n² = 2, a = 2.25 in: position of the front over a against t √(2g/a). Readings are good to
/// ±0.02 and ±0.05.
const MARTIN_MOYCE: [(f64, f64); 15] = [
    (0.41, 1.11),
    (0.84, 1.22),
    (1.19, 1.44),
    (1.43, 1.67),
    (1.63, 1.89),
    (1.83, 2.11),
    (1.98, 2.33),
    (2.20, 2.56),
    (2.32, 2.78),
    (2.51, 3.00),
    (2.65, 3.22),
    (2.83, 3.44),
    (2.98, 3.67),
    (3.11, 3.89),
    (3.33, 4.11),
];

/// From the same paper: height at the wall over 2a against t √(g/a).
const MARTIN_MOYCE_WALL: [(f64, f64); 10] = [
    (0.56, 0.94),
    (0.77, 0.89),
    (0.93, 0.83),
    (1.08, 0.78),
    (1.28, 0.72),
    (1.46, 0.67),
    (1.66, 0.61),
    (1.84, 0.56),
    (2.00, 0.50),
    (2.21, 0.44),
];

/// The front without friction, converged: 48 cells over a, one iteration at 14,400 Hz of the published scheme (`--cases
/// a4 --refine 3 --hertz 14400 --iterations 1`). 32 and 48 cells and steps of twice that length agree within 0.013.
const CONVERGED: [(f64, f64); 12] = [
    (0.0, 1.001),
    (0.3, 1.026),
    (0.6, 1.155),
    (0.9, 1.379),
    (1.2, 1.660),
    (1.5, 1.977),
    (1.8, 2.326),
    (2.1, 2.703),
    (2.4, 3.108),
    (2.7, 3.538),
    (3.0, 3.990),
    (3.3, 4.462),
];

/// A column of a by 2a, with a of 16 cells, against the left wall; slip floor.
pub fn front(setup: &Setup) -> Result<Outcome> {
    const A: f64 = 16.0 * DX;
    let dx = DX / setup.refine;
    let depth = 4.0 * dx;
    let mut world = setup.world([6.0 * A, 3.0 * A, depth], dx);
    world.materials.push(setup.material("water", WATER, dx));
    world.spawns.push(block(setup, "water", [0.0; 3], [A, 2.0 * A, depth]));
    let mut run = Run::new(setup, &world)?;
    let scale = (2.0 * G / A).sqrt();
    let before = run.state()?;
    let place = |particles: &[Particle]| {
        let xs = particles.iter().map(|p| p.position.x).collect();
        (quantile(xs, 0.998) + 0.25 * dx) / A
    };
    let at_wall = |particles: &[Particle]| {
        let ys = particles.iter().filter(|p| p.position.x < DX).map(|p| p.position.y).collect();
        (quantile(ys, 0.98) + 0.25 * dx) / (2.0 * A)
    };
    let start = place(&run.particles()?);
    let (mut noise, mut heights) = (Vec::new(), Vec::new());
    let found = run.sample(3.4 / scale, 68, |run| {
        let particles = run.particles()?;
        heights.push((run.time() * (G / A).sqrt(), at_wall(&particles)));
        noise.push(volume_noise(&particles));
        Ok(place(&particles))
    })?;
    let after = run.state()?;
    let track: Vec<_> = std::iter::once((0.0, start)).chain(found.iter().map(|(t, z)| (t * scale, *z))).collect();
    let apart = |reference: &[(f64, f64)]| rms(reference.iter().map(|(t, z)| at(&track, *t) - z));
    let sunk = rms(MARTIN_MOYCE_WALL.iter().map(|(t, h)| at(&heights, *t) - h));
    let steady: Vec<_> = track.iter().copied().filter(|p| (1.2..=3.3).contains(&p.0)).collect();
    let late: Vec<_> = CONVERGED.iter().copied().filter(|p| (1.2..=3.3).contains(&p.0)).collect();
    let energy = (after.kinetic_j + after.potential_j) / (before.kinetic_j + before.potential_j);
    let (gate, target) = if setup.refine < 1.5 { (0.15, 0.09) } else { (0.08, 0.05) };
    let curves = vec![
        Curve::line(&setup.preset, track.clone()),
        Curve::line("converged", CONVERGED.to_vec()),
        Curve::dots("Martin and Moyce", MARTIN_MOYCE.to_vec()),
    ];
    Ok(Outcome {
        metrics: vec![
            Metric::zero("front against the converged, in a", Kind::Converged, apart(&CONVERGED[1..]), gate, target),
            Metric::zero("front against the experiment, in a", Kind::Experiment, apart(&MARTIN_MOYCE), 0.3, 0.25),
            Metric::zero("height at the wall against the experiment, in 2a", Kind::Experiment, sunk, 0.1, 0.05),
            Metric::relative("speed of the front", Kind::Converged, line(&late).1, line(&steady).1, 0.1, 0.05),
            Metric::relative("energy left", Kind::Exact, 1.0, energy, 0.1, 0.05),
            Metric::zero("volume noise", Kind::Exact, mean_of(&noise), 0.03, 0.01),
        ],
        cost: run.cost()?,
        charts: vec![Chart::new("dam break", "t sqrt(2g/a)", "front / a", curves)],
    })
}

/// The depth over each strip of a floor of this length, of what each particle adds to the one that it is over.
fn depths(particles: &[Particle], length: f64, width: f64, part: impl Fn(&Particle) -> f64) -> Vec<f64> {
    let mut depths = vec![0.0; (length / width) as usize];
    for p in particles {
        if let Some(depth) = depths.get_mut((p.position.x / width) as usize) {
            *depth += part(p);
        }
    }
    depths
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// A reservoir 16 cells deep and twelve times as long against Ritter's solution, from 3 to 6 √(h/g).
pub fn ritter(setup: &Setup) -> Result<Outcome> {
    const DEEP: f64 = 16.0 * DX;
    const LONG: f64 = 12.0 * DEEP;
    let dx = DX / setup.refine;
    let depth = 4.0 * dx;
    let mut world = setup.world([LONG + 16.0 * DEEP, 1.5 * DEEP, depth], dx);
    world.materials.push(setup.material("water", WATER, dx));
    world.spawns.push(block(setup, "water", [0.0; 3], [LONG, DEEP, depth]));
    let mut run = Run::new(setup, &world)?;
    let celerity = (G * DEEP).sqrt();
    let width = 0.25 * DEEP;
    let mut errors = Vec::new();
    let mut past = Vec::new();
    let mut profile = (Vec::new(), Vec::new());
    run.to(3.0 * DEEP / celerity)?;
    run.sample(6.0 * DEEP / celerity, 12, |run| {
        let (t, particles) = (run.time(), run.particles()?);
        // Of the volume at rest.
        let depths = depths(&particles, 28.0 * DEEP, width, |p| p.mass / 1000.0 / (width * depth));
        let exact = |x: f64| (2.0 * celerity - (x - LONG) / t).powi(2) / (9.0 * G);
        let strips = depths.iter().enumerate().map(|(k, h)| ((k as f64 + 0.5) * width, *h));
        let disturbed = strips.filter(|(x, _)| (-celerity * t..2.0 * celerity * t).contains(&(x - LONG)));
        let compared: Vec<_> = disturbed.filter(|(x, _)| exact(*x) > 0.1 * DEEP).collect();
        errors.push(compared.iter().map(|(x, h)| (h - exact(*x)).abs()).sum::<f64>() / compared.len() as f64 / DEEP);
        let beyond = particles.iter().filter(|p| p.position.x > LONG).map(|p| p.mass).sum::<f64>();
        past.push((t, beyond / 1000.0 / depth));
        profile =
            compared.iter().map(|(x, h)| ((x / DEEP - 12.0, h / DEEP), (x / DEEP - 12.0, exact(*x) / DEEP))).unzip();
        Ok(())
    })?;
    let discharge = 8.0 / 27.0 * DEEP * celerity;
    let curves = vec![Curve::line(&setup.preset, profile.0), Curve::line("Ritter", profile.1)];
    Ok(Outcome {
        metrics: vec![
            Metric::zero("depth, in the depth at rest", Kind::Exact, mean_of(&errors), 0.08, 0.04),
            Metric::relative("discharge at the gate", Kind::Exact, discharge, line(&past).1, 0.1, 0.05),
            Metric::zero("volume noise", Kind::Exact, volume_noise(&run.particles()?), 0.03, 0.01),
        ],
        cost: run.cost()?,
        charts: vec![Chart::new("long dam break", "x / h", "depth / h", curves)],
    })
}

/// Water 16 cells deep breaks onto water 4 cells deep. By shallow-water theory (Stoker 1957) a bore runs ahead of water
/// of one depth h and speed u; with c = √(g h) of either still water and behind the bore, u = 2 (c₁ − c), the bore's
/// speed is √(g h (h + h₀)/(2 h₀)), and it gathers what flows in.
pub fn bore(setup: &Setup) -> Result<Outcome> {
    const DEEP: f64 = 16.0 * DX;
    const SHALLOW: f64 = 4.0 * DX;
    const LONG: f64 = 96.0 * DX;
    let dx = DX / setup.refine;
    let thick = 4.0 * dx;
    let mut world = setup.world([2.0 * LONG, 1.5 * DEEP, thick], dx);
    world.materials.push(setup.material("water", WATER, dx));
    world.spawns.push(block(setup, "water", [0.0; 3], [LONG, DEEP, thick]));
    world.spawns.push(block(setup, "water", [LONG, 0.0, 0.0], [2.0 * LONG, SHALLOW, thick]));
    let celerity = |depth: f64| (G * depth).sqrt();
    let flow = |depth: f64| 2.0 * (celerity(DEEP) - celerity(depth));
    let ahead = |depth: f64| (G * depth * (depth + SHALLOW) / (2.0 * SHALLOW)).sqrt();
    // More flows in than the bore gathers below the depth sought, less above it.
    let (mut low, mut high) = (SHALLOW, DEEP);
    for _ in 0..60 {
        let depth = 0.5 * (low + high);
        let too_low = flow(depth) * depth > ahead(depth) * (depth - SHALLOW);
        *if too_low { &mut low } else { &mut high } = depth;
    }
    let depth = low;
    let mut run = Run::new(setup, &world)?;
    let mut found = Vec::new();
    run.to(0.4)?;
    let track = run.sample(0.9, 20, |run| {
        let (t, particles) = (run.time(), run.particles()?);
        let depths = depths(&particles, 2.0 * LONG, DX, |p| p.mass * p.volume_ratio / 1000.0 / (DX * thick));
        let front = depths.iter().rposition(|here| *here > 0.5 * (depth + SHALLOW)).unwrap_or(0);
        // Well behind the bore, and ahead of the place of the dam, where the water's surface still falls.
        let behind = (LONG / DX) as usize + 8..((LONG + 0.75 * ahead(depth) * t) / DX) as usize;
        found.push(mean_of(&depths[behind.clone()]));
        let inside = |p: &&Particle| behind.contains(&((p.position.x / DX) as usize));
        let (mass, momentum) = particles
            .iter()
            .filter(inside)
            .fold((0.0, 0.0), |(mass, momentum), p| (mass + p.mass, momentum + p.mass * p.velocity.x));
        Ok((front as f64 * DX, momentum / mass))
    })?;
    let places: Vec<_> = track.iter().map(|(t, (place, _))| (*t, *place)).collect();
    let speeds: Vec<_> = track.iter().map(|(_, (_, speed))| *speed).collect();
    Ok(Outcome {
        metrics: vec![
            Metric::relative("depth behind the bore", Kind::Exact, depth, mean_of(&found), 0.08, 0.04),
            Metric::relative("speed of the water there", Kind::Exact, flow(depth), mean_of(&speeds), 0.1, 0.05),
            Metric::relative("speed of the bore", Kind::Exact, ahead(depth), line(&places).1, 0.1, 0.05),
        ],
        cost: run.cost()?,
        charts: Vec::new(),
    })
}
