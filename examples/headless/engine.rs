//! The solver that takes the steps, on any backend.

use crate::Failure;
use crate::args::{Args, Backend};
use pbmpm::{AdapterChoice, CpuSolver, Error, GpuOptions, Headless, Settings, Simulate, World};

/// Time within which speeds are assumed to change little, s.
const FRAME: f64 = 1.0 / 60.0;

/// The most steps of a submission.
const AT_ONCE: u32 = 8;

pub enum Engine {
    Gpu(Box<Headless>),
    Cpu(Box<CpuSolver<f32>>),
    Cpu64(Box<CpuSolver<f64>>),
}

impl Engine {
    /// Opens the backend that `args` ask for. The second value says which one was taken, and why.
    pub fn open(args: &Args, world: &World) -> Result<(Self, String), Failure> {
        if let (Backend::Cpu | Backend::Cpu64, Some(name), 0) = (args.backend, &args.adapter, args.frames) {
            return Err(format!(
                "--adapter {name}: --backend cpu and cpu64 take one for pictures only, and --frames is 0"
            )
            .into());
        }
        let gpu = || Headless::new(world, &adapter_choice(args), &GpuOptions::default());
        let (engine, why) = match args.backend {
            Backend::Cpu => (Engine::Cpu(Box::new(CpuSolver::new(world)?)), String::new()),
            Backend::Cpu64 => (Engine::Cpu64(Box::new(CpuSolver::new(world)?)), String::new()),
            Backend::Gpu => (Engine::Gpu(Box::new(gpu()?)), String::new()),
            Backend::Auto => match gpu() {
                Ok(headless) => (Engine::Gpu(Box::new(headless)), String::new()),
                // A named adapter is not replaced by another.
                Err(e @ (Error::NoAdapter(_) | Error::Unsupported { .. } | Error::Device(_)))
                    if args.adapter.is_none() =>
                {
                    (Engine::Cpu(Box::new(CpuSolver::new(world)?)), format!(" ({e})"))
                }
                Err(e) => return Err(e.into()),
            },
        };
        let mut taken = format!("{}{why}", engine.describe());
        if let Engine::Gpu(headless) = &engine
            && headless.adapter().device_type == wgpu::DeviceType::Cpu
        {
            taken += "; this adapter is software, --backend cpu is likely to be faster";
        }
        Ok((engine, taken))
    }

    pub fn solver(&self) -> &dyn Simulate {
        match self {
            Engine::Gpu(s) => s.as_ref(),
            Engine::Cpu(s) => s.as_ref(),
            Engine::Cpu64(s) => s.as_ref(),
        }
    }

    pub fn solver_mut(&mut self) -> &mut dyn Simulate {
        match self {
            Engine::Gpu(s) => s.as_mut(),
            Engine::Cpu(s) => s.as_mut(),
            Engine::Cpu64(s) => s.as_mut(),
        }
    }

    /// Number of steps to take at once: several in one submission keep a GPU busy. Where step lengths follow speeds,
    /// these are the steps of a frame, on every backend: how a frame is divided depends on its length.
    pub fn batch(&self, settings: &Settings) -> u32 {
        match self {
            _ if settings.courant > 0.0 => ((FRAME / settings.dt) as u32).clamp(1, AT_ONCE),
            Engine::Gpu(_) => AT_ONCE,
            Engine::Cpu(_) | Engine::Cpu64(_) => 1,
        }
    }

    /// How the times of [`crate::run::Record::step_ms`] are measured.
    pub fn timing(&self) -> &'static str {
        match self {
            Engine::Gpu(_) => "wall time of a submission of up to 8 steps, waited for, divided by its steps",
            _ => {
                "wall time of each step; where step lengths follow speeds, of a frame's steps, divided by their number"
            }
        }
    }

    /// Measures the stages from now on, which slows steps down; false if it costs nothing or is not supported.
    pub fn measure_stages(&mut self) -> bool {
        match self {
            Engine::Gpu(headless) => headless.measure_stages(),
            _ => false,
        }
    }

    pub fn backend(&self) -> &'static str {
        match self {
            Engine::Gpu(_) => "gpu",
            Engine::Cpu(_) => "cpu",
            Engine::Cpu64(_) => "cpu64",
        }
    }

    pub fn adapter(&self) -> Option<String> {
        match self {
            Engine::Gpu(headless) => {
                let info = headless.adapter();
                Some(format!("{} ({}, {:?})", info.name, info.driver, info.backend))
            }
            _ => None,
        }
    }

    pub fn describe(&self) -> String {
        match self.adapter() {
            Some(adapter) => format!("{} on {adapter}", self.backend()),
            None => format!("{} on {} threads", self.backend(), rayon::current_num_threads()),
        }
    }
}

pub fn adapter_choice(args: &Args) -> AdapterChoice {
    AdapterChoice { name: args.adapter.clone().unwrap_or_default() }
}
