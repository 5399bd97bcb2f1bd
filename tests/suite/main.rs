//! The test suite. One body runs on every backend: the CPU path in both number types and each kind of adapter.
//!
//! ```text
//! cargo test --release --test suite                         everything
//! cargo test --release --test suite lavapipe                one backend
//! cargo test --release --test suite physics::cpu::free_fall one test
//! ```
//!
//! A backend that this machine lacks is reported as *ignored*, with what to install.
//! `PBMPM_REQUIRE_ADAPTERS=lavapipe,swiftshader` makes the named ones fail instead, so that CI cannot lose its GPU
//! tests unnoticed. `PBMPM_SLOW_TESTS=1` also runs tests that take a minute each, `PBMPM_TEST_TIMES=1` prints the
//! slowest, `PBMPM_PROPTEST_SEED=n` draws other random worlds.

mod alike;
mod backends;
mod bad_input;
mod bad_worlds;
mod benchmarks;
mod between_nodes;
mod blocks;
mod clamps;
mod decomposition;
mod determinism;
mod device_faults;
mod emission;
mod explicit;
mod faults;
#[path = "../../examples/floating_box.rs"]
#[allow(dead_code)] // its main
mod floating_box;
mod flush;
mod golden;
mod guest;
mod guest_growth;
mod kernels;
mod layouts_match;
mod lewin;
mod loads;
#[path = "../../src/math/matrices.rs"]
mod matrices;
mod mesh_files;
mod mesh_seams;
mod meshes;
mod periodic;
mod physics;
mod physics_contact;
mod physics_solids;
mod quality;
mod random;
mod resting;
mod robustness;
mod robustness_sizes;
mod scene_files;
mod scene_parity;
mod sensors;
mod shaders_valid;
mod shapes;
mod sharpening;
mod sleep;
mod snapshots;
mod snapshots_crafted;
mod stage_parity;
mod stepping;
mod stress;
mod stress_scenes;
#[path = "../../examples/validate/suite.rs"]
#[allow(dead_code)] // what the example and the benches alone need
mod suite;
#[path = "../../benches/sweeps/report.rs"]
#[allow(dead_code)] // what the bench alone needs
mod sweeps;
mod tools;
mod validation;
mod viscous;
mod worlds;

fn main() -> std::process::ExitCode {
    let arguments = libtest_mimic::Arguments::from_args();
    let mut tests = backends::Tests::default();
    shaders_valid::add(&mut tests);
    layouts_match::add(&mut tests);
    decomposition::add(&mut tests);
    shapes::add(&mut tests);
    blocks::add(&mut tests);
    sharpening::add(&mut tests);
    mesh_seams::add(&mut tests);
    meshes::add(&mut tests);
    mesh_files::add(&mut tests);
    scene_files::add(&mut tests);
    lewin::add(&mut tests);
    stage_parity::add(&mut tests);
    scene_parity::add(&mut tests);
    determinism::add(&mut tests);
    emission::add(&mut tests);
    sensors::add(&mut tests);
    periodic::add(&mut tests);
    physics::add(&mut tests);
    physics_contact::add(&mut tests);
    physics_solids::add(&mut tests);
    between_nodes::add(&mut tests);
    clamps::add(&mut tests);
    resting::add(&mut tests);
    explicit::add(&mut tests);
    loads::add(&mut tests);
    stepping::add(&mut tests);
    stress::add(&mut tests);
    quality::add(&mut tests);
    tools::add(&mut tests);
    viscous::add(&mut tests);
    sleep::add(&mut tests);
    robustness::add(&mut tests);
    robustness_sizes::add(&mut tests);
    bad_input::add(&mut tests);
    bad_worlds::add(&mut tests);
    faults::add(&mut tests);
    guest::add(&mut tests);
    guest_growth::add(&mut tests);
    snapshots::add(&mut tests);
    snapshots_crafted::add(&mut tests);
    device_faults::add(&mut tests);
    flush::add(&mut tests);
    golden::add(&mut tests);
    validation::add(&mut tests);
    benchmarks::add(&mut tests);
    let conclusion = libtest_mimic::run(&arguments, tests.trials);
    backends::print_times();
    // The test threads may still be ending, and with them the data that drivers keep for each; exiting during that has
    // corrupted the heap.
    std::thread::sleep(std::time::Duration::from_millis(500));
    conclusion.exit_code()
}
