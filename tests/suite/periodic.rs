//! Domains that repeat along an axis.

use crate::backends::{Backend, CPUS, MOST, Tests};
use crate::worlds::{
    DX, after, around, assert_sound, block, empty, larger, mean_velocity, particles, repeated, report,
};
use pbmpm::{CpuSolver, DVec3, Error, Particle, Scheme, Wall, Walls, World};

pub fn add(tests: &mut Tests) {
    tests.each("periodic", MOST, "sides_are_anywhere", sides_are_anywhere);
    tests.each("periodic", MOST, "a_full_box_keeps_its_momentum", a_full_box_keeps_its_momentum);
    tests.each("periodic", CPUS, "a_channel_has_poiseuilles_profile", a_channel_has_poiseuilles_profile);
    tests.once("periodic", "sides_come_in_pairs", sides_come_in_pairs);
}

const SCHEMES: [Scheme; 3] = [Scheme::Published, Scheme::Implicit, Scheme::Explicit];

/// Two blocks that meet over a floor, elsewhere by this many cells.
fn meeting(scheme: Scheme, by: [f64; 3]) -> World {
    let mut world = empty([24.0, 12.0, 12.0], Wall::Slip);
    world.domain.walls = around(Wall::Periodic);
    world.settings.scheme = scheme;
    world.settings.iterations = 4;
    world.spawns.push(block([3.0, 1.0, 1.0], [8.0, 6.0, 6.0], [2.0, -1.0, 0.3]));
    world.spawns.push(block([11.0, 2.0, 2.0], [16.0, 5.0, 7.0], [-2.0, -1.0, 0.7]));
    for spawn in &mut world.spawns {
        spawn.position += DVec3::from_array(by) * DX;
        // On a lattice rounding would decide ties.
        spawn.jitter = 0.3;
    }
    world
}

/// The way from one particle to another, in a domain of these cells that repeats along x and z.
fn way(a: &Particle, b: &Particle, world: &World) -> DVec3 {
    let period = (world.domain.max - world.domain.min) * DVec3::new(1.0, 0.0, 1.0);
    let way = b.position - a.position;
    way - period * (way / (world.domain.max - world.domain.min)).round()
}

/// It makes no difference where the sides cut through matter, up to rounding. In single precision the solve of the
/// implicit scheme amplifies that tenfold in two steps, wherever the matter is.
fn sides_are_anywhere(backend: Backend) {
    for scheme in SCHEMES {
        let by = [8.0, 0.0, 4.0];
        let [here, there] = [[0.0; 3], by].map(|by| meeting(scheme, by));
        let exact = backend == Backend::Cpu64;
        let steps = if exact || scheme != Scheme::Implicit { 40 } else { 8 };
        let [a, b] = [&here, &there].map(|world| after(&mut *backend.solver(world), steps));
        let inside = |p: &Particle| p.position.cmpge(here.domain.min).all() && p.position.cmple(here.domain.max).all();
        assert!(a.iter().chain(&b).all(inside), "{scheme:?}");
        let shift = DVec3::from_array(by) * DX;
        let off = |(a, b): (&Particle, &Particle)| {
            let mut moved = *a;
            moved.position += shift;
            way(&moved, b, &here).length() / DX
        };
        let worst = a.iter().zip(&b).map(off).fold(0.0, larger);
        let most = if exact { 1e-6 } else { 1e-2 };
        assert!(worst < most, "{scheme:?}: {worst} cells");
        let crossed = b
            .iter()
            .zip(particles(&mut *backend.solver(&there)))
            .filter(|(end, start)| (end.position - start.position).abs().cmpgt(DVec3::new(12.0, 12.0, 6.0) * DX).any());
        assert!(crossed.count() > 50, "{scheme:?}");
    }
}

