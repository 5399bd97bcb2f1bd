//! Records of several devices side by side, as tables.

use super::record::Row;
use super::{fit, thesis};
use std::collections::BTreeSet;

/// Points of the sweeps that are printed from a full record; pictures show all.
const SHOWN: &[(&str, &[&str])] = &[
    ("particles", &["10", "20", "25", "30", "40", "50"]),
    ("iterations", &["1", "2", "3", "5", "6", "10"]),
    ("cells", &["0.3", "0.5", "1", "1.1", "1.5", "2.1", "3"]),
    ("frequency", &["10", "30", "130", "140", "200", "250"]),
];

/// Largest time of the other side of a skipping line over that of the plain side; it is missed only if processor time
/// agrees.
fn gate(line: &str) -> Option<f64> {
    let free = ["domain", "a liquid of", "a solid of", "an emitter that", "256 boxes"];
    let asleep = ["a pool of", "the same, stirred"];
    let is_one = |of: &[&str]| of.iter().any(|g| line.starts_with(g));
    is_one(&free).then_some(1.03).or(is_one(&asleep).then_some(0.2))
}

/// Whether both sides must reach the same state.
fn must_agree(line: &str) -> bool {
    !["iterations ended", "a pool of", "the same, stirred", "elastic matter"].iter().any(|g| line.starts_with(g))
}

impl Row {
    /// Whether the other side of a skipping line has reached another state than this one although it must not. Graphics
    /// processors may round differently in each pipeline.
    pub fn differs(&self, other: &Row) -> bool {
        must_agree(&self.point) && self.is_software() && self.state != other.state
    }
}

/// The records of one device.
#[derive(Debug, Clone)]
pub struct Device {
    pub name: String,
    pub rows: Vec<Row>,
}

impl Device {
    pub fn of(rows: Vec<Row>) -> Option<Device> {
        Some(Device { name: rows.first()?.backend.clone(), rows })
    }

    fn find(&self, sweep: &str, point: &str, side: &str) -> Option<&Row> {
        self.rows.iter().find(|r| r.sweep == sweep && r.point == point && r.side == side)
    }
}

/// All tables for which there are rows.
pub fn all(devices: &[Device]) -> Vec<String> {
    let scaling = ["scaling", "solids"].map(|sweep| scaling(devices, sweep));
    let tables = [sweeps(devices), fits(devices)].into_iter().chain(scaling).chain([frames(devices)]);
    let tables = tables.chain(stages(devices)).chain([memory(devices), skipping(devices)]);
    tables.filter(|table| table.lines().count() > 2).collect()
}

/// Points of a sweep, in the order of the first device that has them.
fn distinct<'a>(devices: &'a [Device], sweep: &str) -> Vec<&'a str> {
    points_of(devices, |row| row.sweep == sweep)
}

fn points_of(devices: &[Device], is_one: impl Fn(&Row) -> bool) -> Vec<&str> {
    let mut points: Vec<&str> = Vec::new();
    for row in devices.iter().flat_map(|d| &d.rows).filter(|row| is_one(row)) {
        if !points.contains(&row.point.as_str()) {
            points.push(&row.point);
        }
    }
    points
}

fn head(first: &[&str], devices: &[Device], of_each: &[&str]) -> String {
    let named = devices.iter().flat_map(|d| of_each.iter().map(move |c| format!("{}{c}", d.name)));
    let cells: Vec<String> = first.iter().map(|c| (*c).to_owned()).chain(named).collect();
    format!("| {} |\n|{}\n", cells.join(" | "), "---|".repeat(cells.len()))
}

fn line(cells: Vec<String>) -> String {
    format!("| {} |\n", cells.join(" | "))
}

/// Three significant digits.
fn short(x: f64) -> String {
    let digits = if x == 0.0 { 0 } else { (2 - x.abs().log10().floor() as i32).clamp(0, 4) };
    format!("{x:.0$}", digits as usize)
}

/// Stands for a device that has no such row.
fn none() -> String {
    "–".to_owned()
}

fn sweeps(devices: &[Device]) -> String {
    let mut text = head(&["sweep", "at", "thesis"], devices, &[", ms"]);
    for (sweep, shown) in SHOWN {
        for point in shown.iter().filter(|p| devices.iter().any(|d| d.find(sweep, p, "").is_some())) {
            let published = match thesis::ms(sweep, point) {
                Some(ms) => format!("{ms} ms"),
                None if *sweep == "frequency" => {
                    thesis::fps(point).map_or_else(String::new, |fps| format!("{fps} fps"))
                }
                None => String::new(),
            };
            let ours = |d: &Device| {
                d.find(sweep, point, "").map_or_else(none, |r| {
                    format!("{} ({} to {})", short(r.median_ms), short(r.min_ms), short(r.max_ms))
                })
            };
            let first = [(*sweep).to_owned(), (*point).to_owned(), published];
            text += &line(first.into_iter().chain(devices.iter().map(ours)).collect());
        }
    }
    text
}

