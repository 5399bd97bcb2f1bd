//! The measurements; each device has a CSV file of them.

use serde::{Deserialize, Serialize};

/// A point of a sweep, a stage, or one side of a skipping line.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Row {
    pub sweep: String,
    /// The varied value, or the name of a stage or line.
    pub point: String,
    /// For a skipping line: `plain` or `other`.
    pub side: String,
    pub particles: usize,
    /// Per step.
    pub iterations: f64,
    pub cell_size: f64,
    pub hertz: f64,
    /// Mean over the windows.
    pub active_blocks: f64,
    /// Number of steps measured.
    pub steps: usize,
    pub min_ms: f64,
    pub median_ms: f64,
    pub mean_ms: f64,
    pub max_ms: f64,
    /// Per step, if a device gets several in one submission.
    pub batch_ms: Option<f64>,
    /// Time of all threads of a processor, median, if a processor does the work.
    pub processor_ms: Option<f64>,
    /// For a skipping line's other side: median over pairs of its time over the plain side's.
    pub ratio: Option<f64>,
    /// The same in processor time.
    pub processor_ratio: Option<f64>,
    pub particle_bytes: u64,
    pub grid_bytes: u64,
    pub bin_bytes: u64,
    pub other_bytes: u64,
    pub faults: u64,
    pub state: String,
    pub backend: String,
    pub device: String,
    pub driver: String,
    pub threads: usize,
    pub commit: String,
}

impl Row {
    /// All that the solver owns, MiB.
    pub fn mebibytes(&self) -> f64 {
        (self.particle_bytes + self.grid_bytes + self.bin_bytes + self.other_bytes) as f64 / f64::from(1 << 20)
    }

    /// Whether rounding is exactly as specified, as on the CPU path.
    pub fn is_software(&self) -> bool {
        let driver = self.driver.to_lowercase();
        self.backend == "cpu" || driver.contains("llvmpipe") || driver.contains("swiftshader")
    }

    /// Time per particle and iteration, ns.
    pub fn per_particle(&self) -> f64 {
        self.least() * 1e6 / (self.particles as f64 * self.iterations)
    }

    /// The value that is compared: medians, which other programs on the machine change least; for a device, those of
    /// steps in one submission.
    pub fn best(&self) -> f64 {
        self.batch_ms.unwrap_or(self.median_ms)
    }

    /// The same, or that of steps one by one where a submission of few steps took longer, for instance because
    /// something else was freed meanwhile.
    pub fn least(&self) -> f64 {
        self.best().min(self.median_ms)
    }
}
