//! Columns at rest.

use super::super::chart::{Chart, Curve};
use super::super::measure::{average, kinetic, mean};
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, G, Matter, Setup, WATER};
use super::{block, hung};
use pbmpm::{Collider, DQuat, DVec3, Material, Result, Shape};

/// Cells across.
const WIDTH: f64 = 16.0;
const THICKNESS: f64 = 4.0;

pub fn h16(setup: &Setup) -> Result<Outcome> {
    water(setup, 16.0, 0.02, 0.003)
}

pub fn h32(setup: &Setup) -> Result<Outcome> {
    water(setup, 32.0, 0.02, 0.003)
}

pub fn h64(setup: &Setup) -> Result<Outcome> {
    water(setup, 64.0, 0.04, 0.005)
}

pub fn h128(setup: &Setup) -> Result<Outcome> {
    water(setup, 128.0, 0.08, 0.01)
}

fn water(setup: &Setup, cells: f64, gate: f64, target: f64) -> Result<Outcome> {
    layers(setup, &[Layer { name: "water", density: 1000.0, cells }], gate, target)
}

/// Spirit on water.
pub fn spirit_on_water(setup: &Setup) -> Result<Outcome> {
    let spirit = Layer { name: "spirit", density: 500.0, cells: 16.0 };
    let water = Layer { name: "water", density: 1000.0, cells: 16.0 };
    layers(setup, &[water, spirit], 0.02, 0.003)
}

/// A liquid, its density in kg/m³ and its height.
struct Layer {
    name: &'static str,
    density: f64,
    cells: f64,
}

/// Liquids, the lowest first, that start uncompressed and at rest; means over the second of two seconds. The wall on
/// their right measures their pressure.
fn layers(setup: &Setup, layers: &[Layer], gate: f64, target: f64) -> Result<Outcome> {
    let dx = DX / setup.refine;
    let cells: f64 = layers.iter().map(|layer| layer.cells).sum();
    let [width, height, depth] = [WIDTH * DX, cells * DX, THICKNESS * dx];
    let mut world = setup.world([width + 2.0 * DX, 1.5 * height, depth], dx);
    let mut top = 0.0;
    for layer in layers {
        let material = setup.material(layer.name, WATER, dx);
        world.materials.push(Material { rest_density: layer.density, ..material });
        let bottom = top;
        top += layer.cells * DX;
        world.spawns.push(block(setup, layer.name, [0.0, bottom, 0.0], [width, top, depth]));
    }
    let mut wall = Collider::new(Shape::HalfSpace, DVec3::new(width, 0.0, 0.0));
    wall.rotation = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    wall.measure = true;
    world.colliders.push(wall);
    let setup = &setup.suited_to(&world);
    world.settings.dt = setup.dt;
    let mut run = Run::new(setup, &world)?;
    let mass = run.state()?.mass_kg;
    let rise = |run: &mut Run| Ok(mean(&run.particles()?, |p| p.position.y));
    let early = run.sample(1.0, 20, rise)?;
    let before = run.solver.loads()?;
    let mut energy = Vec::new();
    let late = run.sample(2.0, 20, |run| {
        let particles = run.particles()?;
        energy.push(kinetic(&particles) / (mass * G * height));
        Ok(mean(&particles, |p| p.position.y))
    })?;
    let load = run.solver.loads()?.mean_since(&before, 0).unwrap_or_default();
    let [force, moment] = on_the_wall(layers, depth);
    let middle = middle(layers);
    let bottom: Vec<_> = run.particles()?.into_iter().filter(|p| p.position.y < 2.0 * dx).collect();
    let loss = 1.0 - average(&late) / middle;
    let name = format!("column of {cells:.0} cells");
    let track = early.iter().chain(&late).map(|(t, y)| (*t, y / middle)).collect();
    Ok(Outcome {
        metrics: vec![
            Metric::zero("height loss", Kind::Exact, loss, gate, target),
            Metric::relative("force on the wall", Kind::Exact, force, load.force.x, 0.05, 0.02),
            Metric::relative("moment on the wall", Kind::Exact, moment, -load.torque.z, 0.1, 0.04),
            Metric::relative(
                "density at the bottom",
                Kind::Exact,
                1.0,
                mean(&bottom, |p| 1.0 / p.volume_ratio),
                0.06,
                0.02,
            ),
            Metric::zero(
                "kinetic energy over m g H",
                Kind::Exact,
                energy.iter().sum::<f64>() / energy.len() as f64,
                1e-3,
                1e-5,
            ),
        ],
        cost: run.cost()?,
        charts: vec![Chart::new(
            name,
            "t, s",
            "height of the centre over its first",
            vec![Curve::line(&setup.preset, track)],
        )],
    })
}

/// Height of the centre of mass at the start, m.
fn middle(layers: &[Layer]) -> f64 {
    let [mut top, mut mass, mut moment] = [0.0; 3];
    for Layer { density, cells, .. } in layers {
        let height = cells * DX;
        mass += density * height;
        moment += density * height * (top + height / 2.0);
        top += height;
    }
    moment / mass
}

/// Force in N and moment about the foot in N m of liquids at rest on a wall.
fn on_the_wall(layers: &[Layer], depth: f64) -> [f64; 2] {
    let mut bottom: f64 = layers.iter().map(|layer| layer.cells * DX).sum();
    let [mut above, mut force, mut moment] = [0.0; 3];
    for layer in layers.iter().rev() {
        let height = layer.cells * DX;
        bottom -= height;
        // The load of what is above is even over the layer, that of its own weight a triangle.
        let even = above * height * depth;
        let triangle = 0.5 * layer.density * G * height * height * depth;
        force += even + triangle;
        moment += even * (bottom + height / 2.0) + triangle * (bottom + height / 3.0);
        above += layer.density * G * height;
    }
    [force, moment]
}

/// A confined column of rubber of 16 cells and 1 m, whose weight is applied over half a second. The modulus for strain
/// in one direction alone is M, the load ρ g H/M = 0.03.
pub fn solid(setup: &Setup) -> Result<Outcome> {
    const HEIGHT: f64 = 1.0;
    let mut outcome = Outcome::default();
    for (poisson, name) in [(0.0, "settlement, Poisson's ratio 0"), (0.3, "settlement, Poisson's ratio 0.3")] {
        let young = 3e5;
        let dx = HEIGHT / 16.0 / setup.refine;
        let side = 4.0 * HEIGHT / 16.0;
        let mut world = setup.world([side, 1.2 * HEIGHT, side], dx);
        world.materials.push(setup.material("rubber", Matter::Rubber { young, poisson }, dx));
        world.spawns.push(block(setup, "rubber", [0.0; 3], [side, HEIGHT, side]));
        world.gravity = DVec3::ZERO;
        let mut run = Run::new(setup, &world)?;
        let rise = |run: &mut Run| Ok(mean(&run.particles()?, |p| p.position.y));
        let start = rise(&mut run)?;
        run.ramp_gravity(DVec3::NEG_Y * G, 0.5)?;
        let settled = start - average(&run.sample(1.5, 60, rise)?);
        let confined = young * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
        let expected = -HEIGHT * hung(-1000.0 * G * HEIGHT / confined);
        outcome.metrics.push(Metric::relative(name, Kind::Exact, expected, settled, 0.1, 0.03));
        outcome.cost.add(run.cost()?);
    }
    Ok(outcome)
}
