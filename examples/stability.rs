//! Runs small worlds over all settings and reports which stay stable: `cargo run --release --example stability --
//! --help`.

#[path = "stability/picture.rs"]
mod picture;
#[path = "stability/run.rs"]
mod run;
#[path = "stability/sweep.rs"]
mod sweep;

use clap::Parser;
use run::Outcome;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use sweep::Point;

/// Runs small worlds over all settings and reports which stay stable.
///
/// Each point is a world of a few hundred particles in which matter rests, hits a plate, or is pressed by one. It is
/// refused when it is made, or runs and gets a verdict: stable, collapsed (below half of the height that it should
/// have), growing (more energy than it had and was given), tunnelled (behind the plate, or gone), not finite, or stopped
/// by an error. The last four fail.
#[derive(Debug, Parser)]
#[command(name = "stability", max_term_width = 110)]
struct Args {
    /// Maps to run, for example stiffness,viscosity [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    maps: Vec<String>,

    /// Folder for stability.csv and a picture of each map
    #[arg(long, value_name = "DIR", default_value = "out/stability")]
    out: PathBuf,

    /// Draw such a file, and run nothing
    #[arg(long, value_name = "CSV")]
    draw: Option<PathBuf>,
}

fn main() -> ExitCode {
    match stability(&Args::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Whether nothing failed.
fn stability(args: &Args) -> Result<bool, Box<dyn Error>> {
    std::fs::create_dir_all(&args.out).map_err(|e| format!("{}: {e}", args.out.display()))?;
    let rows = match &args.draw {
        Some(path) => {
            // By the order of the columns: by their names the first of two structs would take all.
            let rows = |file: csv::Reader<_>| file.into_records().map(|row| row?.deserialize(None)).collect();
            let rows: csv::Result<Vec<(Point, Outcome)>> = csv::Reader::from_path(path).and_then(rows);
            let rows = rows.map_err(|e| format!("{}: {e}", path.display()))?;
            if rows.is_empty() {
                return Err(format!("{}: has no points", path.display()).into());
            }
            rows
        }
        None => {
            let mut points = sweep::points();
            if let Some(other) = args.maps.iter().find(|map| points.iter().all(|point| point.map != **map)) {
                return Err(format!("no map is named {other}; there are {}", sweep::MAPS.join(", ")).into());
            }
            points.retain(|point| args.maps.is_empty() || args.maps.contains(&point.map));
            let rows = run_all(points);
            let mut writer = csv::Writer::from_path(args.out.join("stability.csv"))?;
            rows.iter().try_for_each(|row| writer.serialize(row))?;
            writer.flush()?;
            rows
        }
    };
    picture::draw_all(&args.out, &rows)?;
    let mut counts = BTreeMap::<(&str, &str), usize>::new();
    rows.iter().for_each(|(point, outcome)| *counts.entry((&point.map, outcome.verdict.name())).or_default() += 1);
    counts.iter().for_each(|((map, verdict), count)| println!("{map:12} {verdict:12} {count:5}"));
    let failed = rows.iter().filter(|(_, outcome)| outcome.verdict.fails()).count();
    println!("{} points, {failed} failed", rows.len());
    Ok(failed == 0)
}

/// Runs every point once, on all cores; results are in the points' order.
fn run_all(points: Vec<Point>) -> Vec<(Point, Outcome)> {
    let next = AtomicUsize::new(0);
    let outcomes = Mutex::new(vec![None; points.len()]);
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let i = next.fetch_add(1, Ordering::Relaxed)
                    && let Some(point) = points.get(i)
                {
                    let outcome = run::run(point);
                    if i % 100 == 99 {
                        eprintln!("{} of {}", i + 1, points.len());
                    }
                    outcomes.lock().unwrap_or_else(|e| e.into_inner())[i] = Some(outcome);
                }
            });
        }
    });
    let outcomes = outcomes.into_inner().unwrap_or_else(|e| e.into_inner());
    points.into_iter().zip(outcomes).filter_map(|(point, outcome)| Some((point, outcome?))).collect()
}