fn fits(devices: &[Device]) -> String {
    let first = "| of | a, ms | b, ns per particle | c, ns per block | d, ns per particle | error | at worst |\n|---|---|---|---|---|---|---|\n";
    let mut text = first.to_owned();
    for device in devices {
        for fit in [fit::of_thesis(&device.rows), fit::with_once(&device.rows)].into_iter().flatten() {
            let percent = |x: f64| format!("{:.0} %", x * 100.0);
            let mut cells = vec![device.name.clone(), short(fit.coefficients[0])];
            cells.extend(fit.coefficients[1..].iter().map(|c| short(c * 1e6)));
            cells.resize(5, String::new());
            cells.extend([percent(fit.residual), percent(fit.worst)]);
            text += &line(cells);
        }
    }
    text
}

fn scaling(devices: &[Device], sweep: &str) -> String {
    let mut text = head(&["particles"], devices, &[", ms", ", ns per particle and iteration"]);
    let found = |point: &str| devices.iter().map(|d| d.find(sweep, point, "")).collect::<Vec<Option<&Row>>>();
    let count = |rows: &[Option<&Row>]| rows.iter().flatten().next().map_or(0, |r| r.particles);
    let mut all: Vec<_> = distinct(devices, sweep).into_iter().map(found).collect();
    all.sort_by_key(|rows| count(rows));
    for rows in all {
        let count = count(&rows).to_string();
        let ours = rows.iter().flat_map(|r| match r {
            Some(r) => [short(r.least()), short(r.per_particle())],
            None => [none(), none()],
        });
        text += &line([count].into_iter().chain(ours).collect());
    }
    text
}

fn frames(devices: &[Device]) -> String {
    let mut text = head(&["particles"], devices, &[", ms per frame", ", iterations"]);
    for point in distinct(devices, "frames") {
        let rows: Vec<Option<&Row>> = devices.iter().map(|d| d.find("frames", point, "")).collect();
        let count = rows.iter().flatten().next().map_or_else(none, |r| r.particles.to_string());
        let ours = rows.iter().flat_map(|r| match r {
            Some(r) => {
                [format!("{} ({} to {})", short(r.median_ms), short(r.min_ms), short(r.max_ms)), short(r.iterations)]
            }
            None => [none(), none()],
        });
        text += &line([count].into_iter().chain(ours).collect());
    }
    text
}

/// A table for each world whose stages were timed.
fn stages(devices: &[Device]) -> Vec<String> {
    let timed = |r: &&Row| r.sweep == "stages";
    let sides: BTreeSet<&str> = devices.iter().flat_map(|d| &d.rows).filter(timed).map(|r| r.side.as_str()).collect();
    let table = |side: &str| {
        let first = if side.is_empty() { "stage".to_owned() } else { format!("stage, {side}") };
        let mut text = head(&[&first], devices, &[", ms"]);
        for point in points_of(devices, |row| timed(&row) && row.side == side) {
            let found = devices.iter().map(|d| d.find("stages", point, side));
            let ours = found.map(|row| row.map_or_else(none, |r| short(r.mean_ms)));
            text += &line([point.to_owned()].into_iter().chain(ours).collect());
        }
        text
    };
    sides.into_iter().map(table).collect()
}

fn memory(devices: &[Device]) -> String {
    let first = ["particles at m", "cells of the box", "thesis: particles + nodes + tile cache"];
    let mut text = head(&first, devices, &[": particles + grid + bins + other"]);
    for known in &thesis::MEMORY {
        let point = known.point();
        let rows: Vec<Option<&Row>> = devices.iter().map(|d| d.find("memory", &point, "")).collect();
        if rows.iter().all(Option::is_none) {
            continue;
        }
        let published = format!("{} + {} + {} = {}", known.particles, known.nodes, known.tiles, known.total);
        let ours = rows.iter().map(|r| {
            r.map_or_else(none, |r| {
                let parts = [r.particle_bytes, r.grid_bytes, r.bin_bytes, r.other_bytes];
                let parts = parts.map(|bytes| format!("{:.2}", bytes as f64 / f64::from(1 << 20)));
                format!("{} = {:.2}", parts.join(" + "), r.mebibytes())
            })
        });
        let cells = thesis::cells(known.cell_size).to_string();
        text += &line([point, cells, published].into_iter().chain(ours).collect());
    }
    text
}

fn skipping(devices: &[Device]) -> String {
    let mut text = head(&["line", "gate"], devices, &[": time (processor time)", ", MiB more"]);
    for point in distinct(devices, "skipping") {
        let limit = gate(point);
        let ours = devices.iter().flat_map(|d| {
            let sides = [d.find("skipping", point, "plain"), d.find("skipping", point, "other")];
            let [Some(plain), Some(other)] = sides else {
                return [none(), none()];
            };
            let ratios: Vec<f64> = other.ratio.into_iter().chain(other.processor_ratio).collect();
            // Other programs may have slowed one side down.
            let missed = limit.is_some_and(|most| ratios.iter().all(|ratio| *ratio > most));
            let mut time = ratios.first().map_or_else(none, |ratio| format!("{ratio:.3}"));
            if let Some(ratio) = other.processor_ratio {
                time += &format!(" ({ratio:.3})");
            }
            if missed {
                time = format!("**{time}**");
            }
            if plain.differs(other) {
                time += "; **states differ**";
            }
            [time, format!("{:.2}", other.mebibytes() - plain.mebibytes())]
        });
        let gate = limit.map_or_else(String::new, |most| format!("{most}"));
        text += &line([point.to_owned(), gate].into_iter().chain(ours).collect());
    }
    text
}
