//! The CPU path: the readable twin of the GPU path, on all cores with the feature `parallel`.

pub(crate) mod blocks;
pub(crate) mod constants;
pub(crate) mod gradient;
pub(crate) mod lanes;
pub(crate) mod par;
mod snapshot;
pub(crate) mod solve;
pub(crate) mod state;

use crate::cpu::gradient::{mass_of, material_of};
use crate::emitter::Rate;
use crate::error::Result;
use crate::load::{self, Ledger, Loads};
use crate::material::{Material, Model};
use crate::math::real::{Lanes, Real};
use crate::plan::{Needs, Stage, passes};
use crate::region::Region;
use crate::report::{Fate, Memory, Particle, StepReport};
use crate::sensor::{self, Reading};
use crate::settings::Scheme;
use crate::shape::Pose;
use crate::simulate::{Simulate, StageTime};
use crate::snapshot::Snapshot;
use crate::spawn::Spawn;
use crate::stages::integrate::largest_square;
use crate::stages::{self, collider_cull, even, solid};
use crate::timeline::{StepInput, Timeline};
use crate::tool::Tool;
use crate::units::Units;
use crate::world::World;
use constants::{CandidateConstants, ColliderConstants, Constants, MaterialConstants, ToolConstants};
use glam::{DMat3, DVec3};
use state::{CpuState, DRAINED, ESCAPED, Tally, VACANT};
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant};

/// Steps a world on the CPU: `CpuSolver::<f32>::new(&world)`, on all cores with the feature `parallel`.
///
/// Over `f32` it sums the grid in the same fixed-point integers as the GPU path and agrees with it within rounding.
/// Over `f64` it sums without quantisation, as a reference for the error of the others. Results are the same bits for
/// any number of threads.
#[derive(Debug)]
pub struct CpuSolver<R: Real = f32> {
    pub(crate) timeline: Timeline,
    pub(crate) state: CpuState<R>,
    spawned: u64,
    /// From the device that a snapshot came from; the CPU path's grid is always large enough.
    steps_deferred: u64,
    ledger: Ledger,
    times: [Duration; Stage::ALL.len()],
    /// Steps that these times cover: not those before a snapshot that was resumed.
    timed: u64,
}

impl<R: Real> CpuSolver<R> {
    /// Makes the particles of `world`.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if the world is not valid.
    pub fn new(world: &World) -> Result<Self> {
        let seeds = world.seeds()?;
        let timeline = Timeline::new(world, &seeds)?;
        let units = timeline.units;
        let mut state = CpuState {
            constants: Constants::new(&timeline.input()),
            materials: materials(world, &units),
            colliders: Vec::new(),
            drains: Vec::new(),
            sensors: Vec::new(),
            sensed: world.sensors.iter().map(|_| Default::default()).collect(),
            tools: Vec::new(),
            candidates: Vec::new(),
            accepted: Vec::new(),
            vacant: Vec::new(),
            capacity: world.room(seeds.len())? as u32,
            position: Vec::new(),
            displacement: Vec::new(),
            gradient: Vec::new(),
            largest_square: R::of(0.0),
            largest_motion: None,
            deformation: Vec::new(),
            id: Vec::new(),
            runs: Vec::new(),
            order: Vec::new(),
            rest: Vec::new(),
            restless: Vec::new(),
            awake: Vec::new(),
            disturbances: Vec::new(),
            asleep: 0,
            table: state::Table::default(),
            blocks: Vec::new(),
            occupied: 0,
            links: Vec::new(),
            sources: Vec::new(),
            cull: Vec::new(),
            cull_words: collider_cull::words(timeline.collider_count()),
            gaps: Vec::new(),
            tiles: Vec::new(),
            grid: Vec::new(),
            scratch: Vec::new(),
            scratch_id: Vec::new(),
            search: Vec::new(),
            shear: Vec::new(),
            deviator: Vec::new(),
            force: Vec::new(),
            field: Vec::new(),
            held: Vec::new(),
            solve: Default::default(),
            block_tiles: Vec::new(),
            block_pressures: Vec::new(),
            couplings: Vec::new(),
            tally: Tally::default(),
            loads: load::running(&world.colliders),
            features: timeline.features,
        };
        state.reserve(seeds.len());
        seeds.iter().for_each(|seed| state.push(CandidateConstants::new(&timeline.particle(seed)).particle()));
        state.largest_square = largest_square(&state.position, &state.displacement);
        let ledger = Ledger::new(&world.colliders, &timeline.units, world.settings.dt);
        Ok(CpuSolver {
            timeline,
            state,
            spawned: seeds.len() as u64,
            steps_deferred: 0,
            ledger,
            times: [Duration::ZERO; Stage::ALL.len()],
            timed: 0,
        })
    }

