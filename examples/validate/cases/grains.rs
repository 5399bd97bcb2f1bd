//! Friction, and sand.

use super::super::chart::{Chart, Curve};
use super::super::measure::{line, mean, quantile};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, G, Matter, Setup, rough_floor};
use super::block;
use pbmpm::{DVec3, Particle, Result, Wall};

const ANGLE: f64 = 30.0;

/// Gravity on a floor that is tilted by this many degrees, down towards +x.
fn tilted(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin, -cos, 0.0) * G
}

/// A block of rubber of 8 by 4 by 4 cells on a floor with the coefficient 0.3, tilted by 30 and 10 degrees.
fn accelerate(setup: &Setup, degrees: f64) -> Result<(f64, Outcome)> {
    let dx = DX / setup.refine;
    let mut world = setup.world([200.0 * DX, 12.0 * DX, 12.0 * DX], dx);
    world.domain.walls.y_min = Wall::Friction(0.3);
    world.gravity = tilted(degrees);
    world.materials.push(setup.material("rubber", Matter::Rubber { young: 1e5, poisson: 0.0 }, dx));
    world.spawns.push(block(setup, "rubber", [4.0 * DX, 0.0, 4.0 * DX], [12.0 * DX, 4.0 * DX, 8.0 * DX]));
    let mut run = Run::new(setup, &world)?;
    run.to(0.2)?;
    let speed = run.sample(0.7, 30, |run| Ok(mean(&run.particles()?, |p| p.velocity.x)))?;
    let outcome = Outcome { cost: run.cost()?, ..Outcome::default() };
    Ok((line(&speed).1, outcome))
}

pub fn friction(setup: &Setup) -> Result<Outcome> {
    let (slides, mut outcome) = accelerate(setup, 30.0)?;
    let (rests, other) = accelerate(setup, 10.0)?;
    outcome.cost.add(other.cost);
    let (sin, cos) = 30f64.to_radians().sin_cos();
    outcome.metrics = vec![
        Metric::relative("acceleration above, m/s²", Kind::Exact, G * (sin - 0.3 * cos), slides, 0.05, 0.02),
        Metric::zero("acceleration below, m/s²", Kind::Exact, rests, 0.05, 0.005),
    ];
    Ok(outcome)
}

/// A layer of 8 cells without ends. Above the threshold the threshold follows from the layer's acceleration
/// g (sin θ − tan θ_c cos θ); below it, the layer must come to rest.
pub fn incline(setup: &Setup) -> Result<Outcome> {
    const LAYER: f64 = 8.0 * DX;
    let mut outcome = Outcome::default();
    let dx = DX / setup.refine;
    let (long, thick) = (24.0 * dx, 4.0 * dx);
    let mut found = [[0.0; 2]; 2];
    for (speeds, degrees) in found.iter_mut().zip([ANGLE - 2.0, ANGLE + 3.0]) {
        let mut world = setup.world([long, 2.0 * LAYER, thick], dx);
        rough_floor(&mut world);
        (world.domain.walls.x_min, world.domain.walls.x_max) = (Wall::Periodic, Wall::Periodic);
        world.materials.push(setup.material("sand", Matter::Sand { angle: ANGLE }, dx));
        world.spawns.push(block(setup, "sand", [0.0; 3], [long, LAYER, thick]));
        let mut run = Run::new(setup, &world)?;
        run.to(0.4)?;
        for k in 1..=6 {
            run.solver.set_gravity(tilted(degrees * f64::from(k) / 6.0))?;
            run.to(0.4 + f64::from(k) / 60.0)?;
        }
        for speed in speeds.iter_mut() {
            let next = run.time() + 0.2;
            run.to(next)?;
            *speed = mean(&run.particles()?, |p| p.velocity.x);
        }
        outcome.cost.add(run.cost()?);
    }
    let steep = (ANGLE + 3.0).to_radians();
    let acceleration = (found[1][1] - found[1][0]) / 0.2;
    let threshold = (steep.tan() - acceleration / (G * steep.cos())).atan().to_degrees();
    outcome.metrics = vec![
        Metric::absolute("threshold, degrees", Kind::Exact, ANGLE, threshold, 2.0, 1.0),
        Metric::zero("creep two degrees below, cells/s", Kind::Exact, found[0][1] / DX, 1.0, 1e-3),
    ];
    Ok(outcome)
}

