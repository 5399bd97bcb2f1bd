//! The quick validation cases, at their gates, where a scheme meets them.

use crate::backends::{Backend, CPUS, Tests};
use crate::suite::cases::CASES;
use crate::suite::file;
use crate::suite::outcome::Verdict;
use crate::suite::setup::{self, Preset, Scheme, Setup};
use crate::suite::table::{self, Row};
use std::path::Path;

pub fn add(tests: &mut Tests) {
    tests.each("validation", CPUS, "flight", flight);
    tests.each("validation", &[Backend::Cpu64], "transfers_are_exact", transfers_are_exact);
    tests.each("validation", &[Backend::Cpu], "transfers_round_little", transfers_round_little);
    tests.each("validation", &[Backend::Cpu], "published_substeps", published_substeps);
    tests.each("validation", &[Backend::Cpu], "published_friction_and_clay", published_friction_and_clay);
    tests.each("validation", &[Backend::Cpu], "implicit_liquids", implicit_liquids);
    tests.each("validation", &[Backend::Cpu], "implicit_solids", implicit_solids);
    tests.each("validation", &[Backend::Cpu], "explicit_solids", explicit_solids);
    tests.each("validation", &[Backend::Cpu], "explicit_grains_and_clay", explicit_grains_and_clay);
    tests.each("validation", &[Backend::Cpu], "explicit_liquids", explicit_liquids);
    tests.once("validation", "names_are_used_once", names_are_used_once);
    tests.once(
        "validation",
        "tables_of_the_docs_are_those_of_the_records",
        tables_of_the_docs_are_those_of_the_records,
    );
    tests.once(
        "validation",
        "a_device_has_left_the_states_of_the_cpu_path",
        a_device_has_left_the_states_of_the_cpu_path,
    );
}

fn of(backend: Backend, scheme: Scheme, preset: Preset) -> Setup {
    let backend = if backend == Backend::Cpu64 { setup::Backend::Cpu64 } else { setup::Backend::Cpu };
    Setup::new(scheme, preset, backend)
}

/// Runs a case; fails if one of these metrics exceeds its gate.
fn holds(setup: &Setup, case: &str, metrics: &[&str]) {
    let case = CASES.iter().find(|c| c.name == case).unwrap_or_else(|| panic!("no case {case}"));
    let outcome = (case.body)(setup).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    for name in metrics {
        let metric = outcome.metrics.iter().find(|m| m.name == *name);
        let metric = metric.unwrap_or_else(|| panic!("{} has no {name}", case.name));
        assert_ne!(metric.verdict(), Verdict::Fail, "{} ({}): {metric:?}", case.name, setup.preset);
    }
}

fn flight(backend: Backend) {
    for &scheme in Scheme::ALL {
        let setup = of(backend, scheme, Preset::Realtime);
        holds(&setup, "a1-fall", &["fall of the centre", "change of a lattice's shape, cells"]);
        holds(&setup, "a1-drift", &["difference by a drift, cells"]);
        holds(&setup, "a2-momentum", &["mass", "drift of momentum, cells/step"]);
    }
}

fn transfers_are_exact(backend: Backend) {
    for &scheme in Scheme::ALL {
        holds(&of(backend, scheme, Preset::Realtime), "a2-transfer", &["rotation through a transfer"]);
    }
}

/// In `f32`, where sums on the grid are rounded.
fn transfers_round_little(backend: Backend) {
    for scheme in [Scheme::Implicit, Scheme::Explicit] {
        holds(&of(backend, scheme, Preset::Realtime), "a2-transfer", &["rotation through a transfer"]);
    }
}

/// With one iteration in each of many steps the published scheme meets these gates, which it does not meet with more
/// iterations.
fn published_substeps(backend: Backend) {
    let setup = of(backend, Scheme::Published, Preset::Accurate);
    let dam = ["front against the converged, in a", "speed of the front", "energy left"];
    holds(&setup, "a4-dam", &dam);
    holds(&setup, "a9-bar", &["frequency", "Young's modulus"]);
    holds(&setup, "a3-solid", &["settlement, Poisson's ratio 0"]);
}

fn published_friction_and_clay(backend: Backend) {
    let setup = of(backend, Scheme::Published, Preset::Realtime);
    holds(&setup, "a12-block", &["acceleration above, m/s²", "acceleration below, m/s²"]);
    holds(&setup, "a14-slump", &["slump at 0.15, in H"]);
}

fn implicit_liquids(backend: Backend) {
    let setup = of(backend, Scheme::Implicit, Preset::Realtime);
    let column = ["height loss", "force on the wall", "moment on the wall", "density at the bottom"];
    holds(&setup, "a3-16", &column);
    holds(&setup, "b4-layers", &column);
    let dam = ["front against the converged, in a", "speed of the front", "energy left", "volume noise"];
    holds(&setup, "a4-dam", &dam);
    holds(&setup, "b2-spheres", &["drag"]);
}

