//! A draining tank.

use super::super::chart::{Chart, Curve};
use super::super::measure::line;
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, G, Setup, WATER};
use super::block;
use pbmpm::{Collider, DVec3, Region, Result, Shape};

/// A plane tank of 32 by 40 cells with a sharp slot of 6 cells in its floor: √h falls linearly, by C √(g/2) times the
/// share of the slot in the floor. Potential flow through a slot has C = π/(π + 2).
pub fn torricelli(setup: &Setup) -> Result<Outcome> {
    const WIDE: f64 = 32.0 * DX;
    const HEAD: f64 = 40.0 * DX;
    const SLOT: f64 = 6.0 * DX;
    const BELOW: f64 = 24.0 * DX;
    let dx = DX / setup.refine;
    let thick = 4.0 * dx;
    let mut world = setup.world([WIDE, BELOW + 1.2 * HEAD, thick], dx);
    world.materials.push(setup.material("water", WATER, dx));
    world.spawns.push(block(setup, "water", [0.0, BELOW, 0.0], [WIDE, BELOW + HEAD, thick]));
    let plate = DVec3::new(0.25 * (WIDE - SLOT), 2.0 * DX, 2.0 * thick);
    for x in [plate.x, WIDE - plate.x] {
        let at = DVec3::new(x, BELOW - plate.y, 0.5 * thick);
        world.colliders.push(Collider::new(Shape::Box { half_size: plate }, at));
    }
    let drain = Shape::Box { half_size: DVec3::new(WIDE, 4.0 * DX, WIDE) };
    world.drains.push(Region::new(drain, DVec3::ZERO));
    let mut run = Run::new(setup, &world)?;
    // The matter above the floor, as a depth at rest.
    let head = |run: &mut Run| -> Result<f64> {
        let inside = run.particles()?.into_iter().filter(|p| p.position.y > BELOW).map(|p| p.mass).sum::<f64>();
        Ok(inside / (1000.0 * WIDE * thick))
    };
    run.to(0.3)?;
    let roots = run.sample(1.3, 40, |run| Ok(head(run)?.sqrt()))?;
    let (_, slope, straight) = line(&roots);
    let coefficient = -slope / (0.5 * G).sqrt() * WIDE / SLOT;
    let exact = std::f64::consts::PI / (std::f64::consts::PI + 2.0);
    Ok(Outcome {
        metrics: vec![
            Metric::relative("coefficient of discharge", Kind::Exact, exact, coefficient, 0.15, 0.07),
            Metric::zero("root of the head off a line", Kind::Exact, 1.0 - straight, 5e-3, 1e-3),
        ],
        cost: run.cost()?,
        charts: vec![Chart::new("draining tank", "t, s", "root of the head", vec![Curve::line(&setup.preset, roots)])],
    })
}
