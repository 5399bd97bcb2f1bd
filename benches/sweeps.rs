//! The thesis' sweeps of runtime and memory, scaling, times of stages, and the benefit of skipping.
//!
//! ```text
//! cargo bench --bench sweeps -- --quick --backend cpu,llvmpipe    fewer points, shorter windows
//! cargo bench --bench sweeps -- --backend cpu
//! cargo bench --bench sweeps -- --only skipping,memory
//! cargo bench --bench sweeps -- --draw out/sweeps/sweeps-cpu.csv,out/sweeps/sweeps-llvmpipe.csv
//! ```
//!
//! Measured as in the thesis: each step is timed by itself and waited for, in five windows of 200 steps, of which the
//! first ends after 10 s and not before 250 steps. Results are written to `sweeps-<device>.csv` and replace those of
//! the same sweeps there. Fails where states differ that must not.

#[path = "sweeps/picture.rs"]
mod picture;
#[path = "sweeps/report.rs"]
#[allow(dead_code)] // what the tests alone need
mod report;
#[path = "sweeps/run.rs"]
mod run;
#[path = "sweeps/skipping.rs"]
mod skipping;
#[path = "../examples/validate/suite.rs"]
#[allow(dead_code)] // what the example alone needs
mod suite;
#[path = "sweeps/worlds.rs"]
mod worlds;

use clap::{Parser, ValueEnum};
use pbmpm::{Material, World};
use report::record::Row;
use report::table::{self, Device};
use report::thesis;
use run::{Place, Times};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use suite::console::{ended, say};
use suite::file::{self, Failure};

/// The thesis' sweeps, scaling, stages, memory, and the benefit of skipping.
#[derive(Debug, Parser)]
#[command(name = "sweeps", max_term_width = 110)]
struct Args {
    /// Fewer points and shorter windows
    #[arg(long)]
    quick: bool,

    /// Steps of a window [default: 200, quick 20]
    #[arg(long, value_name = "STEPS")]
    window: Option<u32>,

    /// Also four and ten million particles, and frames of a million
    #[arg(long)]
    full: bool,

    /// What to measure [default: all]
    #[arg(long, value_enum, value_delimiter = ',')]
    only: Vec<Sweep>,

    /// `cpu`, or part of the name, driver or backend of a graphics adapter; several with commas
    #[arg(long, value_delimiter = ',', default_value = "cpu", value_name = "NAMES")]
    backend: Vec<String>,

    /// Folder for the records and pictures
    #[arg(long, value_name = "DIR", default_value = "out/sweeps")]
    out: PathBuf,

    /// Print and draw records instead of measuring
    #[arg(long, value_delimiter = ',', value_name = "CSV")]
    draw: Vec<PathBuf>,

    /// Given by cargo
    #[arg(long, hide = true)]
    bench: bool,
}

