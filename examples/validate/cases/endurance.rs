//! Runs over minutes.

use super::super::chart::{Chart, Curve};
use super::super::measure::{kinetic, mean, mean_vector};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, G, Setup, WATER};
use super::block;
use super::slosh;
use pbmpm::{Result, World};

pub fn pool(setup: &Setup) -> Result<Outcome> {
    let dx = DX / setup.refine;
    let (side, thick) = (16.0 * DX, 4.0 * dx);
    let mut world = setup.world([side, side, thick], dx);
    world.materials.push(setup.material("water", WATER, dx));
    world.spawns.push(block(setup, "water", [0.0; 3], [side, 0.5 * side, thick]));
    watch(setup, &world, 0.5 * side, "pool")
}

pub fn tank(setup: &Setup) -> Result<Outcome> {
    watch(setup, &slosh::tank(setup, 0.25 * slosh::LENGTH, slosh::AMPLITUDE), 0.25 * slosh::LENGTH, "tank")
}

/// Mean height, energy and momentum; the first minute is the reference for drift. Ten samples per second, which the
/// curves show as means over six seconds.
fn watch(setup: &Setup, world: &World, deep: f64, name: &str) -> Result<Outcome> {
    let mut run = Run::new(setup, world)?;
    let mass = run.state()?.mass_kg;
    let look = |run: &mut Run| {
        let particles = run.particles()?;
        let speed = mean_vector(&particles, |p| p.velocity).length();
        Ok([mean(&particles, |p| 2.0 * p.position.y / deep), kinetic(&particles) / (mass * G * deep), speed])
    };
    let found = run.sample(60.0 * setup.minutes, (600.0 * setup.minutes) as u32, look)?;
    let over = |part: &[(f64, [f64; 3])], k: usize| part.iter().map(|f| f.1[k]).sum::<f64>() / part.len() as f64;
    let minute = (found.len() as f64 / setup.minutes) as usize;
    let (first, last) = (&found[..minute], &found[found.len() - minute..]);
    let drift = (over(last, 0) - over(first, 0)) / (setup.minutes - 1.0);
    let lost = run.solver.report()?;
    let missing = lost.faults.escaped + lost.faults.quarantined;
    // A closed tank conserves this energy; it must at least not gain any.
    let gained = (over(last, 1) - over(first, 1)).max(0.0);
    let of = |k: usize| found.chunks(60).map(|part| (part[part.len() / 2].0 / 60.0, over(part, k))).collect();
    let chart =
        |what: &str, y, k| Chart::new(format!("{name}, {what}"), "t, min", y, vec![Curve::line(&setup.preset, of(k))]);
    let logarithmic = [false, true];
    Ok(Outcome {
        metrics: vec![
            Metric::zero("drift of the volume per minute", Kind::Exact, drift, 0.01, 1e-3),
            Metric::relative("mean height", Kind::Exact, 1.0, over(last, 0), 0.02, 0.005),
            Metric::zero("energy gained over m g h", Kind::Exact, gained, 1e-4, 1e-6),
            Metric::zero("energy in the last minute over m g h", Kind::Exact, over(last, 1), 1e-3, 1e-5),
            Metric::zero("speed of the centre in the last minute, m/s", Kind::Exact, over(last, 2), 1e-2, 1e-3),
            Metric::zero("particles lost", Kind::Exact, missing as f64, 0.0, 0.0),
        ],
        cost: run.cost()?,
        charts: vec![
            chart("height", "mean height / depth", 0),
            Chart { logarithmic, ..chart("energy", "kinetic energy / (m g h)", 1) },
            Chart { logarithmic, ..chart("momentum", "speed of the centre of mass, m/s", 2) },
        ],
    })
}
