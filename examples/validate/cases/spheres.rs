//! A ball in a thick liquid.

use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, Matter, Setup};
use super::block;
use pbmpm::{Boundary, Collider, DVec3, Result, Shape, Spawn};
use std::f64::consts::PI;

/// Drag on a ball, 8 cells across, that moves through the middle of a hollow sphere three times as wide, filled with a
/// liquid so thick that inertia hardly counts (a Reynolds number of 0.3 by its width). Stokes' drag 6π η a u, times what
/// the outer sphere makes of it (Cunningham 1910; Happel and Brenner, Low Reynolds Number Hydrodynamics, chapter 4).
pub fn stokes(setup: &Setup) -> Result<Outcome> {
    const SPEED: f64 = 0.02;
    let dx = DX / setup.refine;
    let (ball, hollow) = (4.0 * DX, 12.0 * DX);
    let viscosity = 0.01;
    let side = 2.0 * hollow + 4.0 * DX;
    let mut world = setup.world([side; 3], dx);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("oil", Matter::Water { viscosity }, dx));
    let centre = DVec3::splat(0.5 * side);
    let sphere =
        |radius: f64| Collider { boundary: Boundary::Stick, ..Collider::new(Shape::Sphere { radius }, centre) };
    // The drag is measured over half a second, from a quarter of a second on, as the ball passes the middle.
    let (settled, end) = (0.25, 0.75);
    let start = centre - DVec3::X * (SPEED * 0.5 * (settled + end));
    world.colliders = vec![
        Collider { measure: true, position: start, linear_velocity: DVec3::X * SPEED, ..sphere(ball) },
        Collider { inverted: true, ..sphere(hollow) },
    ];
    let cube = block(setup, "oil", [0.0; 3], [side; 3]);
    world.spawns.push(Spawn { shape: Shape::Sphere { radius: hollow }, position: centre, ..cube });
    let mut run = Run::new(setup, &world)?;
    run.to(settled)?;
    let before = run.solver.loads()?;
    run.to(end)?;
    let load = run.solver.loads()?.mean_since(&before, 0).unwrap_or_default();
    let ratio = ball / hollow;
    let [cube, fifth] = [3, 5].map(|n| ratio.powi(n));
    let hindered = (1.0 - fifth) / (1.0 - 2.25 * ratio + 2.5 * cube - 2.25 * fifth + ratio.powi(6));
    let drag = 6.0 * PI * 1000.0 * viscosity * ball * SPEED * hindered;
    Ok(Outcome {
        metrics: vec![Metric::relative("drag", Kind::Exact, drag, -load.force.x, 0.15, 0.05)],
        cost: run.cost()?,
        charts: Vec::new(),
    })
}
