//! Whether errors fall as steps and cells become smaller.

use super::super::outcome::{Kind, Metric, Outcome};
use super::super::setup::Setup;
use super::{Body, column, elastic, slosh, vortex};
use pbmpm::Result;

/// Cases with a number whose error must fall.
const SMOOTH: [(&str, Body, &str); 4] = [
    ("order of the column's height", column::h16, "height loss"),
    ("order of sloshing's frequency", slosh::deep, "frequency"),
    ("order of the vortices' viscosity", vortex::inviscid, "numerical viscosity over U L"),
    ("order of the bar's frequency", elastic::bar, "frequency"),
];

/// The observed order of each over a halving, and its shortfall from the required order.
fn observed(
    setup: &Setup,
    finer: impl Fn(&Setup) -> Setup,
    expected: f64,
    gate: f64,
    target: f64,
    start: Setup,
) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    for (name, body, metric) in SMOOTH {
        let coarse = body(&start)?;
        let fine = body(&finer(setup))?;
        let order = (coarse.error(metric) / fine.error(metric)).log2();
        outcome.metrics.push(Metric {
            name,
            kind: Kind::Exact,
            reference: expected,
            measured: order,
            error: if order.is_nan() { order } else { (expected - order).max(0.0) },
            gate,
            target,
        });
        outcome.cost.add(coarse.cost);
        outcome.cost.add(fine.cost);
    }
    Ok(outcome)
}

/// Liquids as stiff as the iterations can follow, so that shorter steps make them stiffer: with the modulus that a
/// scene needs errors would not vanish.
fn stiff(setup: &Setup) -> Setup {
    Setup { limited: false, ..setup.clone() }
}

pub fn step(setup: &Setup) -> Result<Outcome> {
    let setup = stiff(setup);
    observed(&setup, |s| s.shorter(2.0), 1.0, 0.2, 0.0, setup.clone())
}

/// Cells and steps in proportion, from half the number of cells to the usual one.
pub fn cell(setup: &Setup) -> Result<Outcome> {
    let setup = stiff(setup);
    let coarse = Setup { dt: 2.0 * setup.dt, ..setup.refined(0.5) };
    observed(&setup, Setup::clone, 1.7, 0.7, 0.0, coarse)
}

/// More iterations must not make an error larger: with one, two and four times as many, the worst ratio of an error to
/// the previous one.
pub fn iterations(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let names =
        ["growth of the column's error", "growth of sloshing's", "growth of the vortices'", "growth of the bar's"];
    for ((_, body, metric), name) in SMOOTH.into_iter().zip(names) {
        let mut errors = Vec::new();
        for factor in [1, 2, 4] {
            let found = body(&Setup {
                iterations: factor * setup.iterations,
                ..setup.to_within(setup.tolerance / f64::from(factor))
            })?;
            errors.push(found.error(metric));
            outcome.cost.add(found.cost);
        }
        let growth = errors
            .windows(2)
            .map(|e| e[1] / e[0])
            .fold(f64::NEG_INFINITY, |a, b| if b.is_nan() { b } else { a.max(b) });
        outcome.metrics.push(Metric {
            name,
            kind: Kind::Exact,
            reference: 1.0,
            measured: growth,
            error: if growth.is_nan() { growth } else { (growth - 1.0).max(0.0) },
            gate: 0.1,
            target: 0.0,
        });
    }
    Ok(outcome)
}
