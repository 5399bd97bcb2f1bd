//! The results as CSV and as a table.

use crate::suite::outcome::{Cost, Metric};
use crate::suite::setup::Setup;

/// A number with everything that it depends on.
#[derive(Debug, Clone)]
pub struct Row {
    case: &'static str,
    metric: Metric,
    cost: Cost,
    setup: Setup,
}

const COLUMNS: [&str; 20] = [
    "case",
    "metric",
    "kind",
    "reference",
    "measured",
    "error",
    "gate",
    "target",
    "verdict",
    "passes",
    "particles",
    "seconds",
    "scheme",
    "preset",
    "backend",
    "dt",
    "iterations",
    "refine",
    "faults",
    "state",
];
/// Those of the table for people.
const SHOWN: usize = 15;

impl Row {
    pub fn new(case: &'static str, metric: &Metric, cost: &Cost, setup: &Setup) -> Row {
        Row { case, metric: metric.clone(), cost: *cost, setup: setup.clone() }
    }

    fn fields(&self, number: fn(f64) -> String) -> [String; COLUMNS.len()] {
        let (m, cost, setup) = (&self.metric, &self.cost, &self.setup);
        [
            self.case.to_owned(),
            m.name.to_owned(),
            m.kind.letter().to_owned(),
            number(m.reference),
            number(m.measured),
            number(m.error),
            number(m.gate),
            number(m.target),
            m.verdict().name().to_owned(),
            format!("{:.0}", cost.passes),
            cost.particles.to_string(),
            format!("{:.2}", cost.seconds),
            setup.scheme.name().to_owned(),
            setup.preset.clone(),
            setup.backend.name().to_owned(),
            number(setup.dt),
            setup.iterations.to_string(),
            number(setup.refine),
            cost.faults.to_string(),
            format!("{:016x}", cost.hash),
        ]
    }
}

/// Numbers as they are.
pub fn csv(rows: &[Row]) -> String {
    let quoted = |field: String| if field.contains(',') { format!("\"{field}\"") } else { field };
    let mut text = COLUMNS.join(",") + "\n";
    for row in rows {
        text += &(row.fields(|x| x.to_string()).map(quoted).join(",") + "\n");
    }
    text
}

/// Numbers to three places.
pub fn markdown(rows: &[Row]) -> String {
    let mut lines: Vec<Vec<String>> = vec![COLUMNS[..SHOWN].iter().map(|c| (*c).to_owned()).collect()];
    lines.extend(rows.iter().map(|row| row.fields(short)[..SHOWN].to_vec()));
    let widths: Vec<usize> =
        (0..SHOWN).map(|k| lines.iter().map(|l| l[k].chars().count()).max().unwrap_or(0)).collect();
    let line = |fields: &[String]| {
        let padded: Vec<_> = fields.iter().zip(&widths).map(|(f, w)| format!("{f:w$}")).collect();
        format!("| {} |\n", padded.join(" | "))
    };
    let rule: Vec<String> = widths.iter().map(|w| "-".repeat(*w)).collect();
    let mut text = line(&lines[0]) + &line(&rule);
    lines[1..].iter().for_each(|fields| text += &line(fields));
    text
}

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
