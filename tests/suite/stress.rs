//! Scenes of abuse, and the requirements that all of them must meet. The scenes are in `stress_scenes`.
//!
//! In each of the schemes, in steps of the `realtime` quality that no report divides, during the abuse and after it:
//! - every number is finite, no particle is quarantined, and all particles made are there, except those counted as
//!   gone,
//! - no particle is faster than `max_displacement` allows,
//! - energy per mass is at most that at the start plus what the scene states as put in.
//!
//! After it the matter comes to rest, with its middle where it belongs. On devices only the beginning of the abuse is
//! run, with the bits of the CPU path.

use crate::backends::{Backend, SOFTWARE, Tests};
use crate::stress_scenes::SCENES;
use crate::worlds::{after, assert_sound};
use pbmpm::{DVec3, Fate, Quality, Scheme, Simulate, State, World, state_hash};

/// The abuse of a world, and the bounds on its effects.
pub struct Abuse {
    pub world: World,
    /// Duration, s.
    pub time: f64,
    /// Actions of a host before each step of that time, counted from 0.
    pub host: fn(&mut dyn Simulate, u32),
    /// Energy that it may put in, J/kg.
    pub put_in: f64,
    /// Time for the matter to come to rest afterwards, s.
    pub rest: f64,
    /// Its kinetic energy is then below that of a fall by this many cells.
    pub still: f64,
    /// Height of its middle then, cells above the floor.
    pub middle: std::ops::Range<f64>,
}

/// A host that does nothing.
pub fn nobody(_: &mut dyn Simulate, _: u32) {}

/// A scene in a scheme; `None` if the scheme has nothing to show there.
pub type Scene = fn(Scheme) -> Option<Abuse>;

/// Steps that a device takes; SwiftShader is slow.
fn steps_on(device: Backend) -> u32 {
    if device == Backend::Swiftshader { 8 } else { 24 }
}

pub fn add(tests: &mut Tests) {
    for &(name, scene) in SCENES {
        for (scheme, ending) in
            [(Scheme::Published, "published"), (Scheme::Implicit, "implicit"), (Scheme::Explicit, "explicit")]
        {
            if scene(scheme).is_none() {
                continue;
            }
            let name = format!("{name}_{ending}");
            tests.each("stress", &[Backend::Cpu], &name, move |backend| endures(scene, scheme, backend));
            tests.each("stress", SOFTWARE, &name, move |backend| has_the_same_bits(scene, scheme, backend));
        }
    }
}

/// Gives a world the settings of the realtime quality in a scheme.
pub fn realtime(world: &mut World, scheme: Scheme) {
    world.settings = Quality::Realtime.settings_in(scheme, world);
}

/// The largest speed of sound in a world's liquids, m/s.
pub fn sound(world: &World) -> f64 {
    let settings = &world.settings;
    let iterations = f64::from(settings.iterations);
    let cells = match settings.scheme {
        Scheme::Published => 0.5 * (world.materials[0].relaxation * iterations / 3.0).sqrt(),
        Scheme::Implicit => (0.5f64.sqrt() * iterations).min(32f64.sqrt()),
        Scheme::Explicit => 0.5,
    };
    let stated = (world.materials[0].bulk_modulus / world.materials[0].rest_density).sqrt();
    let softened = cells * world.domain.cell_size / settings.dt;
    if settings.scheme == Scheme::Published { softened } else { softened.min(stated) }
}

/// Kinetic energy, and potential energy above the side that gravity points to, J/kg.
fn energy(world: &World, gravity: DVec3, state: &State) -> [f64; 2] {
    if state.mass_kg == 0.0 {
        return [0.0; 2];
    }
    let middle = DVec3::from_array(state.centre_of_mass_m);
    let lowest = DVec3::select(gravity.cmplt(DVec3::ZERO), world.domain.min, world.domain.max);
    [state.kinetic_j / state.mass_kg, gravity.dot(lowest - middle)]
}

/// Requirements at any time.
fn check(abuse: &Abuse, solver: &mut dyn Simulate, first: f64) -> [f64; 2] {
    let particles = solver.particles().expect("particles");
    let report = solver.report().expect("a report");
    assert_sound(&particles);
    let count = |fate: Fate| particles.iter().filter(|p| p.fate == fate).count() as u64;
    let made = abuse.world.particle_count().expect("a count") as u64 + report.emitted;
    let gone = report.drained + report.faults.escaped;
    assert_eq!((u64::from(report.alive), count(Fate::Alive)), (made - gone, made - gone), "{report:?}");
    assert_eq!(report.faults.quarantined, 0, "{report:?}");
    let state = State::of(&particles, solver.gravity());
    let fastest = abuse.world.settings.max_displacement * abuse.world.domain.cell_size / solver.dt();
    assert!(state.max_speed_m_s <= 1.0001 * fastest, "{} m/s of {fastest}", state.max_speed_m_s);
    let [kinetic, potential] = energy(&abuse.world, solver.gravity(), &state);
    let most = first + abuse.put_in;
    let now = kinetic + potential;
    assert!(now <= 1.001 * most, "{now} J/kg ({kinetic} kinetic) of {most} after {} s: {report:?}", report.time);
    [kinetic, state.centre_of_mass_m[1] - abuse.world.domain.min.y]
}

fn endures(scene: Scene, scheme: Scheme, backend: Backend) {
    let abuse = scene(scheme).expect("a scene in this scheme");
    let mut solver = backend.solver(&abuse.world);
    let first: f64 = energy(&abuse.world, abuse.world.gravity, &crate::worlds::state(&mut *solver)).iter().sum();
    let mut step = 0;
    let mut next = 0.0;
    while solver.time() < abuse.time {
        (abuse.host)(&mut *solver, step);
        solver.step().expect("a step");
        step += 1;
        if solver.time() >= next {
            check(&abuse, &mut *solver, first);
            next += abuse.time / 16.0;
        }
    }
    for _ in 0..16 {
        solver.steps((abuse.rest / 16.0 / solver.dt()).ceil() as u32).expect("steps");
        check(&abuse, &mut *solver, first);
    }
    let [kinetic, middle] = check(&abuse, &mut *solver, first);
    let dx = abuse.world.domain.cell_size;
    let fall = kinetic / (solver.gravity().length() * dx);
    assert!(fall < abuse.still, "not at rest after {} s: the energy of a fall by {fall} cells", solver.time());
    let middle = middle / dx;
    assert!(abuse.middle.contains(&middle), "the middle is {middle} cells above the floor, not in {:?}", abuse.middle);
}

fn has_the_same_bits(scene: Scene, scheme: Scheme, device: Backend) {
    let abuse = scene(scheme).expect("a scene in this scheme");
    let [cpu, device] = [Backend::Cpu, device].map(|backend| {
        let mut solver = backend.solver(&abuse.world);
        for step in 0..steps_on(device) {
            (abuse.host)(&mut *solver, step);
            solver.step().expect("a step");
        }
        let end = after(&mut *solver, 0);
        assert_sound(&end);
        state_hash(&end)
    });
    assert_eq!(cpu, device);
}