/// Liquid that fills a box without sides, one half of it moving past the other: nothing is lost, nor is momentum, and it
/// stays as dense as it was.
fn a_full_box_keeps_its_momentum(backend: Backend) {
    for scheme in SCHEMES {
        let mut world = empty([12.0, 12.0, 16.0], Wall::Periodic);
        world.gravity = DVec3::ZERO;
        world.settings.scheme = scheme;
        world.settings.iterations = 4;
        world.spawns.push(block([0.0, 0.0, 0.0], [12.0, 6.0, 16.0], [0.7, 0.0, -0.4]));
        world.spawns.push(block([0.0, 6.0, 0.0], [12.0, 12.0, 16.0], [-0.2, 0.1, 0.6]));
        let mut solver = backend.solver(&world);
        let before = mean_velocity(&mut *solver);
        let end = after(&mut *solver, 60);
        assert_sound(&end);
        assert_eq!(report(&mut *solver).alive as usize, end.len());
        let change = mean_velocity(&mut *solver).distance(before);
        assert!(change < 1e-5, "{scheme:?}: {change} m/s of {before}");
        let densest = end.iter().map(|p| (p.volume_ratio - 1.0).abs()).fold(0.0, larger);
        assert!(densest < 0.1, "{scheme:?}: {densest}");
    }
}

/// Plane Poiseuille flow, 12 cells between plates that the liquid sticks to, driven by gravity: in the middle
/// u = ρ g h²/(8 μ), and on average two thirds of that.
fn a_channel_has_poiseuilles_profile(backend: Backend) {
    let (height, viscosity, pull): (f64, f64, f64) = (12.0 * DX, 20.0, 1.0);
    for scheme in [Scheme::Implicit, Scheme::Explicit] {
        let mut world = empty([12.0, 12.0, 4.0], Wall::Slip);
        let walls = Walls { x_min: Wall::Periodic, x_max: Wall::Periodic, ..Walls::all(Wall::Slip) };
        world.domain.walls = Walls { y_min: Wall::Stick, y_max: Wall::Stick, ..walls };
        world.gravity = DVec3::X * pull;
        world.materials[0].viscosity = viscosity;
        world.settings.scheme = scheme;
        world.settings.dt = 1.0 / 480.0;
        world.settings.iterations = 8;
        world.spawns.push(block([0.0; 3], [12.0, 12.0, 4.0], [0.0; 3]));
        let mut solver = backend.solver(&world);
        let end = after(&mut *solver, 720);
        let fastest = 1000.0 * pull * height * height / (8.0 * viscosity);
        let mean = mean_velocity(&mut *solver).x / (fastest * 2.0 / 3.0);
        let off = end.iter().map(|p| {
            let y = p.position.y / height;
            (p.velocity.x - fastest * 4.0 * y * (1.0 - y)).abs() / fastest
        });
        let worst = off.fold(0.0, larger);
        assert!((mean - 1.0).abs() < 0.03, "{scheme:?}: {mean} of the mean, {worst}");
        assert!(worst < 0.05, "{scheme:?}: {worst}");
    }
}

fn sides_come_in_pairs() {
    let sided = |cells: [f64; 3], walls: Walls| {
        let mut world = empty(cells, Wall::Slip);
        world.domain.walls = walls;
        world.spawns.push(block([1.0; 3], [2.0; 3], [0.0; 3]));
        CpuSolver::<f32>::new(&world).map(|_| ())
    };
    let field = |result: Result<(), Error>| match result {
        Err(Error::Invalid { field, .. }) => field,
        other => panic!("{other:?}"),
    };
    let one = Walls { z_max: Wall::Periodic, ..Walls::default() };
    assert_eq!(field(sided([12.0; 3], one)), "domain.walls.z_min");
    let both = Walls { z_min: Wall::Periodic, ..one };
    assert_eq!(sided([5.0, 6.0, 12.0], both), Ok(()));
    for cells in [8.0, 14.0, 12.5] {
        assert_eq!(field(sided([12.0, 12.0, cells], both)), "domain.max");
    }
    let mut fast = repeated();
    fast.settings.max_displacement = 11.0;
    assert_eq!(field(CpuSolver::<f32>::new(&fast).map(|_| ())), "settings.max_displacement");
    let world = repeated();
    assert_eq!(CpuSolver::<f32>::new(&world).map(|_| ()), Ok(()));
}
