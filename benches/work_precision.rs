//! Error against work: each problem over a sweep of steps, iterations and cell sizes, for each scheme.
//!
//! ```text
//! cargo bench --bench work_precision -- --quick            a sweep of a few minutes
//! cargo bench --bench work_precision                       the whole, about half an hour
//! cargo bench --bench work_precision -- --compare A.csv B.csv
//! cargo bench --bench work_precision -- --draw A.csv
//! ```
//!
//! The third command reports where the Pareto front of B lies above that of A, and fails where it does by more than
//! `--factor`.

#[path = "work_precision/front.rs"]
mod front;
#[path = "work_precision/record.rs"]
mod record;
#[path = "../examples/validate/suite.rs"]
#[allow(dead_code)] // what the example alone needs
mod suite;

use clap::Parser;
use record::Record;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use suite::cases::{Body, CASES};
use suite::console::{ended, say};
use suite::file;
use suite::setup::{Backend, Preset, Scheme, Setup};

/// Error against work.
#[derive(Debug, Parser)]
#[command(name = "work_precision", max_term_width = 110)]
struct Args {
    /// A short sweep
    #[arg(long)]
    quick: bool,

    /// Problems whose names contain one of these [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    problems: Vec<String>,

    /// Schemes [default: all]
    #[arg(long, value_enum, value_delimiter = ',')]
    scheme: Vec<Scheme>,

    /// What takes the steps
    #[arg(long, value_enum, default_value_t = Backend::Cpu)]
    backend: Backend,

    /// Part of the name, driver or backend of the graphics adapter
    #[arg(long, value_name = "NAME", default_value = "")]
    adapter: String,

    /// Folder for work_precision.csv and the charts
    #[arg(long, value_name = "DIR", default_value = "out/work_precision")]
    out: PathBuf,

    /// Compare two files instead of measuring: where is the second's front worse?
    #[arg(long, num_args = 2, value_names = ["OLD", "NEW"])]
    compare: Option<Vec<PathBuf>>,

    /// Draw and print the fronts of a file instead of measuring
    #[arg(long, value_name = "CSV")]
    draw: Option<PathBuf>,

    /// Errors at the same work may grow by this factor
    #[arg(long, value_name = "X", default_value_t = 1.25)]
    factor: f64,

    /// Compare by time, which is noisy, instead of by passes
    #[arg(long)]
    seconds: bool,

    /// Given by cargo
    #[arg(long, hide = true)]
    bench: bool,
}

/// A problem: the case that computes it, and the number whose error counts.
struct Problem {
    name: &'static str,
    case: &'static str,
    metric: &'static str,
}

const fn problem(name: &'static str, case: &'static str, metric: &'static str) -> Problem {
    Problem { name, case, metric }
}

const PROBLEMS: &[Problem] = &[
    problem("column", "a3-32", "height loss"),
    problem("dam break", "a4-dam", "front against the converged, in a"),
    problem("sloshing frequency", "a6-deep", "frequency"),
    problem("sloshing damping", "a6-deep", "damping ratio"),
    problem("vortices", "a7-vortex", "numerical viscosity over U L"),
    problem("bar frequency", "a9-bar", "frequency"),
    problem("bar damping", "a9-bar", "damping ratio"),
    problem("beam sag", "a10-beam", "sag of the tip, m"),
    problem("beam frequency", "a10-beam", "frequency, Hz"),
];

/// Cases with solids, for which the explicit scheme's steps depend on the solids.
const OF_SOLIDS: &[&str] = &["a9-bar", "a10-beam"];

/// Steps per second, iterations per step and tolerance. Settings that cost more than about 3,000 passes per second say
/// nothing about a real-time method.
const PUBLISHED: &[(f64, u32, f64)] = &[
    (60.0, 1, 0.0),
    (60.0, 4, 0.0),
    (60.0, 10, 0.0),
    (120.0, 1, 0.0),
    (120.0, 4, 0.0),
    (120.0, 10, 0.0),
    (240.0, 1, 0.0),
    (240.0, 4, 0.0),
    (480.0, 1, 0.0),
    (480.0, 4, 0.0),
    (1200.0, 1, 0.0),
    (2400.0, 1, 0.0),
];
const IMPLICIT: &[(f64, u32, f64)] = &[
    (60.0, 5, 0.03),
    (60.0, 10, 0.01),
    (60.0, 20, 0.01),
    (120.0, 2, 0.03),
    (120.0, 5, 0.01),
    (120.0, 10, 0.01),
    (240.0, 2, 0.01),
    (240.0, 5, 0.01),
    (240.0, 10, 0.01),
    (300.0, 4, 0.01),
    (300.0, 8, 0.001),
    (480.0, 2, 0.01),
    (480.0, 5, 0.01),
];
const EXPLICIT: &[(f64, u32, f64)] = &[
    (240.0, 1, 0.0),
    (300.0, 1, 0.0),
    (450.0, 1, 0.0),
    (600.0, 1, 0.0),
    (900.0, 1, 0.0),
    (1200.0, 1, 0.0),
    (2400.0, 1, 0.0),
];

