//! Runs the validation cases and reports the results: `cargo run --release --example validate -- --help`.

#[path = "validate/suite.rs"]
#[allow(dead_code)] // what the bench alone needs
mod suite;

use clap::Parser;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use suite::cases::{CASES, Case};
use suite::chart;
use suite::console::{ended, say};
use suite::file;
use suite::origin::Origin;
use suite::setup::{Backend, Preset, Scheme, Setup};
use suite::table::{self, Row};

/// Runs the validation cases: a table, a CSV file and charts.
///
/// Each case yields numbers with a reference: an exact result (E), the same equations solved finer (C), or an
/// experiment (X). Each number has a gate that must hold and a target that is aimed at. One pass is one
/// particle-to-grid and one grid-to-particle sweep. The exit status tells whether a case ended with an error
/// other than that its scheme or device does not take it, not whether gates hold.
#[derive(Debug, Parser)]
#[command(name = "validate", max_term_width = 110)]
struct Args {
    /// Groups of cases, or beginnings of their names, for example a3,a6-deep [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    cases: Vec<String>,

    /// Only the quick cases
    #[arg(long)]
    quick: bool,

    /// List the cases and run nothing
    #[arg(long)]
    list: bool,

    /// How a step is solved; may name several
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Scheme::Published])]
    scheme: Vec<Scheme>,

    /// Steps and iterations; may name several
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Preset::Realtime])]
    preset: Vec<Preset>,

    /// Backends that take the steps; may name several
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Backend::Cpu])]
    backend: Vec<Backend>,

    /// Part of the name, driver or backend of the graphics adapter
    #[arg(long, value_name = "NAME", default_value = "")]
    adapter: String,

    /// Steps per second in place of the preset's
    #[arg(long, value_name = "N")]
    hertz: Option<f64>,

    /// Iterations per step in place of the preset's
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    iterations: Option<u32>,

    /// Tolerance in place of the preset's
    #[arg(long, value_name = "X")]
    tolerance: Option<f64>,

    /// Whether motion that transfers smooth away is restored, in place of the preset's choice
    #[arg(long, value_name = "true|false")]
    sharpen: Option<bool>,

    /// Whether the liquids of a block share a pressure, in place of the preset's choice
    #[arg(long, value_name = "true|false")]
    block_pressure: Option<bool>,

    /// Multiply the number of cells along every length by this factor
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    refine: f64,

    /// Random offset of the particles at the start, share of their spacing
    #[arg(long, value_name = "X", default_value_t = 0.2)]
    jitter: f64,

    /// Simulated time of the long cases, minutes, at least 2
    #[arg(long, value_name = "N", default_value_t = 10.0)]
    minutes: f64,

    /// Print one table of the results in such CSV files, and run nothing
    #[arg(long, num_args = 1.., value_name = "CSV")]
    compare: Vec<PathBuf>,

    /// Draw the points of such CSV files beside each other into charts.svg, and run nothing
    #[arg(long, num_args = 1.., value_name = "CSV")]
    draw: Vec<PathBuf>,

    /// Folder for validate.csv, validate.md and the charts
    #[arg(long, value_name = "DIR", default_value = "out/validate")]
    out: PathBuf,
}

impl Args {
    /// The cases that are asked for.
    fn wanted(&self) -> Result<Vec<Case>, String> {
        let names = |name: &String, case: &Case| {
            case.name.split('-').next() == Some(name) || (name.contains('-') && case.name.starts_with(name))
        };
        if let Some(none) = self.cases.iter().find(|name| !CASES.iter().any(|case| names(name, case))) {
            return Err(format!("no case is named {none}; --list has the names"));
        }
        let named = |case: &Case| self.cases.is_empty() || self.cases.iter().any(|name| names(name, case));
        Ok(CASES.iter().copied().filter(|case| named(case) && (case.quick || !self.quick)).collect())
    }