    /// What the next step reads, and which passes it needs.
    pub(crate) fn next_step(&self) -> (StepInput, Needs) {
        let input = self.timeline.input();
        let needs = self.timeline.needs(&input);
        (input, needs)
    }

    pub(crate) fn load(&mut self, input: &StepInput) {
        self.state.constants = Constants::new(input);
        let lanes = |c| ColliderConstants::new(c, |x| R::V::all(R::of(x)));
        self.state.colliders.clear();
        self.state.colliders.extend(input.colliders.iter().map(lanes));
        self.state.tools.clear();
        self.state.tools.extend(input.tools.iter().map(ToolConstants::new));
        self.state.drains.clear();
        self.state.drains.extend(input.drains.iter().map(lanes));
        self.state.sensors.clear();
        self.state.sensors.extend(input.sensors.iter().map(lanes));
        self.state.disturbances.clear();
        self.state.disturbances.extend(input.sleep.iter().flat_map(|sleep| &sleep.disturbed));
        self.state.candidates.clear();
        self.state.candidates.extend(input.candidates.iter().map(CandidateConstants::new));
    }

    /// The particles as the GPU path stores them, slot by slot: positions, displacements, gradients. For renderers that
    /// draw from solver buffers.
    pub fn gpu_layout(&self) -> ParticleArrays {
        let f32s = |v: [R; 4]| v.map(|x| x.f64() as f32);
        let n = self.state.capacity as usize;
        let mut arrays = ParticleArrays {
            position: vec![[0.0; 4]; n],
            displacement: vec![[0.0; 4]; n],
            gradient: vec![[[0.0; 4]; 3]; n],
            deformation: vec![[[0.0; 4]; 3]; if self.state.features.deforms() { n } else { 0 }],
        };
        for (i, &id) in self.state.id.iter().enumerate() {
            arrays.position[id as usize] = f32s(self.state.position[i]);
            arrays.displacement[id as usize] = f32s(self.state.displacement[i]);
            arrays.gradient[id as usize] = self.state.gradient[i].map(f32s);
            if let Some(deformation) = self.state.deformation.get(i) {
                arrays.deformation[id as usize] = deformation.map(f32s);
            }
        }
        arrays
    }
}

/// Particles as the GPU path stores them; see [`ParticleBuffers`](crate::ParticleBuffers).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ParticleArrays {
    /// Position in cells, volume ratio.
    pub position: Vec<[f32; 4]>,
    /// Displacement in cells, volume fraction measured on the grid.
    pub displacement: Vec<[f32; 4]>,
    /// Columns of the displacement gradient; fourth lanes mass, material index (the whole part; the fraction notes faces
    /// of bodies before which the particle lies), and in the implicit scheme the pressure, in the explicit one the
    /// evenness of the matter around it.
    pub gradient: Vec<[[f32; 4]; 3]>,
    /// Columns of the deformation gradient. Fourth lanes: for sand its slack, in the first column; for other solids the
    /// correction of the strains that they underestimate beside clamps. For viscous liquids, in worlds with something
    /// to stick to, the same correction, and in the columns the rest of it in place of a strain. Empty in other worlds
    /// without solids.
    pub deformation: Vec<[[f32; 4]; 3]>,
}

/// The constants of a world's materials. A material that takes no part gets those of one that does, so that it has no
/// effect.
pub(crate) fn materials<R: Real>(world: &World, units: &Units) -> Vec<MaterialConstants<R>> {
    let settings = &world.settings;
    let lightest = world.lightest_liquid();
    let constants = |m: &Material| MaterialConstants {
        lightness: R::of((lightest / m.rest_density).min(1.0)),
        ..material_constants(&settings.softened(m), settings.scheme, world.solves_viscosity(m), units)
    };
    let other = world.taking_part().next().map(|(_, material)| material);
    let seen = |m| if world.takes_part(m) { m } else { other.unwrap_or(m) };
    world.materials.iter().map(seen).map(constants).collect()
}

