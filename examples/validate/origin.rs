//! The origin of a measurement.

use super::setup::Backend;
use std::process::Command;

/// Device and commit.
#[derive(Debug, Clone)]
pub struct Origin {
    pub device: String,
    /// The last commit that changed the engine, that is `src/` and `shaders/`; ends in `-dirty` if these have changes
    /// since.
    pub commit: String,
}

impl Origin {
    pub fn find(backend: Backend, adapter: &str) -> Origin {
        let device = match backend {
            Backend::Cpu | Backend::Cpu64 => {
                let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
                let threads = asked.or_else(|| std::thread::available_parallelism().map(usize::from).ok());
                format!("{}, threads: {}", std::env::consts::ARCH, threads.unwrap_or(1))
            }
            Backend::Gpu => pbmpm::choose_adapter(&pbmpm::AdapterChoice { name: adapter.to_owned() })
                .map_or_else(|_| "none".to_owned(), |adapter| adapter.get_info().name),
        };
        Origin { device, commit: engine().unwrap_or_else(|| "unknown".to_owned()) }
    }
}

fn engine() -> Option<String> {
    let commit = git(&["log", "-1", "--format=%h", "--abbrev=12"])?;
    let changed = !git(&["status", "--porcelain"])?.is_empty();
    Some(if changed { commit + "-dirty" } else { commit })
}

fn git(command: &[&str]) -> Option<String> {
    let folder = env!("CARGO_MANIFEST_DIR");
    let output = Command::new("git").args(command).args(["--", "src", "shaders"]).current_dir(folder).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
