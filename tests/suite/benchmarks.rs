//! The records of the bench `sweeps`, and the tables made from them.

use crate::backends::Tests;
use crate::suite::file;
use crate::sweeps::record::Row;
use crate::sweeps::table::{self, Device};
use crate::sweeps::{fit, thesis};
use std::path::Path;

pub fn add(tests: &mut Tests) {
    tests.once(
        "benchmarks",
        "tables_of_the_docs_are_those_of_the_records",
        tables_of_the_docs_are_those_of_the_records,
    );
    tests.once("benchmarks", "records_keep_to_their_states", records_keep_to_their_states);
    tests.once("benchmarks", "a_fit_finds_what_times_are_made_of", a_fit_finds_what_times_are_made_of);
    tests.once("benchmarks", "the_box_of_the_thesis_has_its_cells", the_box_of_the_thesis_has_its_cells);
}

/// The files that docs/performance.md names beside the command that prints them.
fn devices() -> (String, Vec<Device>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let docs = std::fs::read_to_string(root.join("docs/performance.md")).expect("docs/performance.md");
    let files = docs.lines().find_map(|line| line.split_once("sweeps -- --draw ")).expect("no command").1.to_owned();
    let read = |file: &str| file::read(&root.join(file)).unwrap_or_else(|e| panic!("{e}"));
    let devices: Vec<Device> = files.split(',').filter_map(|file| Device::of(read(file))).collect();
    assert!(devices.len() >= 2, "{files}");
    (docs, devices)
}

fn tables_of_the_docs_are_those_of_the_records() {
    let (docs, devices) = devices();
    let tables = table::all(&devices);
    assert_eq!(tables.len(), 8);
    for text in tables {
        assert!(docs.contains(&text), "not in the docs:\n{text}");
    }
}

/// The same world after the same steps has the same state in all records, whatever was skipped, except on graphics
/// processors, which may round differently.
fn records_keep_to_their_states() {
    let (_, devices) = devices();
    let twice: Vec<&Row> = devices.iter().flat_map(|d| &d.rows).collect();
    let alike = |a: &Row, b: &Row| a.device == b.device || a.is_software() && b.is_software();
    let is_same = |a: &Row, b: &Row| (&a.sweep, &a.point, &a.side) == (&b.sweep, &b.point, &b.side) && alike(a, b);
    for (i, a) in twice.iter().enumerate() {
        // Windows of other lengths end at other steps.
        for b in twice[..i].iter().filter(|b| is_same(a, b) && (a.steps == b.steps || a.sweep == "skipping")) {
            assert_eq!(a.state, b.state, "{} {} on {} and {}", a.sweep, a.point, a.backend, b.backend);
        }
        for b in twice[..i].iter().filter(|b| a.sweep == "skipping" && a.point == b.point && a.backend == b.backend) {
            assert!(!a.differs(b), "{} on {}", a.point, a.backend);
        }
    }
}

fn a_fit_finds_what_times_are_made_of() {
    let time = |p: f64, g: f64, i: f64| 0.3 + i * (40e-6 * p + 1.2e-3 * g);
    let row = |(p, g, i): (usize, f64, f64)| Row {
        sweep: "particles".to_owned(),
        particles: p,
        active_blocks: g,
        iterations: i,
        median_ms: time(p as f64, g, i),
        ..Row::default()
    };
    let rows =
        [(2000, 90.0, 1.0), (31_250, 400.0, 1.0), (31_250, 400.0, 5.0), (250_000, 900.0, 1.0), (8000, 2000.0, 2.0)];
    let mut rows = rows.map(row);
    let fit = fit::of_thesis(&rows).expect("a fit");
    for (found, known) in fit.coefficients.iter().zip([0.3, 40e-6, 1.2e-3]) {
        assert!((found / known - 1.0).abs() < 1e-6, "{fit:?}");
    }
    assert!(fit.worst < 1e-9, "{fit:?}");
    rows[1].median_ms *= 1.2;
    assert!(fit::of_thesis(&rows).expect("a fit").residual > 0.01);
    assert!(fit::of_thesis(&rows[1..3]).is_none(), "two points do not tell three terms");
}

fn the_box_of_the_thesis_has_its_cells() {
    let known = [(0.3, 5_110_200), (0.5, 1_101_600), (0.8, 269_824), (1.0, 137_700), (2.4, 9702), (3.0, 5202)];
    for (size, cells) in known {
        assert_eq!(thesis::cells(size), cells, "{size}");
    }
}
