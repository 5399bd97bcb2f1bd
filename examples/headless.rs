//! Steps a scene without a window: `cargo run --release --example headless -- --help`.

#[path = "headless/args.rs"]
mod args;
#[path = "headless/camera.rs"]
mod camera;
#[path = "headless/engine.rs"]
mod engine;
#[path = "headless/meshes.rs"]
mod meshes;
#[path = "headless/output.rs"]
mod output;
#[path = "headless/pipelines.rs"]
mod pipelines;
#[path = "headless/render.rs"]
mod render;
#[path = "headless/report.rs"]
mod report;
#[path = "headless/run.rs"]
mod run;

use args::Args;
use clap::Parser;
use engine::Engine;
use output::{Artist, NoArtist, at};
use pbmpm::scene::lewin;
use pbmpm::{Error, Snapshot, World, scene};
use report::Report;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

const DEFAULT_SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/thesis_basin.json");

fn main() -> ExitCode {
    match simulate(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            say(&format!("error: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn simulate(args: &Args) -> Result<(), Failure> {
    let start = Instant::now();
    let path = args.scene.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_SCENE));
    let world = read_world(&path, &args.overrides)?;
    let total = args.total_steps(world.settings.dt)?;
    let report_path = args.report_path();
    keep_apart("--report", &report_path, &[Some(&path), args.restore.as_ref(), args.save.as_ref()])?;
    // A snapshot is read before it is written.
    args.save.iter().try_for_each(|save| keep_apart("--save", save, &[Some(&path)]))?;
    make_room(&args.out, &report_path, args.save.as_deref())?;

    let note = |text: String| {
        if !args.quiet {
            say(&text);
        }
    };
    let viscous = world.viscous_dt(world.settings.scheme);
    if world.settings.dt > viscous {
        note(format!(
            "viscosity is taken for less than stated: steps of {viscous:.2e} s bear it, the scene's are {:.2e} s",
            world.settings.dt
        ));
    }
    let (mut engine, taken) = Engine::open(args, &world)?;
    note(format!("backend: {taken}"));
    if let Some(file) = &args.restore {
        let snapshot = Snapshot::read(file, &world)?;
        engine.solver_mut().restore(&snapshot).map_err(|error| match error {
            // The solver knows it only from memory.
            Error::Snapshot { fault, .. } => Error::Snapshot { path: file.display().to_string(), fault },
            other => other,
        })?;
        note(format!("restored: step {}, {:.3} s", snapshot.step(), snapshot.time()));
    }
    let artist = if args.frames > 0 { open_artist(&engine, &world, args, note)? } else { None };
    let record = run::run(&mut engine, artist.as_ref(), &world, args, total)?;
    let report = Report::new(&mut engine, &world, &path, args, record, start.elapsed())?;
    std::fs::write(&report_path, report.to_json()?).map_err(|e| at(&report_path, &e))?;
    if let Some(file) = &args.save {
        engine.solver_mut().save()?.write(file)?;
    }
    if !args.quiet {
        match std::io::stdout().write_all(report.table(&report_path).as_bytes()) {
            // The reader has closed the pipe.
            Err(e) if e.kind() == ErrorKind::BrokenPipe => {}
            other => other?,
        }
    }
    Ok(())
}

/// Reads the scene file and applies `--set`.
fn read_world(path: &Path, overrides: &[String]) -> Result<World, Failure> {
    let folder = scene::folder_of(path);
    let read = || {
        let text = scene::read_text(path)?;
        let document = serde_json::from_str(&text);
        if document.as_ref().is_ok_and(lewin::is_lewin) {
            let imported = lewin::from_json(&text, &lewin::Slab::default())?;
            imported.notes.iter().for_each(|note| say(note));
            let mut document = serde_json::from_str(&scene::to_json(&imported.world)).unwrap_or_default();
            overrides.iter().try_for_each(|assignment| scene::apply_override(&mut document, assignment))?;
            return scene::from_value(document);
        }
        let (Ok(mut document), false) = (document, overrides.is_empty()) else {
            // This error has line and column.
            return scene::from_json_in(&text, folder);
        };
        overrides.iter().try_for_each(|assignment| scene::apply_override(&mut document, assignment))?;
        scene::from_value_in(document, folder)
    };
    let world = read().and_then(|world| world.capacity().map(|_| world));
    world.map_err(|error| match error {
        Error::Io { .. } => error.into(),
        _ => format!("{}: {error}", path.display()).into(),
    })
}

/// Fails if a file that is to be written is one of these.
fn keep_apart(option: &str, file: &Path, others: &[Option<&PathBuf>]) -> Result<(), Failure> {
    let same = |other: &&PathBuf| match (file.canonicalize(), other.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => file == other.as_path(),
    };
    match others.iter().flatten().find(|other| same(other)) {
        Some(other) => Err(format!("{option} {}: would overwrite {}", file.display(), other.display()).into()),
        None => Ok(()),
    }
}

/// Checks before a long run whether its results can be written. Removes the report of an earlier run, so that it cannot
/// be taken for that of a run that fails.
fn make_room(out: &Path, report: &Path, snapshot: Option<&Path>) -> Result<(), Failure> {
    let folder = |file: &Path| file.parent().filter(|p| !p.as_os_str().is_empty()).map(Path::to_path_buf);
    let folders = [Some(out.to_path_buf()), folder(report), snapshot.and_then(folder)];
    for folder in folders.iter().flatten() {
        std::fs::create_dir_all(folder).map_err(|e| at(folder, &e))?;
    }
    for file in [Some(report), snapshot].into_iter().flatten() {
        let there = file.exists();
        std::fs::OpenOptions::new().append(true).create(true).open(file).map_err(|e| at(file, &e))?;
        if file.symlink_metadata().is_ok_and(|m| m.is_file()) && (file == report || !there) {
            std::fs::remove_file(file).map_err(|e| at(file, &e))?;
        }
    }
    Ok(())
}

fn open_artist(engine: &Engine, world: &World, args: &Args, note: impl Fn(String)) -> Result<Option<Artist>, Failure> {
    match Artist::new(engine, world, args) {
        Ok(artist) => Ok(Some(artist)),
        Err(NoArtist::NoAdapter(why)) => {
            note(format!("no pictures: {why}"));
            Ok(None)
        }
        Err(NoArtist::Mistake(error)) => Err(error),
    }
}

/// Writes a line to standard error, if there is one.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