fn implicit_solids(backend: Backend) {
    let setup = of(backend, Scheme::Implicit, Preset::Accurate);
    holds(&setup, "a9-bar", &["frequency", "Young's modulus", "damping ratio"]);
    holds(&setup, "a9-hanging", &["mean sag, m"]);
    let setup = of(backend, Scheme::Implicit, Preset::Realtime);
    holds(&setup, "a3-solid", &["settlement, Poisson's ratio 0", "settlement, Poisson's ratio 0.3"]);
    holds(&setup, "a12-block", &["acceleration above, m/s²", "acceleration below, m/s²"]);
    holds(&setup, "a11-ball", &["energy gained", "sticking"]);
    holds(&setup, "b3-torsion", &["frequency, Hz", "damping ratio"]);
}

fn explicit_solids(backend: Backend) {
    let setup = of(backend, Scheme::Explicit, Preset::Realtime);
    holds(&setup, "a9-bar", &["frequency", "Young's modulus", "damping ratio"]);
    holds(&setup, "a9-hanging", &["mean sag, m"]);
    holds(&setup, "a3-solid", &["settlement, Poisson's ratio 0", "settlement, Poisson's ratio 0.3"]);
    holds(&setup, "a11-ball", &["restitution", "duration of the contact, s", "energy gained", "sticking"]);
    holds(&setup, "a12-block", &["acceleration above, m/s²", "acceleration below, m/s²"]);
    holds(&setup, "b3-torsion", &["frequency, Hz", "damping ratio"]);
}

fn explicit_grains_and_clay(backend: Backend) {
    let setup = of(backend, Scheme::Explicit, Preset::Realtime);
    holds(&setup, "a14-slump", &["slump at 0.15, in H"]);
    holds(&setup, "a13-1", &["runout", "height", "slope outside of 25 to 31 degrees"]);
}

fn explicit_liquids(backend: Backend) {
    let setup = of(backend, Scheme::Explicit, Preset::Realtime);
    let column = ["height loss", "force on the wall", "moment on the wall", "density at the bottom"];
    holds(&setup, "a3-16", &column);
    // This gate is missed where sound travels no more than half a cell per step.
    holds(&setup, "a3-32", &column);
    holds(&setup, "b4-layers", &column);
    let dam = ["front against the converged, in a", "speed of the front", "energy left", "volume noise"];
    holds(&setup, "a4-dam", &dam);
    holds(&setup, "b2-spheres", &["drag"]);
}

fn names_are_used_once() {
    for (i, case) in CASES.iter().enumerate() {
        assert!(CASES[..i].iter().all(|other| other.name != case.name), "{}", case.name);
    }
}

/// The output of `validate --compare` for the files that the docs name with it.
fn tables_of_the_docs_are_those_of_the_records() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let docs = std::fs::read_to_string(root.join("docs/accuracy.md")).expect("docs/accuracy.md");
    let commands: Vec<&str> =
        docs.lines().filter_map(|line| line.split_once("validate -- --compare ")).map(|c| c.1).collect();
    assert_eq!(commands.len(), 2, "{commands:?}");
    for command in commands {
        let read = |file: &str| file::read(&root.join(file)).unwrap_or_else(|e| panic!("{e}"));
        let rows: Vec<_> = command.split_whitespace().flat_map(read).collect();
        assert!(docs.contains(&table::comparison(&rows)), "not the table of {command}");
    }
}

/// Which number of which run it is.
fn number(row: &Row) -> [&str; 4] {
    [&row.case, &row.metric, &row.scheme, &row.preset]
}

/// In the records, as written by the commands that the docs state.
fn a_device_has_left_the_states_of_the_cpu_path() {
    let record = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/record");
    let read = |name: &str| -> Vec<Row> { file::read(&record.join(name)).unwrap_or_else(|e| panic!("{e}")) };
    let names = ["published", "implicit", "explicit"].map(|scheme| format!("validate-{scheme}.csv"));
    let cpu: Vec<Row> = names.iter().flat_map(|name| read(name)).collect();
    let device = read("validate-llvmpipe.csv");
    assert!(device.len() > 100, "{} numbers", device.len());
    for there in &device {
        let here = cpu
            .iter()
            .find(|here| number(here) == number(there))
            .unwrap_or_else(|| panic!("not in the CPU path's records: {there:?}"));
        let found = |row: &Row| (row.state.clone(), row.measured.to_bits());
        assert_eq!(found(here), found(there), "{}, {}, {}", there.case, there.metric, there.scheme);
    }
}