impl Args {
    fn window(&self) -> u32 {
        self.window.unwrap_or(if self.quick { 20 } else { 200 }).max(2)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Sweep {
    Particles,
    Iterations,
    Cells,
    Frequency,
    Memory,
    Scaling,
    Solids,
    Frames,
    Stages,
    Skipping,
}

impl Sweep {
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// A world that is timed in windows of a number of steps, after a number of steps.
struct Point {
    label: String,
    world: World,
    start: u32,
    window: u32,
}

/// Step at which the thesis' first window begins: it ends after 10 s, and not before 250 steps.
fn first_window(hertz: f64) -> u32 {
    (10.0 * hertz).max(250.0) as u32 - 200
}

fn points(sweep: Sweep, args: &Args) -> Vec<Point> {
    let quick = args.quick;
    let basin = |label: String, per_axis, iterations, cell_size, hertz| Point {
        label,
        world: worlds::basin(per_axis, iterations, cell_size, hertz),
        start: first_window(hertz),
        window: args.window(),
    };
    let all = |range: std::ops::RangeInclusive<u32>, some: &[u32]| if quick { some.to_vec() } else { range.collect() };
    match sweep {
        Sweep::Particles => {
            let counts = all(10..=50, &[10, 20, 25, 30, 40, 50]).into_iter();
            counts.map(|n| basin(n.to_string(), n, 1, 1.0, 30.0)).collect()
        }
        Sweep::Iterations => {
            let counts = all(1..=10, &[1, 2, 3, 5, 6, 10]).into_iter();
            counts.map(|n| basin(n.to_string(), 25, n, 1.0, 30.0)).collect()
        }
        Sweep::Cells => {
            let tenths = all(3..=30, &[3, 5, 10, 11, 15, 21, 30]).into_iter().map(|n| f64::from(n) / 10.0);
            tenths.map(|size| basin(size.to_string(), 25, 1, size, 30.0)).collect()
        }
        Sweep::Frequency => {
            let tens = all(1..=25, &[1, 3, 13, 14, 20, 25]).into_iter().map(|n| f64::from(n) * 10.0);
            tens.map(|hertz| basin(hertz.to_string(), 25, 1, 1.0, hertz)).collect()
        }
        Sweep::Memory => thesis::MEMORY.iter().map(|m| basin(m.point(), m.per_axis, 1, m.cell_size, 30.0)).collect(),
        Sweep::Scaling | Sweep::Solids => {
            let material =
                || if sweep == Sweep::Solids { Material::elastic("jelly") } else { Material::liquid("water") };
            let powers: &[f64] = if quick { &[3.0, 4.0, 5.0, 6.0] } else { &[3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0] };
            let more: &[f64] = if args.full { &[6.6, 7.0] } else { &[] };
            let point = |power: &f64| {
                let particles = 10f64.powf(*power);
                let window = (if quick { 2e5 } else { 2e6 } / particles).clamp(2.0, f64::from(args.window())) as u32;
                Point {
                    label: format!("10^{power}"),
                    world: worlds::plain_box(particles, material()),
                    start: 20,
                    window,
                }
            };
            powers.iter().chain(more).map(point).collect()
        }
        Sweep::Frames | Sweep::Stages | Sweep::Skipping => Vec::new(),
    }
}

fn main() -> ExitCode {
    let args = Args::parse();
    ended(if args.draw.is_empty() { measure(&args) } else { show(&args.draw, &args.out).map(|()| true) })
}

fn measure(args: &Args) -> Result<bool, Failure> {
    std::fs::create_dir_all(&args.out)?;
    let places = args.backend.iter().map(|name| Place::find(name)).collect::<Result<Vec<_>, _>>()?;
    let file = |place: &Place| args.out.join(format!("sweeps-{}.csv", place.name));
    let chosen = if args.only.is_empty() { Sweep::value_variants() } else { &args.only[..] };
    for &sweep in chosen {
        let mut measured = vec![Vec::new(); places.len()];
        for point in points(sweep, args) {
            let state = run::state_after(&point.world, point.start)?;
            for (place, rows) in places.iter().zip(&mut measured) {
                match timed(place, &sweep.name(), &point, &state, args.window()) {
                    Ok(row) => {
                        tell(&row)?;
                        rows.push(row);
                    }
                    Err(error) => {
                        eprintln!("{} {} on {}: not measured: {error}", sweep.name(), point.label, place.name)
                    }
                }
            }
        }
        for (place, rows) in places.iter().zip(&mut measured) {
            match sweep {
                Sweep::Frames => rows.extend(frames(place, args.full)?),
                Sweep::Stages => rows.extend(stages(place, if args.quick { 40 } else { 400 }, args.full)),
                Sweep::Skipping => {
                    let budget = Duration::from_secs(if args.quick { 20 } else { 90 });
                    rows.extend(skipping::measure(place, budget, &mut |pair| pair.iter().try_for_each(tell))?);
                }
                _ => (),
            }
            merge(&file(place), &sweep.name(), rows)?;
        }
    }
    let files: Vec<PathBuf> = places.iter().map(file).collect();
    show(&files, &args.out)?;
    let mut agree = true;
    for file in &files {
        let rows: Vec<Row> = file::read(file)?;
        agree &= !rows.windows(2).any(|row| {
            let [plain, other] = row else { return false };
            plain.side == "plain" && other.side == "other" && plain.differs(other)
        });
    }
    Ok(agree)
}

fn timed(place: &Place, sweep: &str, point: &Point, state: &pbmpm::Snapshot, longest: u32) -> Result<Row, Failure> {
    let mut solver = place.resumed(&point.world, state, false)?;
    // Hardware takes more steps in the same time.
    let window = if place.on_processor { point.window } else { (50 * point.window).min(longest) };
    let (times, blocks) = run::windows(&mut *solver, window)?;
    let mut row = place.row(sweep, &point.label, &point.world, &mut *solver)?;
    row.active_blocks = blocks;
    times.fill(&mut row, place.on_processor);
    if !place.is_cpu() {
        let mut batches = Times::default();
        batches.add(window, || solver.steps(window))?;
        row.batch_ms = Some(batches.wall[0]);
    }
    Ok(row)
}

/// Prints a line of results.
fn tell(row: &Row) -> Result<(), Failure> {
    let Row { sweep, point, side, backend, particles, min_ms, median_ms, mean_ms, max_ms, state, .. } = row;
    let published = thesis::ms(sweep, point).map_or_else(String::new, |ms| format!("; thesis {ms}"));
    let ratio = row.ratio.map_or_else(String::new, |r| format!("; {r:.3} of plain"));
    say(&format!(
        "{sweep} {point} {side}, {backend}: {particles} particles, {:.2} iterations, {:.0} blocks: min {min_ms:.3}, median {median_ms:.3}, \
         mean {mean_ms:.3}, max {max_ms:.3} ms{published}{ratio}; {:.2} MiB; state {state}\n",
        row.iterations,
        row.active_blocks,
        row.mebibytes()
    ))
}

/// Frames of a sixtieth of a second, from the first on, with the settings of `realtime`.
fn frames(place: &Place, full: bool) -> Result<Vec<Row>, Failure> {
    const FRAMES: u32 = 60;
    let mut rows = Vec::new();
    for power in [5.0, 6.0].into_iter().take(if full { 2 } else { 1 }) {
        let world = worlds::realtime(10f64.powf(power));
        let mut solver = place.warmed(&world)?;
        let mut times = Times::default();
        let mut iterations = 0;
        for _ in 0..FRAMES {
            times.add(1, || solver.advance(1.0 / 60.0).map(|frame| iterations += frame.iterations))?;
        }
        let mut row = place.row("frames", &format!("10^{power}"), &world, &mut *solver)?;
        row.iterations = iterations as f64 / f64::from(FRAMES);
        times.fill(&mut row, place.on_processor);
        tell(&row)?;
        rows.push(row);
    }
    Ok(rows)
}

/// Times of the stages at the baseline and in the plain box, if the device can measure them.
fn stages(place: &Place, steps: u32, full: bool) -> Vec<Row> {
    let measure = |side: &str, world: World, start: u32| -> Result<Vec<Row>, Failure> {
        let state = run::state_after(&world, start)?;
        let mut solver = place.resumed(&world, &state, true)?;
        solver.steps(steps)?;
        let row = Row { side: side.to_owned(), ..place.row("stages", "", &world, &mut *solver)? };
        let of = |time: pbmpm::StageTime| {
            let mean_ms = time.seconds * 1e3;
            Row { point: time.stage.to_owned(), mean_ms, steps: steps as usize, ..row.clone() }
        };
        Ok(solver.stage_times().into_iter().map(of).collect())
    };
    let mut all = vec![(String::new(), worlds::baseline(), first_window(30.0))];
    let powers: &[f64] = if full { &[5.0, 6.0] } else { &[5.0] };
    for power in powers {
        let particles = 10f64.powf(*power);
        all.push((format!("box of 10^{power}"), worlds::plain_box(particles, Material::liquid("water")), 20));
        all.push((format!("realtime, 10^{power}"), worlds::realtime(particles), 20));
    }
    let rows = all.into_iter().map(|(side, world, start)| {
        measure(&side, world, start).unwrap_or_else(|error| {
            eprintln!("stages {side} on {}: not measured: {error}", place.name);
            Vec::new()
        })
    });
    rows.flatten().collect()
}

/// Replaces the rows of a sweep in the file.
fn merge(file: &Path, sweep: &str, rows: &[Row]) -> Result<(), Failure> {
    let mut all = if file.exists() { file::read::<Row>(file)? } else { Vec::new() };
    all.retain(|row| row.sweep != sweep);
    all.extend_from_slice(rows);
    file::write(file, &all)
}

/// Tables and pictures of records.
fn show(files: &[PathBuf], out: &Path) -> Result<(), Failure> {
    let records = files.iter().map(|file| file::read(file)).collect::<Result<Vec<_>, _>>()?;
    let devices: Vec<Device> = records.into_iter().filter_map(Device::of).collect();
    for text in table::all(&devices) {
        say(&format!("\n{text}"))?;
    }
    std::fs::create_dir_all(out)?;
    picture::draw(&devices, out)
}
