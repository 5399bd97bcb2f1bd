//! How a case is solved, and its materials in each scheme.

use pbmpm::{
    AdapterChoice, CpuSolver, DVec3, GpuOptions, Headless, Material, Model, Quality, Result, Settings, Simulate, Wall,
    World,
};

/// Cell size of most cases, m.
pub const DX: f64 = 0.02;
/// Acceleration of free fall, m/s².
pub const G: f64 = 9.81;

/// How a step is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Scheme {
    /// PB-MPM as published.
    Published,
    /// Momentum once per step, stresses by conjugate gradients.
    Implicit,
    /// Momentum once per step, with the stress at its beginning.
    Explicit,
}

impl Scheme {
    /// Every scheme.
    pub const ALL: &[Scheme] = &[Scheme::Published, Scheme::Implicit, Scheme::Explicit];

    pub fn name(self) -> &'static str {
        match self {
            Scheme::Published => "published",
            Scheme::Implicit => "implicit",
            Scheme::Explicit => "explicit",
        }
    }

    fn engine(self) -> pbmpm::Scheme {
        match self {
            Scheme::Published => pbmpm::Scheme::Published,
            Scheme::Implicit => pbmpm::Scheme::Implicit,
            Scheme::Explicit => pbmpm::Scheme::Explicit,
        }
    }
}

/// The device that steps a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Backend {
    /// The CPU path in f32.
    Cpu,
    /// The CPU path in f64.
    Cpu64,
    /// A graphics adapter.
    Gpu,
}

impl Backend {
    pub fn name(self) -> &'static str {
        match self {
            Backend::Cpu => "cpu",
            Backend::Cpu64 => "cpu64",
            Backend::Gpu => "gpu",
        }
    }
}

/// Step and iterations together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Preset {
    /// The coarsest settings that hold together.
    Draft,
    /// Affordable in a game.
    Realtime,
    /// Affordable in a film.
    Accurate,
}

impl Preset {
    pub fn name(self) -> &'static str {
        match self {
            Preset::Draft => "draft",
            Preset::Realtime => "realtime",
            Preset::Accurate => "accurate",
        }
    }

    fn quality(self) -> Quality {
        match self {
            Preset::Draft => Quality::Draft,
            Preset::Realtime => Quality::Realtime,
            Preset::Accurate => Quality::Accurate,
        }
    }
}

/// All parameters of a run that are not part of the case.
#[derive(Debug, Clone)]
pub struct Setup {
    pub scheme: Scheme,
    /// Name of the preset, or of the changes to it.
    pub preset: String,
    /// s
    pub dt: f64,
    /// Iterations per step, or the largest number of them.
    pub iterations: u32,
    /// Change of the grid's velocities at which iterations end.
    pub tolerance: f64,
    /// Whether motion that transfers smooth away is restored; if `None`, as the quality decides for the world.
    pub sharpen: Option<bool>,
    /// The liquids of a block share a pressure.
    pub block_pressure: bool,
    /// The quality of the preset, which decides what depends on a case's world.
    pub quality: Quality,
    /// Whether liquids are as stiff as the quality asks for; if not, as stiff as the iterations can follow, in the
    /// explicit scheme as the step bears.
    pub limited: bool,
    /// For the explicit scheme: the longest step as a share of the longest that is stable for a world's solids.
    pub share: f64,
    /// Refinement: factor on the number of cells along a length of the case.
    pub refine: f64,
    /// Random offset of the particles at the start, share of their spacing.
    pub jitter: f64,
    /// Simulated time of the long cases, minutes.
    pub minutes: f64,
    pub backend: Backend,
    /// Part of the name of the graphics adapter.
    pub adapter: String,
}

