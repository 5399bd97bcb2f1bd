//! Clay that yields under its weight.

use super::super::measure::quantile;
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, G, Matter, Setup, rough_floor};
use super::block;
use pbmpm::{DVec3, Result, Shape, Spawn};

/// In cells.
const HEIGHT: f64 = 10.0;

/// Share of its height by which a cylinder, twice as wide as it is high, sinks on a rough floor under its own weight,
/// which is applied over 0.4 s. `strength` is its yield stress in shear over ρ g H.
fn sink(setup: &Setup, strength: f64, outcome: &mut Outcome) -> Result<f64> {
    let dx = DX / setup.refine;
    let high = HEIGHT * DX;
    let side = 5.0 * high;
    let weight = 1000.0 * G * high;
    let mut world = setup.world([side, 1.5 * high, side], dx);
    rough_floor(&mut world);
    world.gravity = DVec3::ZERO;
    let clay = Matter::Clay { yield_stress: strength * weight };
    world.materials.push(setup.material("clay", clay, dx));
    let (lo, hi) = (0.5 * side - high, 0.5 * side + high);
    let shape = Shape::Cylinder { radius: high, half_height: 0.5 * high };
    world.spawns.push(Spawn { shape, ..block(setup, "clay", [lo, 0.0, lo], [hi, high, hi]) });
    let mut run = Run::new(setup, &world)?;
    // The middle of its top; its rim slumps further.
    let top = |run: &mut Run| -> Result<f64> {
        let mut middle = run.particles()?;
        middle.retain(|p| (p.position - 0.5 * side).with_y(0.0).length() < 0.3 * high);
        Ok(quantile(middle.iter().map(|p| p.position.y).collect(), 0.995))
    };
    let before = top(&mut run)?;
    run.ramp_gravity(DVec3::NEG_Y * G, 0.4)?;
    run.to(0.7)?;
    let after = top(&mut run)?;
    outcome.cost.add(run.cost()?);
    Ok(1.0 - after / before)
}

/// Pashias et al. 1996; measurements agree within 0.05.
fn pashias(strength: f64) -> f64 {
    1.0 - 2.0 * strength * (1.0 - (2.0 * strength).ln())
}

fn measured(setup: &Setup, strengths: &[(f64, &'static str)]) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    for &(strength, name) in strengths {
        let found = sink(setup, strength, &mut outcome)?;
        outcome.metrics.push(Metric::absolute(name, Kind::Exact, pashias(strength), found, 0.1, 0.05));
    }
    Ok(outcome)
}

pub fn slump(setup: &Setup) -> Result<Outcome> {
    measured(setup, &[(0.15, "slump at 0.15, in H")])
}

pub fn slumps(setup: &Setup) -> Result<Outcome> {
    let strengths = [
        (0.05, "slump at 0.05, in H"),
        (0.1, "slump at 0.1, in H"),
        (0.2, "slump at 0.2, in H"),
        (0.3, "slump at 0.3, in H"),
    ];
    measured(setup, &strengths)
}
