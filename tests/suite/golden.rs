//! The states that scenes reach, compared with recorded ones, so that no change of results goes unnoticed.
//! `PBMPM_WRITE_GOLDEN=1 cargo test --release --test suite -- golden` records an intended change, whose reason belongs
//! in the commit message.

use crate::backends::{Backend, CPUS, SOFTWARE, Tests};
use crate::worlds::after;
use pbmpm::math::wide::NARROW;
use pbmpm::{World, scene, state_hash};
use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::Ordering;

pub fn add(tests: &mut Tests) {
    tests.each("golden", CPUS, "states", states);
    tests.once("golden", "narrow_vectors_reach_the_same", narrow_vectors_reach_the_same);
    tests.each("golden", SOFTWARE, "devices_reach_the_same", devices_reach_the_same);
}

const STEPS: u32 = 20;
/// With at most this many slots a scene takes seconds on software devices.
const SMALL: usize = 20_000;

fn scenes() -> Vec<(String, World)> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes"));
    let files = std::fs::read_dir(folder).expect("the scenes").map(|entry| entry.expect("an entry").path());
    let mut files: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "json")).collect();
    files.sort();
    let name = |path: &Path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    files.iter().map(|path| (name(path), scene::from_file(path).unwrap_or_else(|e| panic!("{e}")))).collect()
}

/// Number of slots, and hash, of the state reached.
fn reached(backend: Backend, world: &World) -> (usize, u64) {
    let particles = after(&mut *backend.solver(world), STEPS);
    (particles.len(), state_hash(&particles))
}

fn states(backend: Backend) {
    let mut found = format!("scene,slots,hash after {STEPS} steps\n");
    for (name, world) in scenes() {
        let (slots, hash) = reached(backend, &world);
        writeln!(found, "{name},{slots},{hash:016x}").expect("strings grow");
    }
    let file = format!("{}/tests/golden/{}.csv", env!("CARGO_MANIFEST_DIR"), backend.name());
    if std::env::var_os("PBMPM_WRITE_GOLDEN").is_some() {
        std::fs::write(&file, &found).unwrap_or_else(|e| panic!("{file}: {e}"));
    }
    let expected = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{file}: {e}"));
    for (found, expected) in found.lines().zip(expected.lines()) {
        assert_eq!(found, expected, "see this test's file for how to write down a change that is wanted");
    }
    assert_eq!(found.lines().count(), expected.lines().count());
}

/// Narrow vectors give the results of wide ones, if this processor has any.
fn narrow_vectors_reach_the_same() {
    for (name, world) in scenes() {
        let all = || CPUS.iter().map(|cpu| reached(*cpu, &world)).collect::<Vec<_>>();
        let wide = all();
        NARROW.store(true, Ordering::Relaxed);
        let narrow = all();
        NARROW.store(false, Ordering::Relaxed);
        assert_eq!(narrow, wide, "{name}");
    }
}

/// The same as on the CPU path in single precision, to the last bit.
fn devices_reach_the_same(backend: Backend) {
    for (name, world) in scenes() {
        if world.capacity().expect("a valid world") > SMALL {
            continue;
        }
        assert_eq!(reached(backend, &world), reached(Backend::Cpu, &world), "{name}");
    }
}
