//! Viscous flow between parallel plates, without ends.

use super::super::chart::{Chart, Curve};
use super::super::measure::rms;
use super::super::outcome::{Kind, Metric, Outcome};
use super::super::run::Run;
use super::super::setup::{DX, Matter, Setup};
use super::block;
use pbmpm::{Boundary, Collider, DVec3, Result, Shape, Wall};
use std::f64::consts::PI;

/// Distance of the plates, 16 cells, m.
const HEIGHT: f64 = 16.0 * DX;
/// Speed of the upper plate, or of the middle, once the flow is steady, m/s.
const SPEED: f64 = 0.5;
/// m²/s. 8νΔt/Δx² is below 1 at 300 Hz, and the Reynolds number is 16.
const VISCOSITY: f64 = 0.01;
/// Times at which the profile is looked at, over h²/ν: while the flow starts, and when less than a hundredth is missing.
const LOOKS: [f64; 2] = [0.1, 0.5];

/// What drives the flow, from rest on.
#[derive(Clone, Copy)]
enum Driven {
    /// The upper plate, which moves (Couette).
    ByPlate,
    /// Gravity along the plates (Poiseuille).
    ByGravity,
}

impl Driven {
    /// Speed at this share of the height in m/s, t seconds after the start, of a liquid with this share of
    /// [`VISCOSITY`] (Batchelor, An Introduction to Fluid Dynamics, sections 4.2 and 4.3).
    fn speed(self, y: f64, t: f64, share: f64) -> f64 {
        let time = share * VISCOSITY * t / (HEIGHT * HEIGHT);
        let mode = |n: u32| {
            let k = f64::from(n) * PI;
            (-k * k * time).exp() * (k * y).sin() / k
        };
        match self {
            Driven::ByPlate => {
                SPEED * (y + (1..20).map(|n| if n % 2 == 0 { 2.0 } else { -2.0 } * mode(n)).sum::<f64>())
            }
            Driven::ByGravity => {
                let lacks = (1..20).step_by(2).map(|n| 4.0 * mode(n) / (f64::from(n) * PI).powi(2)).sum::<f64>();
                8.0 * SPEED / share * (0.5 * y * (1.0 - y) - lacks)
            }
        }
    }
}

/// A place in the channel as a share of its height, the time in s and the speed there in m/s.
type Sample = [f64; 3];

/// The flow at each of the times, 12 cells of it, which repeat.
fn flow(setup: &Setup, driven: Driven, outcome: &mut Outcome) -> Result<[Vec<Sample>; 2]> {
    let dx = DX / setup.refine;
    let (long, thick, plate) = (12.0 * dx, 4.0 * dx, 2.0 * dx);
    let mut world = setup.world([long, HEIGHT + plate, thick], dx);
    let walls = &mut world.domain.walls;
    (walls.x_min, walls.x_max, walls.y_min) = (Wall::Periodic, Wall::Periodic, Wall::Stick);
    world.gravity = DVec3::ZERO;
    world.materials.push(setup.material("oil", Matter::Water { viscosity: VISCOSITY }, dx));
    world.spawns.push(block(setup, "oil", [0.0; 3], [long, HEIGHT, thick]));
    // So long that the liquid never sees its ends.
    let half_size = DVec3::new(100.0, 0.5 * plate, thick);
    let upper = Collider::new(Shape::Box { half_size }, DVec3::new(0.0, HEIGHT + 0.5 * plate, 0.5 * thick));
    let mut upper = Collider { boundary: Boundary::Stick, ..upper };
    match driven {
        Driven::ByPlate => upper.linear_velocity = DVec3::X * SPEED,
        Driven::ByGravity => world.gravity = DVec3::X * (8.0 * VISCOSITY * SPEED / (HEIGHT * HEIGHT)),
    }
    world.colliders.push(upper);
    let mut run = Run::new(setup, &world)?;
    let mut samples = [const { Vec::new() }; 2];
    for (samples, look) in samples.iter_mut().zip(LOOKS) {
        run.to(look * HEIGHT * HEIGHT / VISCOSITY)?;
        let t = run.time();
        *samples = run.particles()?.iter().map(|p| [p.position.y / HEIGHT, t, p.velocity.x]).collect();
    }
    outcome.cost.add(run.cost()?);
    Ok(samples)
}