impl Setup {
    /// The library's settings for water on cells of [`DX`].
    pub fn new(scheme: Scheme, preset: Preset, backend: Backend) -> Setup {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, DX);
        world.materials.push(Material::liquid("water"));
        let settings = preset.quality().settings_in(scheme.engine(), &world);
        Setup {
            scheme,
            preset: preset.name().to_owned(),
            dt: settings.dt,
            iterations: settings.iterations,
            tolerance: settings.tolerance,
            sharpen: None,
            block_pressure: settings.block_pressure,
            quality: preset.quality(),
            limited: true,
            share: preset.quality().stable_share(),
            refine: 1.0,
            jitter: 0.2,
            minutes: 10.0,
            backend,
            adapter: String::new(),
        }
    }

    /// The same with another step and other iterations, which then determine the stiffness of liquids.
    pub fn stepped(&self, hertz: f64, iterations: u32) -> Setup {
        let preset = format!("{hertz:.0}x{iterations}");
        Setup { preset, dt: 1.0 / hertz, iterations, limited: false, ..self.clone() }
    }

    /// The same with steps as short as the preset requires in this very world, however deep it is.
    pub fn suited_to(&self, world: &World) -> Setup {
        let suited = if self.limited { self.chosen(world).dt } else { self.dt };
        Setup { dt: suited.min(self.dt), ..self.clone() }
    }

    /// The settings that the quality chooses for this world.
    fn chosen(&self, world: &World) -> Settings {
        self.quality.settings_in(self.scheme.engine(), world)
    }

    /// The same in steps shorter by this factor.
    pub fn shorter(&self, factor: f64) -> Setup {
        Setup { dt: self.dt / factor, share: self.share / factor, ..self.clone() }
    }

    /// The same with another tolerance for the end of iterations.
    pub fn to_within(&self, tolerance: f64) -> Setup {
        Setup { tolerance, ..self.clone() }
    }

    /// The same with half the step, with twice the iterations, and on half the cells.
    pub fn varied(&self) -> [Setup; 3] {
        let iterated = Setup { iterations: 2 * self.iterations, ..self.clone() };
        [self.shorter(2.0), iterated, self.refined(2.0)]
    }

    /// The same on cells smaller by this factor.
    pub fn refined(&self, factor: f64) -> Setup {
        Setup { refine: self.refine * factor, ..self.clone() }
    }

    /// Transfers of momentum to the grid and back per step.
    pub fn transfers_per_step(&self) -> u32 {
        if self.scheme == Scheme::Published { self.iterations } else { 1 }
    }

    /// An empty world of slip walls from the origin to `size`, m, on cells of `cell_size`, with earth's gravity.
    pub fn world(&self, size: [f64; 3], cell_size: f64) -> World {
        let mut world = World::new(DVec3::ZERO, DVec3::from_array(size), cell_size);
        world.settings.dt = self.dt;
        world.settings.scheme = self.scheme.engine();
        world.settings.iterations = self.iterations;
        world.settings.tolerance = self.tolerance;
        world.settings.block_pressure = self.block_pressure;
        world
    }

    /// A solver for `world`: in the explicit scheme with steps that are stable for its solids, in the implicit one with
    /// the iterations that they need.
    ///
    /// # Errors
    /// As for the solvers.
    pub fn solver(&self, world: &World) -> Result<Box<dyn Simulate>> {
        let mut world = world.clone();
        let chosen = self.chosen(&world);
        world.settings.sharpen = self.sharpen.unwrap_or(chosen.sharpen);
        world.settings.bulk_limit = chosen.bulk_limit.filter(|_| self.limited);
        if self.scheme == Scheme::Implicit {
            let (longest, iterations) = world.followed_dt(self.dt);
            world.settings.dt = self.dt.min(longest);
            world.settings.iterations = self.iterations.max(iterations);
        }
        if self.scheme == Scheme::Explicit {
            world.settings.dt = world.settings.dt.min(self.share * world.stable_dt());
        }
        let choice = AdapterChoice { name: self.adapter.clone() };
        Ok(match self.backend {
            Backend::Cpu => Box::new(CpuSolver::<f32>::new(&world)?),
            Backend::Cpu64 => Box::new(CpuSolver::<f64>::new(&world)?),
            Backend::Gpu => Box::new(Headless::new(&world, &choice, &GpuOptions::default())?),
        })
    }

    /// The material that comes closest to `matter` in this scheme on cells of `cell_size`.
    ///
    /// The published scheme has no moduli: its stiffness follows from relaxation, iterations, step and cell size. Where
    /// that cannot reach the requested one, the largest relaxation is taken. The other schemes take moduli.
    pub fn material(&self, name: &str, matter: Matter, cell_size: f64) -> Material {
        const DENSITY: f64 = 1000.0;
        const LIQUID_RELAXATION: f64 = 1.5;
        // Young's modulus of a heap, Pa: at its foot, 0.4 m of it are compressed by 1 %.
        const SAND: f64 = 3e5;
        let iterations = f64::from(self.iterations);
        // The 2μ that a relaxation of 1 gives, Pa; see `Material`.
        let modulus = 0.25 * iterations * DENSITY * (cell_size / self.dt).powi(2);
        match matter {
            Matter::Water { viscosity } => Material {
                relaxation: LIQUID_RELAXATION,
                viscous_relaxation: (8.0 * viscosity * self.dt / (cell_size * cell_size * iterations)).min(1.0),
                viscosity: DENSITY * viscosity,
                ..Material::liquid(name)
            },
            Matter::Passive => Material { relaxation: 0.0, bulk_modulus: 1e-3, ..Material::liquid(name) },
            Matter::Rubber { young, poisson } => Material {
                relaxation: (young / (1.0 + poisson) / modulus).min(1.9),
                youngs_modulus: young,
                poisson_ratio: poisson,
                rest_density: DENSITY,
                ..Material::elastic(name)
            },
            Matter::Sand { angle } => {
                let grains = Material::sand(name, angle);
                Material { relaxation: 1.0, rest_density: DENSITY, youngs_modulus: SAND, ..grains }
            }
            Matter::Clay { yield_stress } => Material {
                rest_density: DENSITY,
                model: Model::Viscoplastic { yield_strain: (yield_stress / (LIQUID_RELAXATION * modulus)).min(2.0) },
                relaxation: LIQUID_RELAXATION,
                yield_stress: Some(yield_stress),
                ..Material::viscoplastic(name, 0.0)
            },
        }
    }
}

/// The matter of a case, 1000 kg/m³.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Matter {
    /// Kinematic viscosity, m²/s.
    Water { viscosity: f64 },
    /// No resistance at all: only the transfers are left.
    Passive,
    /// Young's modulus, Pa, and Poisson's ratio.
    Rubber { young: f64, poisson: f64 },
    /// Friction angle, degrees.
    Sand { angle: f64 },
    /// Yield stress in shear, Pa.
    Clay { yield_stress: f64 },
}

/// Water without viscosity.
pub const WATER: Matter = Matter::Water { viscosity: 0.0 };

/// Sticky floor, slip elsewhere.
pub fn rough_floor(world: &mut World) {
    world.domain.walls.y_min = Wall::Stick;
}
