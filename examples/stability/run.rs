//! A point's world, and its verdict.

use crate::sweep::{Case, Matter, Point, Scheme};
use pbmpm::{Collider, CpuSolver, DVec3, Fate, Fill, Material, Model, Motion, Particle, Shape, Simulate, Spawn, World};
use serde::{Deserialize, Serialize};

/// From best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    Refused,
    Stable,
    Collapsed,
    Growing,
    Tunnelled,
    NotFinite,
    Stopped,
}

impl Verdict {
    pub const ALL: [Verdict; 7] = [
        Verdict::Refused,
        Verdict::Stable,
        Verdict::Collapsed,
        Verdict::Growing,
        Verdict::Tunnelled,
        Verdict::NotFinite,
        Verdict::Stopped,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Verdict::Refused => "refused",
            Verdict::Stable => "stable",
            Verdict::Collapsed => "collapsed",
            Verdict::Growing => "growing",
            Verdict::Tunnelled => "tunnelled",
            Verdict::NotFinite => "not finite",
            Verdict::Stopped => "stopped",
        }
    }

    /// Whether accepted settings must not end like this.
    pub fn fails(self) -> bool {
        self > Verdict::Collapsed
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Outcome {
    pub verdict: Verdict,
    pub steps: u32,
    /// Largest energy over the energy at the start plus what was put in.
    pub energy: f64,
    /// Height of the middle at the end over that of incompressible matter at rest.
    pub height: f64,
    pub speed_clamped: u64,
    pub gradient_clamped: u64,
    pub saturated_nodes: u64,
}

impl Outcome {
    const REFUSED: Outcome = Outcome {
        verdict: Verdict::Refused,
        steps: 0,
        energy: 0.0,
        height: 0.0,
        speed_clamped: 0,
        gradient_clamped: 0,
        saturated_nodes: 0,
    };
}

const G: f64 = 9.81;
/// Width of the tank, of one with a bowl, and height of the plate's surface, in cells.
const WIDTH: f64 = 4.0;
const ROOM: f64 = 8.0;
const PLATE: f64 = 2.0;
/// Radius of the bowl, cells.
const BOWL: f64 = 3.2;
/// Share of its height to which a block is pressed.
const PRESSED: f64 = 0.65;

/// How a point is judged: over which time and against which values.
pub struct Trial {
    pub world: World,
    /// s
    pub time: f64,
    /// Energy above the plate at the start plus what is put in, J/kg.
    pub given: f64,
    /// Height of the middle at rest, m above the plate; 0 if it is not known.
    height: f64,
}

fn material(point: &Point, name: &str, density: f64) -> Material {
    let model = match point.matter {
        Matter::Elastic => Model::Elastic { shape_weight: 1.0 },
        Matter::Sand => Model::Sand { friction_angle: 35.0 },
        Matter::Clay => Model::Viscoplastic { yield_strain: 0.05 },
        Matter::Liquid | Matter::LightBelow | Matter::LightAbove => Model::Liquid,
    };
    // The published scheme removes a share of the shear rate in each iteration.
    let share = 8.0 * point.viscosity / (density * point.hertz * point.cell_size.powi(2) * f64::from(point.iterations));
    Material {
        model,
        rest_density: density,
        relaxation: point.relaxation,
        viscous_relaxation: share.min(1.0),
        youngs_modulus: point.youngs_modulus,
        poisson_ratio: point.poisson_ratio,
        viscosity: point.viscosity,
        yield_stress: Some(point.yield_stress),
        ..Material::liquid(name)
    }
}

/// A box of matter with these corners, in cells.
fn block(point: &Point, name: &str, lo: [f64; 3], hi: [f64; 3]) -> Spawn {
    let cells = |corner: [f64; 3]| DVec3::from_array(corner) * point.cell_size;
    let fill = Fill::PerCell(point.per_cell);
    Spawn { fill, jitter: 0.2, ..Spawn::cuboid(name, cells(lo), cells(hi)) }
}

pub fn trial(point: &Point) -> Trial {
    let dx = point.cell_size;
    let width = if point.case == Case::Bowl { ROOM } else { WIDTH };
    let size = DVec3::new(width, 14.0, width) * dx;
    let mut world = World::new(DVec3::ZERO, size, dx);
    world.settings.dt = 1.0 / point.hertz;
    world.settings.scheme = point.scheme.engine();
    world.settings.iterations = point.iterations;
    world.settings.tolerance = point.tolerance;
    world.settings.sharpen = true;
    world.settings.block_pressure = true;
    let plate = |y: f64| {
        let half_size = DVec3::new(width, 1.0, width) * dx;
        Collider::new(Shape::Box { half_size }, DVec3::new(0.5 * width, y, 0.5 * width) * dx)
    };
    world.colliders.push(plate(PLATE - 1.0));
    // As large as fits some hundred particles.
    let edge = (300.0 / point.per_cell).cbrt().min(2.5);
    let (near, far) = (0.5 * (WIDTH - edge), 0.5 * (WIDTH + edge));
    let mut height = 0.0;
    let mut push = 0.0;
    let speed = 10.0 * (G * dx).sqrt();
    match (point.matter, point.case) {
        (Matter::LightBelow | Matter::LightAbove, _) => {
            let (light, heavy) = ("light", "heavy");
            world.materials =
                vec![material(point, light, 1000.0), material(point, heavy, 1000.0 * point.density_ratio)];
            let [below, above] = if point.matter == Matter::LightBelow { [light, heavy] } else { [heavy, light] };
            world.spawns.push(block(point, below, [0.0, PLATE, 0.0], [WIDTH, PLATE + 1.25, WIDTH]));
            world.spawns.push(block(point, above, [0.0, PLATE + 1.25, 0.0], [WIDTH, PLATE + 2.5, WIDTH]));
        }
        (_, Case::Rest) => {
            world.materials.push(material(point, "matter", 1000.0));
            let (lo, hi) = if point.per_cell > 27.0 { (near, far) } else { (0.0, WIDTH) };
            world.spawns.push(block(point, "matter", [lo, PLATE, lo], [hi, PLATE + edge, hi]));
            let share = ((hi - lo) / WIDTH).powi(2);
            height = 0.5 * edge * dx * share;
        }
        (_, Case::Bowl) => {
            world.materials.push(material(point, "matter", 1000.0));
            world.spawns.push(block(point, "matter", [0.0, PLATE, 0.0], [ROOM, PLATE + BOWL, ROOM]));
            let centre = DVec3::new(0.5 * ROOM, PLATE + BOWL, 0.5 * ROOM) * dx;
            let bowl = Collider::new(Shape::Sphere { radius: BOWL * dx }, centre);
            world.colliders.push(Collider { inverted: true, ..bowl });
            height = 0.625 * BOWL * dx;
        }
        (_, Case::Impact) => {
            world.materials.push(material(point, "matter", 1000.0));
            let thrown = block(point, "matter", [near, PLATE + 3.0, near], [far, PLATE + 3.0 + edge, far]);
            world.spawns.push(Spawn { velocity: DVec3::NEG_Y * speed, ..thrown });
        }
        (_, Case::Press) => {
            world.materials.push(material(point, "matter", 1000.0));
            world.spawns.push(block(point, "matter", [near, PLATE, near], [far, PLATE + edge, far]));
            // At a tenth of that speed, but in at least three steps.
            let way = (1.0 - PRESSED) * edge * dx;
            let time = (way / (0.1 * speed)).max(3.0 / point.hertz);
            let positions = [0.0, -way, -way, 4.0 * dx].map(|y| DVec3::Y * y).to_vec();
            let times = vec![0.0, time, 2.0 * time, 4.0 * time];
            let motion = Motion::Keyframes { times, positions, rotations: Vec::new(), repeat: false };
            world.colliders.push(Collider { motion: Some(motion), ..plate(PLATE + edge + 1.0) });
            push = 0.5 * (2.0 * 4.0 * dx / time).powi(2) + stored(point, &world);
        }
    }
    // As `Quality` does: thick matter is stopped in one step.
    if point.map == "viscosity" && point.scheme == Scheme::Implicit {
        world.settings.iterations = point.iterations.max(world.viscous_iterations(world.settings.dt));
    }
    let fall = (8.0 * dx / G).sqrt();
    let steps = (4.0 * fall * point.hertz).clamp(40.0, 600.0).ceil();
    Trial { time: steps / point.hertz, given: push, height, world }
}

/// Energy of a pressed block, J/kg, with the stiffness that a step accounts for. Local strains may be twice the mean.
fn stored(point: &Point, world: &World) -> f64 {
    let strain = 2.0 * (1.0 / PRESSED).ln();
    let dt = world.settings.dt;
    let cells_per_step = point.cell_size / dt;
    let published = 0.25 * f64::from(point.iterations) * point.relaxation * cells_per_step.powi(2);
    // Sound travels half a cell in the longest explicit step.
    let stated = (0.5 * point.cell_size / world.stable_dt()).powi(2);
    let (longest, _) = world.followed_dt(dt);
    match point.scheme.engine() {
        pbmpm::Scheme::Published => 0.5 * published * strain * strain,
        _ => 0.5 * stated * (longest / dt).min(1.0).powi(2) * strain * strain,
    }
}

/// Energy above the plate, J/kg, and height of the middle above it, m; `None` if there is nothing.
pub fn measure(particles: &[Particle], plate: f64) -> Option<(f64, f64)> {
    let mass: f64 = particles.iter().map(|p| p.mass).sum();
    let mean = |of: &dyn Fn(&Particle) -> f64| particles.iter().map(|p| p.mass * of(p)).sum::<f64>() / mass;
    let height = mean(&|p| p.position.y) - plate;
    let energy = mean(&|p| 0.5 * p.velocity.length_squared()) + G * height;
    (mass > 0.0).then_some((energy, height))
}

/// Steps the point's world and judges it.
pub fn run(point: &Point) -> Outcome {
    let Trial { world, time, given, height } = trial(point);
    let Ok(mut solver) = CpuSolver::<f32>::new(&world) else { return Outcome::REFUSED };
    let plate = PLATE * point.cell_size;
    let mut outcome = Outcome { verdict: Verdict::Stable, ..Outcome::REFUSED };
    let steps = (time * point.hertz).round() as u32;
    let mut most = 0.0;
    for part in 0..=20 {
        let (Ok(particles), Ok(report)) = (solver.particles(), solver.report()) else {
            return Outcome { verdict: Verdict::Stopped, ..outcome };
        };
        let finite = |p: &Particle| p.position.is_finite() && p.velocity.is_finite() && p.volume_ratio.is_finite();
        let Some((energy, middle)) = measure(&particles, plate).filter(|_| particles.iter().all(finite)) else {
            return Outcome { verdict: Verdict::NotFinite, ..outcome };
        };
        let through = |p: &Particle| p.fate != Fate::Alive || p.position.y < plate - 0.5 * point.cell_size;
        if particles.iter().any(through) {
            return Outcome { verdict: Verdict::Tunnelled, ..outcome };
        }
        if part == 0 {
            // A fall by half a cell more, since contact happens at the nodes, and a twentieth for rounding.
            most = 1.05 * energy + given + 0.5 * G * point.cell_size;
        }
        outcome.energy = f64::max(outcome.energy, energy / most);
        outcome.steps = report.step as u32;
        outcome.speed_clamped = report.faults.speed_clamped;
        outcome.gradient_clamped = report.faults.gradient_clamped;
        outcome.saturated_nodes = report.faults.saturated_nodes;
        if part == 20 && height > 0.0 {
            outcome.height = middle / height;
        }
        let next = steps * (part + 1) / 20;
        if part < 20 && solver.steps(next.saturating_sub(outcome.steps)).is_err() {
            return Outcome { verdict: Verdict::Stopped, ..outcome };
        }
    }
    if outcome.energy > 1.0 {
        outcome.verdict = Verdict::Growing;
    } else if height > 0.0 && outcome.height < 0.5 {
        outcome.verdict = Verdict::Collapsed;
    }
    outcome
}
