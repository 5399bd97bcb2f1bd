//! Vortices and viscosity.

use super::super::chart::{Chart, Curve};
use super::super::measure::{empty_cells, kinetic, line, volume_noise};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, Matter, Setup};
use super::block;
use pbmpm::{Boundary, Collider, DQuat, DVec3, Fill, Result, Shape, Spawn, World};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The box of the four vortices, m: 32 cells. No matter crosses its sides, so that slip walls are equivalent to
/// periodic ones.
const LENGTH: f64 = 32.0 * DX;
/// Largest speed, m/s: 30 cells/s.
const SPEED: f64 = 0.6;
const K: f64 = TAU / LENGTH;

/// u = U (sin kx cos ky, −cos kx sin ky), with a spawn for each row of particles along z.
fn vortices(setup: &Setup, viscosity: f64) -> World {
    let dx = DX / setup.refine;
    let thick = 4.0 * dx;
    let mut world = setup.world([LENGTH, LENGTH, thick], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("water", Matter::Water { viscosity }, dx));
    let spacing = 0.5 * dx;
    let rows = (LENGTH / spacing).round() as u32;
    for (i, j) in (0..rows).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let (x, y) = (f64::from(i) * spacing, f64::from(j) * spacing);
        let row = block(setup, "water", [x, y, 0.0], [x + spacing, y + spacing, thick]);
        let (a, b) = (K * row.position.x, K * row.position.y);
        world.spawns.push(Spawn {
            fill: Fill::Spacing(spacing),
            seed: u64::from(i * rows + j),
            velocity: DVec3::new(a.sin() * b.cos(), -a.cos() * b.sin(), 0.0) * SPEED,
            angular_velocity: DVec3::new(0.0, 0.0, K * SPEED * a.sin() * b.sin()),
            ..row
        });
    }
    world
}

/// Kinematic viscosity, m²/s, according to the decay of kinetic energy over the last three quarters of `end` s.
fn decay(setup: &Setup, viscosity: f64, end: f64, outcome: &mut Outcome) -> Result<f64> {
    let mut run = Run::new(setup, &vortices(setup, viscosity))?;
    let energy = run.sample(end, 60, |run| Ok(kinetic(&run.particles()?).ln()))?;
    let late: Vec<_> = energy.iter().copied().filter(|(t, _)| *t >= 0.25 * end).collect();
    let first = energy.first().map_or(0.0, |e| e.1);
    let particles = run.particles()?;
    let across = (32.0 * setup.refine).round() as usize;
    let empty = empty_cells(&particles, [across, across, 4], DX / setup.refine);
    outcome.metrics.push(Metric::zero("volume noise", Kind::Exact, volume_noise(&particles), 0.03, 0.01));
    outcome.metrics.push(Metric::zero("cells without particles", Kind::Exact, empty, 0.01, 0.001));
    outcome.cost.add(run.cost()?);
    let of = |e: &dyn Fn(f64, f64) -> f64| energy.iter().map(|(t, y)| (*t, e(*t, *y))).collect();
    let curves = vec![
        Curve::line(&setup.preset, of(&|_, y| (y - first).exp())),
        Curve::line("exact", of(&|t, _| (-4.0 * viscosity * K * K * t).exp())),
    ];
    outcome.charts.push(Chart::new(format!("vortices, viscosity {viscosity}"), "t, s", "energy", curves));
    Ok(-line(&late).1 / (4.0 * K * K))
}

pub fn inviscid(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let viscosity = decay(setup, 0.0, 1.0, &mut outcome)?;
    let inverse = viscosity / (SPEED * LENGTH);
    outcome.metrics.insert(
        0,
        Metric {
            name: "numerical viscosity over U L",
            kind: Kind::Exact,
            reference: 0.0,
            measured: inverse,
            error: inverse.abs(),
            gate: 1.0 / 400.0,
            target: 1.0 / 1000.0,
        },
    );
    Ok(outcome)
}