/// The settings to try for a scheme in a case; on large cells only where a short sweep is enough.
fn sweep(case: &str, base: &Setup, quick: bool) -> Vec<Setup> {
    let setups: Vec<Setup> = if base.scheme == Scheme::Explicit && OF_SOLIDS.contains(&case) {
        // The longest allowed steps, and shares of them.
        let preset = |share| format!("{share} of the longest step");
        let of = |share| Setup { dt: f64::INFINITY, share, preset: preset(share), ..base.clone() };
        [1.0, 0.5, 0.25].map(of).to_vec()
    } else {
        let points = match base.scheme {
            Scheme::Published => PUBLISHED,
            Scheme::Implicit => IMPLICIT,
            Scheme::Explicit => EXPLICIT,
        };
        points.iter().map(|&(hertz, iterations, within)| base.stepped(hertz, iterations).to_within(within)).collect()
    };
    let refinements: &[f64] = if quick { &[0.5] } else { &[0.5, 1.0] };
    refinements.iter().flat_map(|&r| setups.iter().map(move |setup| setup.refined(r))).collect()
}

fn main() -> ExitCode {
    let args = Args::parse();
    ended(match (&args.compare, &args.draw) {
        (Some(files), _) => front::compare(&files[0], &files[1], args.factor, args.seconds)
            .and_then(|(text, good)| say(&text).map(|()| good)),
        (None, Some(file)) => file::read(file).and_then(|records| show(&records, &args.out)).map(|()| true),
        (None, None) => measure(&args).map(|()| true),
    })
}

fn body_of(case: &str) -> Option<Body> {
    CASES.iter().find(|c| c.name == case).map(|c| c.body)
}

fn measure(args: &Args) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(&args.out)?;
    let named =
        |p: &&Problem| args.problems.is_empty() || args.problems.iter().any(|name| p.name.contains(name.as_str()));
    let problems: Vec<_> = PROBLEMS.iter().filter(named).collect();
    let mut cases: Vec<_> = problems.iter().map(|p| p.case).collect();
    cases.dedup();
    let schemes = if args.scheme.is_empty() { Scheme::ALL } else { &args.scheme[..] };
    let origin = suite::origin::Origin::find(args.backend, &args.adapter);
    let mut records = Vec::new();
    for case in cases {
        let body = body_of(case).ok_or_else(|| format!("no case {case}"))?;
        for &scheme in schemes {
            let base = Setup { adapter: args.adapter.clone(), ..Setup::new(scheme, Preset::Realtime, args.backend) };
            for setup in sweep(case, &base, args.quick) {
                let mut line = format!(
                    "{case} {} {} to {} cells x {}:",
                    scheme.name(),
                    setup.preset,
                    setup.tolerance,
                    setup.refine
                );
                let outcome = match body(&setup) {
                    Ok(outcome) => outcome,
                    Err(error) => {
                        eprintln!("{line} not run: {error}");
                        break;
                    }
                };
                for problem in problems.iter().filter(|p| p.case == case) {
                    let error = outcome.error(problem.metric);
                    line += &format!(" {} {error:.2e}", problem.metric);
                    records.push(Record::new(problem.name, &setup, error, &outcome.cost, &origin));
                }
                eprintln!("{line}; {:.0} passes, {:.2} s", outcome.cost.passes, outcome.cost.seconds);
                file::write(&args.out.join("work_precision.csv"), &records)?;
            }
        }
    }
    show(&records, &args.out)
}

/// Writes charts as files and prints the fronts as a table.
fn show(records: &[Record], out: &Path) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(out)?;
    front::draw(records, out)?;
    say(&front::table(records))?;
    say(&front::at_equal_time(records))
}