    fn setups(&self) -> Vec<Setup> {
        let mut setups = Vec::new();
        for &scheme in &self.scheme {
            for &preset in &self.preset {
                for &backend in &self.backend {
                    let mut setup = Setup::new(scheme, preset, backend);
                    setup.adapter = self.adapter.clone();
                    setup.refine = self.refine;
                    setup.jitter = self.jitter;
                    setup.minutes = self.minutes.max(2.0);
                    setup.sharpen = self.sharpen;
                    setup.block_pressure = self.block_pressure.unwrap_or(setup.block_pressure);
                    setup.tolerance = self.tolerance.unwrap_or(setup.tolerance);
                    if self.hertz.is_some() || self.iterations.is_some() {
                        let hertz = self.hertz.unwrap_or(1.0 / setup.dt);
                        setup = setup.stepped(hertz, self.iterations.unwrap_or(setup.iterations));
                    }
                    setups.push(setup);
                }
            }
        }
        setups
    }
}

fn main() -> ExitCode {
    ended(validate(&Args::parse()).map(|()| true))
}

fn validate(args: &Args) -> Result<(), Box<dyn std::error::Error>> {
    let cases = args.wanted()?;
    if args.list {
        cases
            .iter()
            .for_each(|case| println!("{:14}{}{}", case.name, if case.quick { "  " } else { "* " }, case.about));
        println!("\n* not among the quick cases");
        return Ok(());
    }
    if !args.compare.is_empty() {
        let files = args.compare.iter().map(|path| file::read::<Row>(path)).collect::<Result<Vec<_>, _>>()?;
        return say(&table::comparison(&files.concat()));
    }
    std::fs::create_dir_all(&args.out).map_err(|e| format!("{}: {e}", args.out.display()))?;
    if !args.draw.is_empty() {
        let charts = args.draw.iter().map(|path| chart::Chart::read(path)).collect::<Result<Vec<_>, _>>()?;
        return chart::sheet(&args.out.join("charts.svg"), &charts, 3);
    }
    if cases.is_empty() {
        return Err("none of these cases is among the quick ones".into());
    }
    let mut rows: Vec<Row> = Vec::new();
    let mut broken = 0;
    for setup in args.setups() {
        let origin = Origin::find(setup.backend, &setup.adapter);
        for case in &cases {
            eprint!("{} ({}, {}, {}) ", case.name, setup.scheme.name(), setup.preset, setup.backend.name());
            std::io::stderr().flush()?;
            let outcome = match (case.body)(&setup) {
                Ok(outcome) => outcome,
                Err(error) => {
                    eprintln!("not run: {error}");
                    // Some schemes do not take some matter, and some devices some worlds.
                    let refused = matches!(error, pbmpm::Error::Invalid { .. } | pbmpm::Error::Unsupported { .. });
                    broken += u32::from(!refused);
                    continue;
                }
            };
            eprintln!("{:.1} s", outcome.cost.seconds);
            let label = [setup.scheme.name(), &setup.preset, setup.backend.name()].join("-");
            let file = format!("{}-{label}", case.name);
            for mut chart in outcome.charts.iter().cloned() {
                chart.name = format!("{file}-{}", chart.name.replace([' ', ','], "_"));
                chart.write(&args.out)?;
            }
            if !outcome.charts.is_empty() {
                chart::sheet(&args.out.join(format!("{file}.svg")), &outcome.charts, 3)?;
            }
            rows.extend(outcome.metrics.iter().map(|m| Row::new(case.name, m, &outcome.cost, &setup, &origin)));
            // After each case, so that an interrupted run leaves its results so far.
            file::write(&args.out.join("validate.csv"), &rows)?;
            std::fs::write(args.out.join("validate.md"), table::markdown(&rows))?;
        }
    }
    if rows.is_empty() {
        return Err("no case could be run".into());
    }
    say(&table::markdown(&rows))?;
    if broken > 0 {
        return Err(format!("{broken} cases ended with an error").into());
    }
    Ok(())
}