pub(crate) fn material_constants<R: Real>(
    material: &Material,
    scheme: Scheme,
    solved: bool,
    units: &Units,
) -> MaterialConstants<R> {
    let [bulk, shear] = material.moduli();
    let (model, gain, shape_weight, yield_limit) = match material.model {
        Model::Liquid => (solid::LIQUID, 1.0 / 3.0, 0.0, 0.0),
        Model::Elastic { shape_weight } => (solid::ELASTIC, 1.0, shape_weight, 0.0),
        // In simple shear of stress τ the deviator's norm is √2 τ: √2 tan φ times the pressure when τ is tan φ times it
        // (validation by an incline). As a strain that is over 2μ, the pressure K times the trace; in the published
        // scheme the stress is the strain times a modulus, its pressure a third of the trace.
        Model::Sand { friction_angle } => {
            let ratio = if scheme != Scheme::Published { bulk / (2.0 * shear) } else { 1.0 / 3.0 };
            (solid::SAND, 1.0, 1.0, std::f64::consts::SQRT_2 * ratio * friction_angle.to_radians().tan())
        }
        // The deviator of pure shear, (y, −y, 0), has the norm √2 y; its stress is 2μ y.
        Model::Viscoplastic { yield_strain } => {
            let stress = material.yield_stress.filter(|_| scheme != Scheme::Published);
            let strain = stress.map_or(yield_strain, |stress| stress / (2.0 * shear));
            (solid::VISCOPLASTIC, 1.0, 1.0, std::f64::consts::SQRT_2 * strain)
        }
    };
    let viscosity = R::of(units.modulus_in(material.viscosity));
    let [viscosity, solved_viscosity] = if solved { [R::of(0.0), viscosity] } else { [viscosity, R::of(0.0)] };
    MaterialConstants {
        model,
        gain: R::of(material.relaxation * gain),
        viscous_relaxation: R::of(material.viscous_relaxation),
        inverse_density: R::of(1.0 / units.density_in(material.rest_density)),
        shape_weight: R::of(shape_weight),
        yield_limit: R::of(yield_limit),
        bulk: R::of(units.modulus_in(bulk)),
        shear: R::of(units.modulus_in(shear)),
        viscosity,
        solved_viscosity,
        even: R::of(even::share(material.model)),
        lightness: R::of(1.0),
    }
}

/// A particle in SI units from its lanes in cell units.
pub(crate) fn particle_out(units: &Units, dt: f64, position: [f64; 4], u: [f64; 4], d: [[f64; 4]; 3]) -> Particle {
    let xyz = |v: [f64; 4]| DVec3::new(v[0], v[1], v[2]);
    Particle {
        position: units.position_out(xyz(position)),
        velocity: units.velocity_out(xyz(u), dt),
        velocity_gradient: units.gradient_out(DMat3::from_cols(xyz(d[0]), xyz(d[1]), xyz(d[2])), dt),
        volume_ratio: position[3],
        mass: units.mass_out(mass_of(&d)),
        material: material_of(&d) as u32,
        fate: match position[3] {
            ratio if ratio > 0.0 => Fate::Alive,
            VACANT => Fate::Vacant,
            ESCAPED => Fate::Escaped,
            DRAINED => Fate::Drained,
            _ => Fate::Quarantined,
        },
    }
}

impl<R: Real> Simulate for CpuSolver<R> {
    fn step(&mut self) -> Result<()> {
        let (input, needs) = self.next_step();
        self.load(&input);
        par::inside(|| {
            for pass in passes(needs) {
                let start = Instant::now();
                stages::run(pass, &mut self.state);
                self.times[pass.stage.index()] += start.elapsed();
            }
        });
        self.timed += 1;
        self.timeline.advance(&input);
        self.ledger.take(load::reading(&self.state.loads));
        Ok(())
    }

    fn particles(&mut self) -> Result<Vec<Particle>> {
        let units = self.timeline.units;
        let dt = self.timeline.last_dt();
        let s = &self.state;
        let f64s = |v: [R; 4]| v.map(Real::f64);
        let nothing = [0.0; 4];
        let mut out = vec![particle_out(&units, dt, nothing, nothing, [nothing; 3]); s.capacity as usize];
        for (i, &id) in s.id.iter().enumerate() {
            out[id as usize] =
                particle_out(&units, dt, f64s(s.position[i]), f64s(s.displacement[i]), s.gradient[i].map(f64s));
        }
        Ok(out)
    }

    fn report(&mut self) -> Result<StepReport> {
        let now = self.timeline.now();
        Ok(self.counts().report(&self.timeline, now.step, now))
    }

    fn sensors(&mut self) -> Result<Vec<Reading>> {
        let t = &self.timeline;
        let sums = |s: &[AtomicI64; sensor::SUMS]| std::array::from_fn(|i| s[i].load(Ordering::Relaxed));
        Ok(self.state.sensed.iter().map(|s| sensor::reading(sums(s), &t.units, t.first_dt)).collect())
    }

    fn loads(&mut self) -> Result<Loads> {
        let now = self.timeline.now();
        Ok(self.ledger.loads(now.step, now.time))
    }

    fn memory(&self) -> Memory {
        let [particles, grid, bins, other] = self.state.bytes();
        let distances: usize = self.timeline.grids.iter().map(|grid| size_of_val(&*grid.values)).sum();
        let other = other + (size_of::<Self>() + distances) as u64;
        Memory { particles, grid, bins, other }
    }

    fn poses(&self) -> &[Pose] {
        &self.timeline.now().poses
    }