/// The pile left by a plane column of sand, 12 cells wide and `aspect` times as high, on a rough floor: runout and
/// height over its width, and the slope of the pile in degrees.
fn collapse(setup: &Setup, aspect: f64, outcome: &mut Outcome) -> Result<[f64; 3]> {
    const WIDE: f64 = 12.0 * DX;
    let dx = DX / setup.refine;
    let (high, thick) = (aspect * WIDE, 4.0 * dx);
    let mut world = setup.world([WIDE * (3.0 + 3.0 * aspect), 1.2 * high, thick], dx);
    rough_floor(&mut world);
    world.materials.push(setup.material("sand", Matter::Sand { angle: ANGLE }, dx));
    world.spawns.push(block(setup, "sand", [0.0; 3], [WIDE, high, thick]));
    let mut run = Run::new(setup, &world)?;
    // Flows stop after about 3.3 √(h/g).
    run.to(5.0 * (high / G).sqrt())?;
    let particles = run.particles()?;
    let front = quantile(particles.iter().map(|p| p.position.x).collect(), 0.99) + 0.25 * dx;
    let surface = surface(&particles, dx);
    let top = surface.iter().map(|p| p.1).fold(0.0, f64::max);
    let flank: Vec<_> = surface.iter().copied().filter(|p| p.1 > 0.2 * top && p.1 < 0.8 * top).collect();
    let slope = -line(&flank).1.atan().to_degrees();
    let shown = surface.iter().map(|(x, y)| (x / WIDE, y / WIDE)).collect();
    let name = format!("sand column {aspect} times as high as wide");
    outcome.charts.push(Chart::new(name, "x / width", "height / width", vec![Curve::line(&setup.preset, shown)]));
    outcome.cost.add(run.cost()?);
    Ok([(front - WIDE) / WIDE, top / WIDE, slope])
}

/// Height of the pile in strips of a cell.
fn surface(particles: &[Particle], dx: f64) -> Vec<(f64, f64)> {
    let mut strips = std::collections::BTreeMap::<u64, Vec<f64>>::new();
    for p in particles {
        strips.entry((p.position.x / dx) as u64).or_default().push(p.position.y);
    }
    strips.into_iter().map(|(k, ys)| ((k as f64 + 0.5) * dx, quantile(ys, 0.98) + 0.25 * dx)).collect()
}

/// Runout according to Lube et al. 2005.
fn lube(aspect: f64) -> f64 {
    if aspect < 2.0 { 1.2 * aspect } else { 1.9 * aspect.powf(2.0 / 3.0) }
}

pub fn column_1(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let [runout, height, slope] = collapse(setup, 1.0, &mut outcome)?;
    // Slopes from five degrees below to one degree above the angle of friction count as right.
    let steeper = (slope - ANGLE - 1.0).max(ANGLE - 5.0 - slope).max(0.0);
    outcome.metrics = vec![
        Metric::relative("runout", Kind::Experiment, lube(1.0), runout, 0.25, 0.12),
        Metric::relative("height", Kind::Experiment, 1.0, height, 0.25, 0.12),
        Metric {
            name: "slope outside of 25 to 31 degrees",
            kind: Kind::Exact,
            reference: ANGLE,
            measured: slope,
            error: steeper,
            gate: 2.0,
            target: 0.0,
        },
    ];
    Ok(outcome)
}

/// Change of the slope of a column's pile, in degrees, with steps and cells of half the length, and with twice the
/// iterations.
pub fn repose(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let given = collapse(setup, 1.0, &mut outcome)?[2];
    let names = [
        "slope with half the step, degrees",
        "slope with twice the iterations, degrees",
        "slope on half the cells, degrees",
    ];
    for (name, other) in names.into_iter().zip(setup.varied()) {
        let slope = collapse(&other, 1.0, &mut outcome)?[2];
        outcome.metrics.push(Metric::absolute(name, Kind::Converged, given, slope, 2.0, 1.0));
    }
    outcome.charts.clear();
    Ok(outcome)
}

pub fn columns(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let aspects = [0.5, 1.0, 3.0, 5.0];
    let names = ["runout, aspect 0.5", "runout, aspect 1", "runout, aspect 3", "runout, aspect 5"];
    let mut runouts = [0.0; 4];
    for k in 0..4 {
        runouts[k] = collapse(setup, aspects[k], &mut outcome)?[0];
        outcome.metrics.push(Metric::relative(names[k], Kind::Experiment, lube(aspects[k]), runouts[k], 0.25, 0.12));
    }
    let exponent = |i: usize, j: usize| (runouts[j] / runouts[i]).ln() / (aspects[j] / aspects[i]).ln();
    outcome.metrics.push(Metric::absolute("exponent, low", Kind::Experiment, 1.0, exponent(0, 1), 0.15, 0.08));
    outcome.metrics.push(Metric::absolute("exponent, tall", Kind::Experiment, 2.0 / 3.0, exponent(2, 3), 0.1, 0.08));
    Ok(outcome)
}
