//! The backends of the tests, and the list of tests.

use libtest_mimic::{Completion, Trial};
use pbmpm::{AdapterChoice, CpuSolver, Error, GpuOptions, Headless, Simulate, World};
use std::sync::{Mutex, OnceLock, PoisonError};

/// A backend that steps a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backend {
    /// The CPU path in f32 with fixed-point sums.
    Cpu,
    /// The CPU path in f64.
    Cpu64,
    /// Mesa's Vulkan on the CPU.
    Lavapipe,
    /// Google's Vulkan on the CPU.
    Swiftshader,
    /// Mesa's OpenGL on the CPU.
    Gl,
    /// The first real GPU.
    Gpu,
}
use Backend::*;

/// Every backend.
pub const ALL: &[Backend] = &[Cpu, Cpu64, Lavapipe, Swiftshader, Gl, Gpu];
/// The devices and their twin, in single precision.
pub const SINGLE: &[Backend] = &[Cpu, Lavapipe, Swiftshader, Gl, Gpu];
/// The backends with a device.
pub const DEVICES: &[Backend] = &[Lavapipe, Swiftshader, Gl, Gpu];
/// The backends with a Vulkan, Metal or DirectX device.
pub const NATIVE: &[Backend] = &[Lavapipe, Swiftshader, Gpu];
/// Devices that are software, whose rounding is known.
pub const SOFTWARE: &[Backend] = &[Lavapipe, Swiftshader];
/// All except OpenGL, for tests that would take long there and differ little.
pub const MOST: &[Backend] = &[Cpu, Cpu64, Lavapipe, Swiftshader, Gpu];
/// The CPU path in both number types.
pub const CPUS: &[Backend] = &[Cpu, Cpu64];

/// Tests that take a minute or more and show little that others do not.
const SLOW: &[(Backend, &str)] =
    &[(Swiftshader, "thesis_basin_200_steps"), (Swiftshader, "more_particles_than_invocations")];

impl Backend {
    pub fn name(self) -> &'static str {
        match self {
            Cpu => "cpu",
            Cpu64 => "cpu64",
            Lavapipe => "lavapipe",
            Swiftshader => "swiftshader",
            Gl => "gl",
            Gpu => "gpu",
        }
    }

    /// How to get the backend where it is missing.
    fn remedy(self) -> &'static str {
        match self {
            Cpu | Cpu64 => "",
            Lavapipe => "install Debian's mesa-vulkan-drivers",
            Swiftshader => "install Debian's chromium and name its vk_swiftshader_icd.json in VK_DRIVER_FILES",
            Gl => "install Debian's libegl1 and libgl1-mesa-dri",
            Gpu => "needs a GPU and its driver",
        }
    }

    fn is(self, info: &wgpu::AdapterInfo) -> bool {
        let name = info.name.to_lowercase();
        let software = info.device_type == wgpu::DeviceType::Cpu || name.contains("llvmpipe");
        match self {
            Cpu | Cpu64 => false,
            Lavapipe => name.contains("llvmpipe") && info.backend == wgpu::Backend::Vulkan,
            Swiftshader => name.contains("swiftshader") && info.backend == wgpu::Backend::Vulkan,
            Gl => name.contains("llvmpipe") && info.backend == wgpu::Backend::Gl,
            Gpu => !software && !name.contains("swiftshader") && info.backend != wgpu::Backend::Gl,
        }
    }

    /// The adapter's description, as [`AdapterChoice`] matches it.
    fn description(self) -> Option<&'static str> {
        static FOUND: OnceLock<Vec<(wgpu::AdapterInfo, String)>> = OnceLock::new();
        let found = FOUND.get_or_init(|| {
            let infos = pbmpm::adapters().into_iter().map(|adapter| adapter.get_info());
            infos.map(|i| (i.clone(), format!("{} ({}, {:?})", i.name, i.driver, i.backend))).collect()
        });
        found.iter().find(|(info, _)| self.is(info)).map(|(_, text)| text.as_str())
    }

    pub fn choice(self) -> AdapterChoice {
        AdapterChoice { name: self.description().unwrap_or_else(|| panic!("no {}", self.name())).to_owned() }
    }

    /// An adapter to open by hand.
    pub fn adapter(self) -> wgpu::Adapter {
        pbmpm::choose_adapter(&self.choice()).expect("it was found before")
    }

    /// A solver for `world`.
    pub fn solver(self, world: &World) -> Box<dyn Simulate> {
        self.try_solver(world, &GpuOptions::default()).unwrap_or_else(|e| panic!("{e}"))
    }

    pub fn try_solver(self, world: &World, options: &GpuOptions) -> Result<Box<dyn Simulate>, Error> {
        Ok(match self {
            Cpu => Box::new(CpuSolver::<f32>::new(world)?),
            Cpu64 => Box::new(CpuSolver::<f64>::new(world)?),
            _ => Box::new(Headless::new(world, &self.choice(), options)?),
        })
    }

    /// `f64` where the backend computes in double precision, `f32` elsewhere.
    pub fn pick(self, f64: f64, f32: f64) -> f64 {
        if self == Cpu64 { f64 } else { f32 }
    }
}