/// By how much samples differ from the flow of a liquid with this share of the viscosity, as a share of its speed.
fn off(samples: &[Sample], driven: Driven, share: f64) -> f64 {
    rms(samples.iter().map(|[y, t, speed]| (speed - driven.speed(*y, *t, share)) / SPEED))
}

/// The share of the viscosity that suits the samples best, by golden sections.
fn fitted(samples: &[Vec<Sample>; 2], driven: Driven) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let all = samples.concat();
    let (mut low, mut high) = (0.25, 4.0);
    while high - low > 1e-4 {
        let reach = GOLDEN * (high - low);
        if off(&all, driven, high - reach) < off(&all, driven, low + reach) {
            high = low + reach;
        } else {
            low = high - reach;
        }
    }
    0.5 * (low + high)
}

fn profiles(setup: &Setup, driven: Driven, name: &str) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let samples = flow(setup, driven, &mut outcome)?;
    let [starting, steady] = [0, 1].map(|look| off(&samples[look], driven, 1.0));
    outcome.metrics = vec![
        Metric::zero("profile at the start, rms", Kind::Exact, starting, 0.05, 0.02),
        Metric::zero("steady profile, rms", Kind::Exact, steady, 0.05, 0.02),
        Metric::relative("viscosity", Kind::Exact, 1.0, fitted(&samples, driven), 0.1, 0.03),
    ];
    let height = |k: u32| f64::from(k) / 50.0;
    let mut curves = Vec::new();
    for (samples, look) in samples.iter().zip(["start", "end"]) {
        let t = samples.first().map_or(0.0, |sample| sample[1]);
        let exact = (0..=50).map(|k| (height(k), driven.speed(height(k), t, 1.0) / SPEED)).collect();
        curves.push(Curve::line(format!("exact, {look}"), exact));
        // Means of strips.
        let mut strips = vec![(0.0, 0.0, 0.0); 50];
        for [y, _, speed] in samples {
            let strip = &mut strips[((y * 50.0).max(0.0) as usize).min(49)];
            *strip = (strip.0 + 1.0, strip.1 + y, strip.2 + speed / SPEED);
        }
        let found = strips.iter().filter(|s| s.0 > 0.0).map(|(n, y, speed)| (y / n, speed / n)).collect();
        curves.push(Curve::dots(format!("{}, {look}", setup.preset), found));
    }
    outcome.charts = vec![Chart::new(name, "y / height", "speed / fastest", curves)];
    Ok(outcome)
}

pub fn couette(setup: &Setup) -> Result<Outcome> {
    profiles(setup, Driven::ByPlate, "Couette flow from rest on")
}

pub fn poiseuille(setup: &Setup) -> Result<Outcome> {
    profiles(setup, Driven::ByGravity, "Poiseuille flow from rest on")
}

/// How much the viscosity of Poiseuille's flow depends on steps, iterations and cells.
pub fn spread(setup: &Setup) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let driven = Driven::ByGravity;
    let mut share = |setup: &Setup| Ok(fitted(&flow(setup, driven, &mut outcome)?, driven));
    let given = share(setup)?;
    let names = ["viscosity with half the step", "viscosity with twice the iterations", "viscosity on half the cells"];
    let mut metrics = Vec::new();
    for (name, other) in names.into_iter().zip(setup.varied()) {
        metrics.push(Metric::relative(name, Kind::Converged, 1.0, share(&other)? / given, 0.05, 0.01));
    }
    outcome.metrics = metrics;
    Ok(outcome)
}
