//! Whether errors fall as steps and cells get smaller.

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

/// The observed order of each over a halving, and how far it falls short of what is asked for.
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

pub fn step(setup: &Setup) -> Result<Outcome> {
    let half = |s: &Setup| Setup { dt: 0.5 * s.dt, ..s.clone() };
    observed(setup, half, 1.0, 0.2, 0.0, setup.clone())
}

/// Cells and steps in proportion, from half as many cells to the usual number.
pub fn cell(setup: &Setup) -> Result<Outcome> {
    let coarse = Setup { dt: 2.0 * setup.dt, ..setup.refined(0.5) };
    observed(setup, Setup::clone, 1.7, 0.7, 0.0, coarse)
}