    fn units(&self) -> Units {
        self.timeline.units
    }

    fn gravity(&self) -> DVec3 {
        self.timeline.gravity
    }

    fn time(&self) -> f64 {
        self.timeline.now().time
    }

    fn dt(&self) -> f64 {
        self.timeline.dt
    }

    fn set_dt(&mut self, dt: f64) -> Result<()> {
        self.timeline.set_dt(dt)
    }

    fn plan_frame(&mut self, frame: f64) -> Result<u32> {
        let speed = self.report()?.max_speed;
        self.timeline.plan_frame(frame, speed)
    }

    fn set_gravity(&mut self, gravity: DVec3) -> Result<()> {
        self.timeline.set_gravity(gravity)
    }

    fn set_collider(&mut self, index: usize, pose: Option<Pose>, linear: DVec3, angular: DVec3) -> Result<()> {
        self.timeline.set_collider(index, pose, linear, angular)
    }

    fn add(&mut self, spawn: &Spawn) -> Result<usize> {
        self.timeline.add(spawn, self.state.capacity as usize, |_| Ok(()))
    }

    fn remove(&mut self, region: &Region) -> Result<()> {
        self.timeline.remove(region, |_| Ok(()))
    }

    fn save(&mut self) -> Result<Snapshot> {
        Ok(self.saved())
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<()> {
        self.take_up(snapshot)
    }

    fn release_quarantined(&mut self) {
        self.timeline.release_quarantined();
    }

    fn set_emission(&mut self, emitter: usize, rate: Rate) -> Result<()> {
        self.timeline.set_emission(emitter, rate)
    }

    fn set_tools(&mut self, tools: &[Tool]) -> Result<()> {
        self.timeline.set_tools(tools)
    }

    fn stage_times(&self) -> Vec<StageTime> {
        let steps = self.timed.max(1) as f64;
        let ran = Stage::ALL.into_iter().zip(self.times).filter(|(_, t)| !t.is_zero());
        ran.map(|(stage, t)| StageTime { stage: stage.name(), seconds: t.as_secs_f64() / steps }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Collider, DVec3, Emitter, Fill, Settings, Shape, World};

    /// A few particles of each material, and one of all that acts on them: small enough for an interpreter that checks
    /// each access.
    fn everything(scheme: Scheme) -> World {
        let mut world = World::new(DVec3::ZERO, DVec3::splat(0.8), 0.1);
        world.settings = Settings { scheme, dt: 1e-4, iterations: 2, capacity: Some(64), ..world.settings };
        let materials = [
            Material::liquid("water"),
            Material::elastic("rubber"),
            Material::viscoplastic("clay", 0.05),
            Material::sand("sand", 30.0),
        ];
        for (i, material) in materials.into_iter().filter(|m| scheme.takes(m.model)).enumerate() {
            let corner = DVec3::new(0.1 + 0.15 * i as f64, 0.2, 0.3);
            let fill = Fill::PerCell(8.0);
            world.spawns.push(Spawn { fill, ..Spawn::cuboid(&material.name, corner, corner + DVec3::splat(0.1)) });
            world.materials.push(material);
        }
        let cube = |edge: f64| Shape::Box { half_size: DVec3::splat(0.5 * edge) };
        let at = DVec3::new(0.2, 0.16, 0.35);
        world.colliders.push(Collider { measure: true, ..Collider::new(cube(0.1), at) });
        world.drains.push(Region::new(cube(0.06), DVec3::new(0.45, 0.25, 0.35)));
        world.sensors.push(Region::new(cube(0.8), DVec3::splat(0.4)));
        let tap = Emitter::new("water", cube(0.1), DVec3::new(0.6, 0.6, 0.6), Rate::Particles(1e4));
        world.emitters.push(Emitter { velocity: DVec3::new(0.0, -1.0, 0.0), ..tap });
        world
    }

    #[test]
    fn a_step_of_everything() {
        for scheme in [Scheme::Published, Scheme::Implicit, Scheme::Explicit] {
            let world = everything(scheme);
            let mut solver = CpuSolver::<f32>::new(&world).expect("a world");
            solver.steps(2).expect("steps");
            let report = solver.report().expect("a report");
            let made = world.particle_count().expect("a count") as u64 + report.emitted;
            assert!(report.emitted > 0 && report.drained > 0, "{report:?}");
            assert_eq!(u64::from(report.alive), made - report.drained);
            let snapshot = solver.save().expect("a snapshot");
            let mut again = CpuSolver::<f32>::new(&world).expect("a world");
            again.restore(&snapshot).expect("the same world");
            let [first, second] = [&mut solver, &mut again].map(|solver| {
                solver.step().expect("a step");
                crate::state_hash(&solver.particles().expect("particles"))
            });
            assert_eq!(first, second);
        }
    }
}
