//! The results as CSV and as tables.

use super::cases::CASES;
use super::origin::Origin;
use super::outcome::{Cost, Metric};
use super::setup::Setup;
use serde::{Deserialize, Serialize};

/// A number with all parameters that it depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub case: String,
    pub metric: String,
    pub kind: String,
    pub reference: f64,
    pub measured: f64,
    pub error: f64,
    pub gate: f64,
    pub target: f64,
    pub verdict: String,
    pub passes: f64,
    pub particles: usize,
    pub seconds: f64,
    pub scheme: String,
    pub preset: String,
    pub backend: String,
    pub dt: f64,
    pub iterations: u32,
    pub tolerance: f64,
    pub refine: f64,
    pub faults: u64,
    pub state: String,
    pub device: String,
    pub commit: String,
}

impl Row {
    pub fn new(case: &str, metric: &Metric, cost: &Cost, setup: &Setup, origin: &Origin) -> Row {
        Row {
            case: case.to_owned(),
            metric: metric.name.to_owned(),
            kind: metric.kind.letter().to_owned(),
            reference: metric.reference,
            measured: metric.measured,
            error: metric.error,
            gate: metric.gate,
            target: metric.target,
            verdict: metric.verdict().name().to_owned(),
            passes: cost.passes,
            particles: cost.particles,
            seconds: (cost.seconds * 1e3).round() / 1e3,
            scheme: setup.scheme.name().to_owned(),
            preset: setup.preset.clone(),
            backend: setup.backend.name().to_owned(),
            dt: cost.simulated / cost.steps as f64,
            iterations: setup.iterations,
            tolerance: setup.tolerance,
            refine: setup.refine,
            faults: cost.faults,
            state: format!("{:016x}", cost.hash),
            device: origin.device.clone(),
            commit: origin.commit.clone(),
        }
    }

    fn setup(&self) -> [&str; 3] {
        [&self.scheme, &self.preset, &self.backend]
    }

    fn marked_error(&self) -> String {
        let error = short(self.error);
        match self.verdict.as_str() {
            "target" => error + " *",
            "gate" => error,
            _ => format!("**{error}**"),
        }
    }
}

/// A line per number.
pub fn markdown(rows: &[Row]) -> String {
    let head = ["case", "number", "kind", "reference", "measured", "error", "gate", "target", "verdict", "passes", "s"];
    let mut lines = vec![line(&head)];
    lines[0].extend(line(&["scheme", "preset", "backend"]));
    lines.extend(rows.iter().map(|r| {
        let mut line = line(&[&r.case, &r.metric, &r.kind]);
        line.extend([r.reference, r.measured, r.error, r.gate, r.target].map(short));
        line.extend([r.verdict.clone(), format!("{:.0}", r.passes), short(r.seconds)]);
        line.extend([&r.scheme, &r.preset, &r.backend].map(String::clone));
        line
    }));
    aligned(&lines)
}

/// A line for each number of a case, a column for each scheme and preset: the error, bold beyond its gate and with a
/// star where it meets its target. The line above gives the cost of the case.
pub fn comparison(rows: &[Row]) -> String {
    // In the order of the suite, whatever the order of the records.
    let mut ordered: Vec<&Row> = rows.iter().collect();
    ordered.sort_by_key(|row| CASES.iter().position(|case| case.name == row.case));
    let setups = distinct(rows.iter().map(Row::setup));
    let mut lines = vec![line(&["case", "number", "kind", "reference", "gate", "target"])];
    lines[0].extend(setups.iter().map(|[scheme, preset, backend]| match *backend {
        "cpu" => format!("{scheme}, {preset}"),
        other => format!("{scheme}, {preset}, {other}"),
    }));
    for case in distinct(ordered.iter().map(|row| row.case.as_str())) {
        let of_case: Vec<&Row> = ordered.iter().copied().filter(|row| row.case == case).collect();
        let cost = |row: &&Row| format!("{:.0}; {}", row.passes, short(row.seconds));
        let mut costs = line(&[case, "passes; s", "", "", "", ""]);
        costs
            .extend(setups.iter().map(|s| of_case.iter().find(|row| row.setup() == *s).map_or_else(String::new, cost)));
        lines.push(costs);
        for metric in distinct(of_case.iter().map(|row| row.metric.as_str())) {
            let found: Vec<&Row> = of_case.iter().copied().filter(|row| row.metric == metric).collect();
            let mut numbers = line(&["", metric, &found[0].kind]);
            numbers.extend([found[0].reference, found[0].gate, found[0].target].map(short));
            let error = |row: &&Row| row.marked_error();
            numbers.extend(
                setups.iter().map(|s| found.iter().find(|row| row.setup() == *s).map_or_else(String::new, error)),
            );
            lines.push(numbers);
        }
    }
    aligned(&lines)
}

/// The distinct items, in order of first occurrence.
pub fn distinct<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    let mut once = Vec::new();
    all.for_each(|item| {
        if !once.contains(&item) {
            once.push(item);
        }
    });
    once
}

fn line(fields: &[&str]) -> Vec<String> {
    fields.iter().map(|field| (*field).to_owned()).collect()
}

/// A Markdown table whose columns are as wide as their widest field; the first line is its head.
fn aligned(lines: &[Vec<String>]) -> String {
    let widths: Vec<usize> =
        (0..lines[0].len()).map(|k| lines.iter().map(|l| l[k].chars().count()).max().unwrap_or(0)).collect();
    let line = |fields: &[String]| {
        let padded: Vec<_> = fields.iter().zip(&widths).map(|(f, w)| format!("{f:w$}")).collect();
        format!("| {} |\n", padded.join(" | "))
    };
    let rule: Vec<String> = widths.iter().map(|w| "-".repeat(*w)).collect();
    let mut text = line(&lines[0]) + &line(&rule);
    lines[1..].iter().for_each(|fields| text += &line(fields));
    text
}

/// Rounded to three places.
fn short(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || !x.is_finite() {
        format!("{x}")
    } else if (1e-3..1e4).contains(&size) {
        let places = (2 - size.log10().floor() as i32).max(0) as usize;
        format!("{x:.places$}")
    } else {
        format!("{x:.1e}")
    }
}