/// Numerical viscosity with four times the given iterations over that with the given ones.
pub fn iterations(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let few = decay(setup, 0.0, 1.0, &mut outcome)?;
    let more = Setup { iterations: 4 * setup.iterations, tolerance: 0.25 * setup.tolerance, ..setup.clone() };
    let many = decay(&more, 0.0, 1.0, &mut outcome)?;
    outcome.metrics =
        vec![Metric::relative("viscosity of four times the iterations", Kind::Exact, 1.0, many / few, 0.25, 0.1)];
    outcome.charts.clear();
    Ok(outcome)
}

/// A viscosity for which 8νΔt/Δx² lies between 0.01 and 1.
const VISCOSITY: f64 = 0.004;

pub fn viscous(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let whole = decay(setup, VISCOSITY, 0.6, &mut outcome)?;
    outcome.metrics.clear();
    outcome.metrics.push(Metric::relative("viscosity", Kind::Exact, VISCOSITY, whole, 0.1, 0.03));
    let halved = decay(&setup.shorter(2.0), VISCOSITY, 0.6, &mut outcome)?;
    outcome.metrics.truncate(1);
    outcome.charts.truncate(1);
    outcome.metrics.push(Metric::relative(
        "viscosity with half the step",
        Kind::Exact,
        1.0,
        halved / whole,
        0.05,
        0.01,
    ));
    Ok(outcome)
}

/// Liquid between a turning and a resting cylinder, both sticking: torque per length 4πμω r²R²/(R² − r²).
///
/// Radii of 8 and 16 cells; the walls are not aligned with the grid. The slowest mode has decayed to a hundredth before
/// the torque is read.
pub fn viscometer(setup: &Setup) -> Result<Outcome> {
    const TURN: f64 = 2.0;
    let dx = DX / setup.refine;
    let (inner, outer, thick) = (8.0 * DX, 16.0 * DX, 4.0 * dx);
    let viscosity = 0.01;
    let side = 2.0 * outer + 4.0 * DX;
    let mut world = setup.world([side, side, thick], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("oil", Matter::Water { viscosity }, dx));
    let centre = DVec3::new(0.5 * side, 0.5 * side, 0.5 * thick);
    let along_z = DQuat::from_rotation_x(FRAC_PI_2);
    let cylinder = |radius: f64| Shape::Cylinder { radius, half_height: thick };
    let mut wheel = Collider::new(cylinder(inner), centre);
    wheel.rotation = along_z;
    wheel.angular_velocity = DVec3::Z * TURN;
    wheel.boundary = Boundary::Stick;
    wheel.measure = true;
    let mut cup = Collider::new(cylinder(outer), centre);
    cup.rotation = along_z;
    cup.inverted = true;
    cup.boundary = Boundary::Stick;
    world.colliders = vec![wheel, cup];
    // A lattice of rows along z that fills the gap: with less liquid, it would lie against the cup, and the wheel would
    // turn in air.
    let spacing = 0.5 * dx;
    let rows = (side / spacing).round() as u32;
    for (i, j) in (0..rows).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let (x, y) = (f64::from(i) * spacing, f64::from(j) * spacing);
        let row = block(setup, "oil", [x, y, 0.0], [x + spacing, y + spacing, thick]);
        let radius = (row.position - centre).truncate().length();
        if (inner..outer).contains(&radius) {
            world.spawns.push(Spawn { fill: Fill::Spacing(spacing), seed: u64::from(i * rows + j), ..row });
        }
    }
    let mut run = Run::new(setup, &world)?;
    let settle = 1.5 * (outer - inner).powi(2) / viscosity / PI;
    run.to(settle)?;
    let before = run.solver.loads()?;
    run.to(1.5 * settle)?;
    let load = run.solver.loads()?.mean_since(&before, 0).unwrap_or_default();
    let gap = inner * inner * outer * outer / (outer * outer - inner * inner);
    let torque = 4.0 * PI * 1000.0 * viscosity * TURN * gap * thick;
    Ok(Outcome {
        metrics: vec![Metric::relative("torque", Kind::Exact, torque, -load.torque.z, 0.15, 0.05)],
        cost: run.cost()?,
        charts: Vec::new(),
    })
}