/// Seconds that each test took.
static TIMES: Mutex<Vec<(String, f64)>> = Mutex::new(Vec::new());

fn timed(name: &str, body: impl FnOnce()) {
    let start = std::time::Instant::now();
    body();
    TIMES.lock().unwrap_or_else(PoisonError::into_inner).push((name.to_owned(), start.elapsed().as_secs_f64()));
}

/// Prints the total time of each module and the slowest tests, if `PBMPM_TEST_TIMES` is set.
pub fn print_times() {
    if std::env::var_os("PBMPM_TEST_TIMES").is_none() {
        return;
    }
    let mut times = TIMES.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let mut modules = std::collections::BTreeMap::<&str, f64>::new();
    for (name, seconds) in &times {
        *modules.entry(name.split("::").next().unwrap_or_default()).or_default() += seconds;
    }
    modules.iter().for_each(|(module, seconds)| println!("{seconds:8.2} s  {module}"));
    times.sort_by(|a, b| b.1.total_cmp(&a.1));
    times.iter().take(20).for_each(|(name, seconds)| println!("{seconds:8.2} s  {name}"));
}

/// The list of tests.
#[derive(Default)]
pub struct Tests {
    pub trials: Vec<Trial>,
}

impl Tests {
    /// A test that needs no backend.
    pub fn once(&mut self, module: &str, name: &str, body: fn()) {
        let name = format!("{module}::{name}");
        self.trials.push(Trial::test(name.clone(), move || {
            timed(&name, body);
            Ok(())
        }));
    }

    /// A test for each of `backends`.
    pub fn each(
        &mut self,
        module: &str,
        backends: &[Backend],
        name: &str,
        body: impl Fn(Backend) + Copy + Send + 'static,
    ) {
        for &backend in backends {
            let name = format!("{module}::{}::{name}", backend.name());
            self.trials.push(Trial::ignorable_test(name.clone(), move || {
                if !matches!(backend, Cpu | Cpu64) && backend.description().is_none() {
                    let reason = format!("no such adapter; {}", backend.remedy());
                    let required = std::env::var("PBMPM_REQUIRE_ADAPTERS").unwrap_or_default();
                    return match required.split(',').any(|name| name.trim() == backend.name()) {
                        true => Err(format!("PBMPM_REQUIRE_ADAPTERS names {}: {reason}", backend.name()).into()),
                        false => Ok(Completion::ignored_with(reason)),
                    };
                }
                let slow = SLOW.iter().any(|(on, end)| *on == backend && name.ends_with(end));
                if slow && std::env::var_os("PBMPM_SLOW_TESTS").is_none() {
                    return Ok(Completion::ignored_with("slow; set PBMPM_SLOW_TESTS=1"));
                }
                // One test at a time on each software device, whose work all cores share.
                static BUSY: [Mutex<()>; ALL.len()] = [const { Mutex::new(()) }; ALL.len()];
                let alone = DEVICES.contains(&backend) && backend != Gpu;
                let device = alone.then(|| &BUSY[backend as usize]);
                let _alone = device.map(|device| device.lock().unwrap_or_else(PoisonError::into_inner));
                timed(&name, || body(backend));
                Ok(Completion::Completed)
            }));
        }
    }
}
