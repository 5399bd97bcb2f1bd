//! The command line.

use crate::render::ColorBy;
use std::path::PathBuf;

/// The most pictures of one run.
const MAX_FRAMES: i64 = 100_000;

/// Steps a scene without a window: pictures, particle files, a report, and a table at the end.
#[derive(Debug, clap::Parser)]
#[command(name = "headless", version, max_term_width = 110, after_help = EXAMPLES)]
pub struct Args {
    /// Scene file [default: scenes/thesis_basin.json of this crate]
    pub scene: Option<PathBuf>,

    /// Backend that takes the steps
    #[arg(long, value_enum, default_value_t = Backend::Auto, hide_possible_values = true, long_help = BACKENDS)]
    pub backend: Backend,

    /// Part of the name, driver or backend of the graphics adapter to use, for example nvidia, llvmpipe or gl
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,

    /// Steps of the scene's length to take, in as many as their time needs where it has a `courant` [default: 240]
    #[arg(long, value_name = "N", conflicts_with = "seconds", allow_negative_numbers = true)]
    pub steps: Option<u32>,

    /// Simulated time instead of a number of steps; rounded to whole steps
    #[arg(long, value_name = "T", value_parser = seconds, allow_negative_numbers = true)]
    pub seconds: Option<f64>,

    /// Change one place of the scene, for example --set settings.iterations=4 or --set
    /// 'spawns[0].fill={"per_cell":27}'; may be repeated
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub overrides: Vec<String>,

    /// Pictures, evenly spaced over the run; the last shows its end
    #[arg(
        long,
        value_name = "N",
        default_value_t = 8,
        value_parser = clap::value_parser!(u32).range(..=MAX_FRAMES),
        allow_negative_numbers = true
    )]
    pub frames: u32,

    /// Size of the pictures in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: (u32, u32),

    /// What the colour of the particles in the pictures shows
    #[arg(long, value_enum, default_value_t = ColorBy::Material)]
    pub color: ColorBy,

    /// Folder for everything that is written
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,

    /// Write the particles to files at every sample
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub dump: Option<Dump>,

    /// Steps from one sample of the state to the next [default: about 60 samples]. Where step lengths follow speeds
    /// (settings.courant), samples also divide the frames that are planned at once
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    pub every: Option<u32>,

    /// Where the report goes [default: DIR/report.json]
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,

    /// Resume a snapshot that --save wrote for the same scene
    #[arg(long, value_name = "FILE")]
    pub restore: Option<PathBuf>,

    /// Write the state at the end to a file, to resume with --restore
    #[arg(long, value_name = "FILE")]
    pub save: Option<PathBuf>,

    /// Print errors only
    #[arg(long, short)]
    pub quiet: bool,
}

const BACKENDS: &str = "What takes the steps:
- auto:  the best graphics adapter, or the CPU path where there is none
- gpu:   a graphics adapter, which may be a software one
- cpu:   the CPU path, with the same results as the GPU path but for rounding
- cpu64: the CPU path in double precision, as a reference";

const EXAMPLES: &str = "Examples:
  headless
  headless scenes/dam_break.json --seconds 0.5 --color speed
  headless scenes/drop.json --backend cpu --frames 0 --dump ply --every 10
  headless scenes/resting_column.json --set settings.iterations=30 --report column.json
  headless --steps 100 --save half.snapshot && headless --steps 100 --restore half.snapshot";

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Backend {
    Auto,
    Gpu,
    Cpu,
    Cpu64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Dump {
    /// Binary PLY, for Blender, ParaView and others
    Ply,
}

impl Args {
    /// Steps to take with steps of `dt` seconds.
    pub fn total_steps(&self, dt: f64) -> Result<u32, String> {
        let Some(seconds) = self.seconds else {
            return Ok(self.steps.unwrap_or(240));
        };
        let steps = (seconds / dt).round();
        if steps > f64::from(u32::MAX) {
            return Err(format!(
                "--seconds {seconds:e} is {steps:e} steps of {dt} s: at most {} can be taken",
                u32::MAX
            ));
        }
        Ok(steps as u32)
    }

    pub fn report_path(&self) -> PathBuf {
        self.report.clone().unwrap_or_else(|| self.out.join("report.json"))
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err("a number of seconds, 0 or more".to_owned()),
    }
}

fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |s: &str| s.parse::<u32>().ok().filter(|n| *n > 0);
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some((side(w)?, side(h)?)));
    sides.ok_or_else(|| "width and height in pixels, each at least 1, as in 1280x720".to_owned())
}
