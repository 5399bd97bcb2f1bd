//! The Pareto front: the points that no other point beats in both error and work.

use crate::record::Record;
use crate::suite::chart::{Chart, Curve, sheet};
use crate::suite::file::{Failure, read};
use crate::suite::table::distinct;
use std::path::Path;

/// Smaller errors count as none.
const FLOOR: f64 = 1e-4;

/// The records for which no cheaper one is as accurate, cheapest first.
fn pareto<'a>(records: &[&'a Record], seconds: bool) -> Vec<&'a Record> {
    let mut sorted: Vec<_> = records.iter().copied().filter(|r| r.error.is_finite()).collect();
    sorted.sort_by(|a, b| a.work(seconds).total_cmp(&b.work(seconds)).then(a.error.total_cmp(&b.error)));
    let mut best = f64::INFINITY;
    sorted.retain(|r| {
        r.error < best && {
            best = r.error;
            true
        }
    });
    sorted
}

/// The records of each problem and scheme, in order of first occurrence.
fn groups(records: &[Record]) -> Vec<(String, String, Vec<&Record>)> {
    let mut groups: Vec<(String, String, Vec<&Record>)> = Vec::new();
    for r in records {
        match groups.iter_mut().find(|g| g.0 == r.problem && g.1 == r.scheme) {
            Some(group) => group.2.push(r),
            None => groups.push((r.problem.clone(), r.scheme.clone(), vec![r])),
        }
    }
    groups
}

/// A picture of all problems against passes, and one against time.
pub fn draw(records: &[Record], out: &Path) -> Result<(), Failure> {
    let groups = groups(records);
    let problems = distinct(groups.iter().map(|g| g.0.as_str()));
    let schemes = distinct(groups.iter().map(|g| g.1.as_str()));
    for (seconds, axis, name) in [(false, "passes times particles", "passes"), (true, "time, s", "seconds")] {
        let chart = |problem: &&str| {
            let mut curves = Vec::new();
            for (_, scheme, found) in groups.iter().filter(|g| g.0 == *problem) {
                let color = schemes.iter().position(|s| s == scheme);
                let points = |records: &[&Record]| records.iter().map(|r| (r.work(seconds), r.error)).collect();
                let front = Curve::line(scheme.as_str(), points(&pareto(found, seconds)));
                let all = Curve::dots("", points(found));
                curves.extend([front, all].map(|curve| Curve { color, ..curve }));
            }
            Chart { logarithmic: [true; 2], ..Chart::new(*problem, axis, "error", curves) }
        };
        let charts: Vec<Chart> = problems.iter().map(chart).collect();
        sheet(&out.join(format!("work_precision-{name}.svg")), &charts, 3)?;
    }
    Ok(())
}

/// The fronts against passes times particles.
pub fn table(records: &[Record]) -> String {
    let mut text = "| problem | scheme | steps/s x iterations | tolerance | refine | passes | seconds | error |\n|---|---|---|---|---|---|---|---|\n".to_owned();
    for (problem, scheme, found) in groups(records) {
        for r in pareto(&found, false) {
            text += &format!(
                "| {problem} | {scheme} | {:.0} x {} | {} | {} | {:.0} | {:.2} | {:.2e} |\n",
                r.hertz, r.iterations, r.tolerance, r.refine, r.passes, r.seconds, r.error
            );
        }
    }
    text
}

/// Seconds for which [`at_equal_time`] compares.
const BUDGETS: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// The least error of each scheme within each of these times, on the smallest cells.
pub fn at_equal_time(records: &[Record]) -> String {
    let finest = records.iter().map(|r| r.refine).fold(0.0, f64::max);
    let fine: Vec<Record> = records.iter().filter(|r| r.refine == finest).cloned().collect();
    let mut text = "| problem | scheme |".to_owned();
    BUDGETS.iter().for_each(|budget| text += &format!(" {budget} s |"));
    text += &format!("\n|---|---|{}\n", "---|".repeat(BUDGETS.len()));
    for (problem, scheme, found) in groups(&fine) {
        text += &format!("| {problem} | {scheme} |");
        let front = pareto(&found, true);
        for budget in BUDGETS {
            let best = front.iter().rfind(|r| r.seconds <= budget);
            text += &best.map_or_else(|| "  |".to_owned(), |r| format!(" {:.2e} |", r.error));
        }
        text += "\n";
    }
    text
}

/// The error of a front at this much work, interpolated logarithmically between its points: runs whose iterations end by
/// tolerance take a little more or less work each time, so the points of two fronts do not coincide. Before the first
/// point, that point's error if it takes at most `slack` times the work.
fn error_at(front: &[&Record], work: f64, slack: f64, seconds: bool) -> f64 {
    let after = front.partition_point(|r| r.work(seconds) <= work);
    let error = |r: &Record| (r.error + FLOOR).ln();
    match (after.checked_sub(1).map(|before| front[before]), front.get(after)) {
        (Some(before), Some(after)) => {
            let [start, end, at] =
                [before.work(seconds), after.work(seconds), work].map(|work| work.max(f64::MIN_POSITIVE).ln());
            let along = (at - start) / (end - start);
            (error(before) + along * (error(after) - error(before))).exp() - FLOOR
        }
        (Some(last), None) => last.error,
        (None, Some(first)) if first.work(seconds) <= slack * work => first.error,
        _ => f64::INFINITY,
    }
}

/// Whether the new error nowhere exceeds the old one by more than `factor` at equal work, for all points of the old
/// front. Also reports, as text, where it does.
pub fn compare(old: &Path, new: &Path, factor: f64, seconds: bool) -> Result<(String, bool), Failure> {
    let (old, new) = (read(old)?, read(new)?);
    let new_groups = groups(&new);
    let (mut text, mut good) = (String::new(), true);
    for (problem, scheme, before) in groups(&old) {
        let Some((_, _, after)) = new_groups.iter().find(|g| g.0 == problem && g.1 == scheme) else {
            text += &format!("{problem}, {scheme}: not measured again\n");
            continue;
        };
        let after = pareto(after, seconds);
        let mut worst = (0.0, 0.0, 0.0, f64::INFINITY);
        for r in pareto(&before, seconds) {
            let work = r.work(seconds);
            let error = error_at(&after, work, factor, seconds);
            let ratio = (error + FLOOR) / (r.error + FLOOR);
            if ratio > worst.0 {
                worst = (ratio, work, r.error, error);
            }
        }
        let (ratio, work, was, is) = worst;
        let fine = ratio <= factor;
        good &= fine;
        let unit = if seconds { "s" } else { "passes times particles" };
        let verdict = if fine { "" } else { "  WORSE" };
        text += &format!(
            "{problem}, {scheme}: at worst {ratio:.3} times the error: {was:.2e} -> {is:.2e} at {work:.3e} {unit}{verdict}\n"
        );
    }
    Ok((text, good))
}
