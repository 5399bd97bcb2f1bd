//! Random worlds for property tests: any valid world that is small enough to run, and the actions of a host in it.

use pbmpm::{
    Action, Boundary, Collider, DQuat, DVec3, Emitter, Fill, Material, Mesh, Model, Motion, Rate, Region, Scheme,
    ScriptedTool, Shape, Sleep, Spawn, Tool, Wall, World,
};
use proptest::prelude::*;

fn log(lo: f64, hi: f64) -> impl Strategy<Value = f64> {
    (lo.log10()..hi.log10()).prop_map(move |x| 10f64.powf(x).clamp(lo, hi))
}

fn vector(size: f64) -> impl Strategy<Value = DVec3> {
    [-size..size, -size..size, -size..size].prop_map(DVec3::from_array)
}

/// A position as a share of the domain, up to `beyond` outside of it.
fn share(beyond: f64) -> impl Strategy<Value = DVec3> {
    let axis = || -beyond..1.0 + beyond;
    [axis(), axis(), axis()].prop_map(DVec3::from_array)
}

fn rotation() -> impl Strategy<Value = DQuat> {
    vector(3.0).prop_map(DQuat::from_scaled_axis)
}

fn wall() -> impl Strategy<Value = Wall> {
    prop_oneof![Just(Wall::Slip), Just(Wall::Stick), Just(Wall::Open), (0.0..10.0).prop_map(Wall::Friction)]
}

fn boundary() -> impl Strategy<Value = Boundary> {
    prop_oneof![
        Just(Boundary::Slip),
        Just(Boundary::Stick),
        Just(Boundary::Fixed),
        (0.0..10.0).prop_map(Boundary::Friction)
    ]
}

fn model() -> impl Strategy<Value = Model> {
    prop_oneof![
        Just(Model::Liquid),
        (0.0..=1.0).prop_map(|shape_weight| Model::Elastic { shape_weight }),
        (0.0..=60.0).prop_map(|friction_angle| Model::Sand { friction_angle }),
        (0.0..=2.0).prop_map(|yield_strain| Model::Viscoplastic { yield_strain }),
    ]
}

/// Moduli as squares of the cells that sound travels per step, viscosity as the share of a shear rate that a step
/// removes; they are scaled afterwards.
fn material() -> impl Strategy<Value = Material> {
    let stresses = (log(1e-6, 1e6), log(1e-6, 1e3), 0.0..0.499, prop_oneof![Just(0.0), log(1e-3, 10.0)]);
    let yields = prop::option::of(log(1e-6, 1.0));
    (model(), log(1e-3, 1e5), 0.0..1.9, 0.0..1.0, stresses, yields).prop_map(
        |(model, rest_density, relaxation, viscous_relaxation, stresses, yield_stress)| {
            let (bulk_modulus, youngs_modulus, poisson_ratio, viscosity) = stresses;
            Material {
                model,
                rest_density,
                relaxation,
                viscous_relaxation,
                bulk_modulus,
                youngs_modulus,
                poisson_ratio,
                viscosity,
                yield_stress,
                ..Material::liquid("")
            }
        },
    )
}

/// Lengths in cells, for a domain of 1; they are scaled afterwards.
fn shape(largest: f64) -> impl Strategy<Value = Shape> {
    let edge = || 0.05..largest;
    prop_oneof![
        [edge(), edge(), edge()].prop_map(|half| Shape::Box { half_size: DVec3::from_array(half) }),
        edge().prop_map(|radius| Shape::Sphere { radius }),
        // No longer than a box, measured from its middle.
        [edge(), edge()].prop_map(|[r, h]| Shape::Capsule { radius: 0.5 * r, half_height: 0.5 * h }),
        [edge(), edge()].prop_map(|[radius, half_height]| Shape::Cylinder { radius, half_height }),
        [0.25..1.0, 0.25..1.0, 0.25..1.0].prop_map(move |half| gem(DVec3::from_array(half) * largest, largest / 12.0)),
    ]
}

/// An octahedron with these half axes.
fn gem(half: DVec3, grid_spacing: f64) -> Shape {
    let tips = DVec3::AXES.iter().flat_map(|axis| [*axis * half, *axis * -half]).collect();
    let faces = (0..8u32).map(|i| {
        let [a, b, c] = [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1)];
        if i.count_ones() % 2 == 0 { [a, b, c] } else { [a, c, b] }
    });
    Shape::Mesh(Mesh::new(tips, faces.collect(), grid_spacing).expect("a mesh"))
}

fn scaled(shape: Shape, cell: f64) -> Shape {
    match shape {
        Shape::Box { half_size } => Shape::Box { half_size: half_size * cell },
        Shape::Sphere { radius } => Shape::Sphere { radius: radius * cell },
        Shape::Capsule { radius: r, half_height: h } => Shape::Capsule { radius: r * cell, half_height: h * cell },
        Shape::Cylinder { radius: r, half_height: h } => Shape::Cylinder { radius: r * cell, half_height: h * cell },
        Shape::Mesh(mesh) => {
            let grid_spacing = mesh.grid_spacing().expect("it is built") * cell;
            let vertices = mesh.vertices().iter().map(|v| *v * cell).collect();
            Shape::Mesh(Mesh::new(vertices, mesh.triangles().to_vec(), grid_spacing).expect("a mesh"))
        }
        other => other,
    }
}

/// Whether a shape is inverted: one in four is, if that leaves little of a world.
fn inverted() -> impl Strategy<Value = bool> {
    prop::bool::weighted(0.25)
}

fn spawn() -> impl Strategy<Value = (Spawn, usize)> {
    let fill = prop_oneof![(0.05..20.0).prop_map(Fill::PerCell), (0.3..2.0).prop_map(Fill::Spacing),];
    (shape(1.5), share(0.0), rotation(), fill, vector(6.0), 0.0..0.5, any::<u64>(), 0usize..4).prop_map(
        |(shape, position, rotation, fill, velocity, jitter, seed, material)| {
            let any = Spawn::cuboid("", DVec3::ZERO, DVec3::ONE);
            (Spawn { shape, position, rotation, fill, velocity, jitter, seed, ..any }, material)
        },
    )
}

/// Times in steps, lengths in cells.
fn motion() -> impl Strategy<Value = Motion> {
    let key = || (1.1..4.0, vector(4.0), rotation());
    prop_oneof![
        (vector(3.0), vector(1.8))
            .prop_map(|(linear_velocity, angular_velocity)| Motion::Steady { linear_velocity, angular_velocity }),
        (vector(3.0), 0.0..0.2, -1.0..1.0, vector(1.1)).prop_map(|(amplitude, frequency, phase, angular_amplitude)| {
            Motion::Oscillate { amplitude, frequency, phase, angular_amplitude }
        }),
        (prop::collection::vec(key(), 1..5), any::<bool>(), any::<bool>()).prop_map(|(keys, turns, repeat)| {
            let times = keys.iter().scan(-3.0, |time, key| {
                *time += key.0;
                Some(*time)
            });
            let (times, repeat) = (times.collect(), repeat && keys.len() > 1);
            let mut positions: Vec<_> = keys.iter().map(|key| key.1).collect();
            let mut rotations: Vec<_> = keys.iter().filter(|_| turns).map(|key| key.2).collect();
            if let (true, [first, .., last]) = (repeat, &mut positions[..]) {
                *last = *first;
            }
            if let (true, [first, .., last]) = (repeat, &mut rotations[..]) {
                *last = *first;
            }
            Motion::Keyframes { times, positions, rotations, repeat }
        }),
    ]
}

fn collider() -> impl Strategy<Value = Collider> {
    let any_shape = prop_oneof![4 => shape(6.0), 1 => Just(Shape::HalfSpace)];
    let moves = (prop::option::weighted(0.3, motion()), vector(3.0), vector(1.8));
    (any_shape, vector(1.2), rotation(), moves, boundary(), any::<bool>(), any::<bool>()).prop_map(
        |(shape, position, rotation, (motion, linear, angular), boundary, inverted, measure)| {
            let told = if motion.is_some() { DVec3::ZERO } else { DVec3::ONE };
            let (linear_velocity, angular_velocity) = (linear * told, angular * told);
            let any = Collider::new(shape, position);
            Collider { rotation, linear_velocity, angular_velocity, boundary, inverted, measure, motion, ..any }
        },
    )
}

/// Particles per step.
fn rate() -> impl Strategy<Value = Rate> {
    prop_oneof![1 => Just(Rate::Particles(0.0)), 4 => (0.1..12.0).prop_map(Rate::Particles), 3 => (0.1..12.0).prop_map(Rate::Litres)]
}

fn emitter() -> impl Strategy<Value = (Emitter, usize)> {
    let place = (shape(3.0), share(0.1), rotation(), prop::option::of(motion()));
    let when = (0.0..3.0, prop::option::of(0.0..4.0));
    (place, rate(), vector(6.0), log(0.05, 100.0), log(0.01, 100.0), when, any::<u64>(), 0usize..4).prop_map(
        |(
            (shape, position, rotation, motion),
            rate,
            velocity,
            per_cell,
            fill_limit,
            (start, length),
            seed,
            material,
        )| {
            // Half of them from the beginning.
            let start = f64::max(0.0, 2.0 * start - 3.0);
            let end = length.map(|length| start + length);
            let any = Emitter::new("", shape, position, rate);
            (Emitter { rotation, motion, velocity, per_cell, fill_limit, start, end, seed, ..any }, material)
        },
    )
}

fn region() -> impl Strategy<Value = Region> {
    let any_shape = prop_oneof![6 => shape(4.0), 1 => Just(Shape::HalfSpace)];
    (any_shape, share(0.1), rotation(), prop::option::of(motion()), inverted()).prop_map(
        |(shape, position, rotation, motion, inverted)| Region {
            rotation,
            motion,
            inverted,
            ..Region::new(shape, position)
        },
    )
}

fn action() -> impl Strategy<Value = Action> {
    let time = || prop_oneof![1 => Just(0.0), 3 => log(1e-2, 1e3)];
    let turns = prop_oneof![4 => vector(3.0), 1 => vector(2e3)];
    prop_oneof![
        vector(2.0).prop_map(|acceleration| Action::Push { acceleration }),
        (-2.0..2.0).prop_map(|acceleration| Action::Sweep { acceleration }),
        (-2.0..2.0).prop_map(|acceleration| Action::Attract { acceleration }),
        time().prop_map(|time| Action::Grab { time }),
        (turns, time()).prop_map(|(angular_velocity, time)| Action::Stir { angular_velocity, time }),
    ]
}

fn scripted_tool() -> impl Strategy<Value = ScriptedTool> {
    let when = (-1.0..3.0, prop::option::of(0.0..4.0));
    (action(), log(0.01, 30.0), share(0.1), prop::option::of(motion()), when).prop_map(
        |(action, radius, position, motion, (start, length))| {
            let end = length.map(|length| start + length);
            ScriptedTool { motion, start, end, ..ScriptedTool::new(action, radius, position) }
        },
    )
}

fn tool() -> impl Strategy<Value = Tool> {
    (action(), log(0.01, 30.0), share(0.1), vector(3.0)).prop_map(|(action, radius, position, velocity)| Tool {
        action,
        radius,
        position,
        velocity,
    })
}

/// The actions of a host while a world runs.
#[derive(Debug, Clone)]
pub struct Host {
    /// It adds these particles.
    pub spawn: Spawn,
    /// It empties this region.
    pub region: Region,
    /// It gives this rate to every emitter.
    pub rate: Rate,
    /// It wields these tools.
    pub tools: Vec<Tool>,
}

/// Scale in metres and seconds of worlds that are drawn in cells and steps.
struct Scale {
    min: DVec3,
    size: DVec3,
    cell: f64,
    dt: f64,
}

fn limit(v: DVec3, most: f64) -> DVec3 {
    v.clamp(DVec3::splat(-most), DVec3::splat(most))
}

impl Scale {
    /// The position for a share of the domain, `room` cells away from its sides.
    fn place(&self, share: DVec3, room: f64) -> DVec3 {
        let room = DVec3::splat(room * self.cell);
        self.min + room + share * (self.size - room * 2.0)
    }

    fn velocity(&self, v: DVec3) -> DVec3 {
        limit(v * self.cell / self.dt, 1e6)
    }

    fn turning(&self, w: DVec3) -> DVec3 {
        limit(w / self.dt, 5e3).clamp_length_max(3.0 / self.dt)
    }

    fn acceleration(&self, a: DVec3) -> DVec3 {
        limit(a * self.cell / (self.dt * self.dt), 1e6)
    }

    fn material(&self, material: Material) -> Material {
        let pascal = material.rest_density * (self.cell / self.dt).powi(2);
        let modulus = |m: f64| (m * pascal).clamp(1e-3, 1e12);
        Material {
            bulk_modulus: modulus(material.bulk_modulus),
            youngs_modulus: modulus(material.youngs_modulus),
            viscosity: (material.viscosity * pascal * self.dt).min(1e9),
            yield_stress: material.yield_stress.map(modulus),
            ..material
        }
    }

    fn motion(&self, motion: Motion) -> Motion {
        // A length that is covered within a step, below any limit.
        let within_a_step = |v: DVec3| limit(v * self.cell, 1e5 * self.dt);
        match motion {
            Motion::Steady { linear_velocity, angular_velocity } => Motion::Steady {
                linear_velocity: self.velocity(linear_velocity),
                angular_velocity: self.turning(angular_velocity),
            },
            Motion::Oscillate { amplitude, frequency, phase, angular_amplitude } => Motion::Oscillate {
                amplitude: within_a_step(amplitude),
                frequency: (frequency / self.dt).min(1e4),
                phase,
                angular_amplitude,
            },
            Motion::Keyframes { times, positions, rotations, repeat } => Motion::Keyframes {
                times: times.iter().map(|time| time * self.dt).collect(),
                positions: positions.into_iter().map(within_a_step).collect(),
                rotations,
                repeat,
            },
            other => other,
        }
    }

    fn spawn(&self, spawn: Spawn, material: String) -> Spawn {
        Spawn {
            material,
            shape: scaled(spawn.shape, self.cell),
            // Room for a turned box of half edges up to 1.5 and its jitter.
            position: self.place(spawn.position, 3.2),
            velocity: self.velocity(spawn.velocity),
            fill: match spawn.fill {
                Fill::Spacing(s) => Fill::Spacing(s * self.cell),
                other => other,
            },
            ..spawn
        }
    }

    fn collider(&self, collider: Collider) -> Collider {
        Collider {
            shape: scaled(collider.shape, self.cell),
            position: self.min + self.size * 0.5 + collider.position * self.size * 0.5,
            linear_velocity: self.velocity(collider.linear_velocity),
            angular_velocity: self.turning(collider.angular_velocity),
            motion: collider.motion.map(|motion| self.motion(motion)),
            ..collider
        }
    }

    fn rate(&self, rate: Rate, per_cell: f64) -> Rate {
        match rate {
            Rate::Particles(n) => Rate::Particles(n / self.dt),
            Rate::Litres(n) => Rate::Litres((n / self.dt * self.cell.powi(3) / per_cell * 1e3).min(1e12)),
            other => unreachable!("{other:?} is not drawn"),
        }
    }

    fn emitter(&self, emitter: Emitter, material: String) -> Emitter {
        Emitter {
            material,
            shape: scaled(emitter.shape, self.cell),
            position: self.place(emitter.position, 0.0),
            motion: emitter.motion.map(|motion| self.motion(motion)),
            rate: self.rate(emitter.rate, emitter.per_cell),
            velocity: self.velocity(emitter.velocity),
            start: emitter.start * self.dt,
            end: emitter.end.map(|end| end * self.dt),
            ..emitter
        }
    }

    fn region(&self, region: Region) -> Region {
        Region {
            shape: scaled(region.shape, self.cell),
            position: self.place(region.position, 0.0),
            motion: region.motion.map(|motion| self.motion(motion)),
            ..region
        }
    }

    fn action(&self, action: Action) -> Action {
        let along = |acceleration: f64| self.acceleration(DVec3::X * acceleration).x;
        let time = |time: f64| (time * self.dt).min(1e3);
        match action {
            Action::Push { acceleration } => Action::Push { acceleration: self.acceleration(acceleration) },
            Action::Sweep { acceleration } => Action::Sweep { acceleration: along(acceleration) },
            Action::Attract { acceleration } => Action::Attract { acceleration: along(acceleration) },
            Action::Grab { time: t } => Action::Grab { time: time(t) },
            Action::Stir { angular_velocity, time: t } => {
                Action::Stir { angular_velocity: limit(angular_velocity / self.dt, 1e4), time: time(t) }
            }
            other => other,
        }
    }

    fn scripted_tool(&self, tool: ScriptedTool) -> ScriptedTool {
        ScriptedTool {
            action: self.action(tool.action),
            radius: (tool.radius * self.cell).max(1e-6),
            position: self.place(tool.position, 0.0),
            motion: tool.motion.map(|motion| self.motion(motion)),
            start: tool.start * self.dt,
            end: tool.end.map(|end| end * self.dt),
            ..tool
        }
    }

    fn tool(&self, tool: Tool) -> Tool {
        Tool {
            action: self.action(tool.action),
            radius: (tool.radius * self.cell).max(1e-6),
            position: self.place(tool.position, 0.0),
            velocity: self.velocity(tool.velocity),
        }
    }
}

/// Any valid world that is small enough to run for some steps, and the actions of a host meanwhile. Lengths in cells
/// and times in steps are converted to metres and seconds here.
pub fn world() -> impl Strategy<Value = (World, Host)> {
    let domain = (
        log(1e-4, 1e3),
        vector(50.0),
        [7.0..20.0, 7.0..20.0, 7.0..20.0],
        [wall(), wall(), wall(), wall(), wall(), wall()],
    );
    let scheme = prop_oneof![Just(Scheme::Published), Just(Scheme::Implicit), Just(Scheme::Explicit)];
    let iterations = prop_oneof![5 => 1u32..4, 1 => 4u32..24];
    let sleep = prop_oneof![2 => Just(None), 1 => (0.0..1.0, 0.0..5.0).prop_map(Some)];
    let solve = (scheme, iterations, prop_oneof![Just(0.0), log(1e-4, 0.05)], sleep);
    let settings = (log(1e-5, 0.2), solve, 0.5..16.0, log(2.0, 4096.0), log(1e-4, 1e3), 1.0..4.0);
    let matter = (
        prop::collection::vec(material(), 1..4),
        prop::collection::vec(spawn(), 0..4),
        prop::collection::vec(collider(), 0..5),
        prop::collection::vec(emitter(), 0..4),
        (prop::collection::vec(region(), 0..3), prop::collection::vec(region(), 0..3)),
        prop::collection::vec(scripted_tool(), 0..4),
        vector(1.0),
    );
    let host = (spawn(), region(), rate(), prop::collection::vec(tool(), 0..3));
    // Room beyond the spawned particles: none, some, or the default of the world.
    let room = prop_oneof![1 => Just(Some(0)), 2 => (1u32..200).prop_map(Some), 2 => Just(None)];
    (domain, settings, matter, host, room).prop_map(
        |((cell, min, size, w), (dt, solve, displacement, fill, time, tension), matter, host, room)| {
            let (scheme, iterations, tolerance, sleep) = solve;
            let (mut materials, spawns, colliders, emitters, (drains, sensors), tools, gravity) = matter;
            let scale = Scale { min: min * cell, size: DVec3::from_array(size) * cell, cell, dt };
            let mut world = World::new(scale.min, scale.min + scale.size, cell);
            let [x_min, x_max, y_min, y_max, z_min, z_max] = w;
            world.domain.walls = pbmpm::Walls { x_min, x_max, y_min, y_max, z_min, z_max };
            // Gravity adds up to two cells per step in a step, within the limits.
            world.gravity = scale.acceleration(gravity * 2.0);
            for (i, material) in materials.iter_mut().enumerate() {
                *material = Material { name: format!("m{i}"), ..scale.material(material.clone()) };
            }
            let named = |i: usize| materials[i % materials.len()].name.clone();
            world.spawns = spawns.into_iter().map(|(s, material)| scale.spawn(s, named(material))).collect();
            world.colliders = colliders.into_iter().map(|c| scale.collider(c)).collect();
            world.emitters = emitters.into_iter().map(|(e, material)| scale.emitter(e, named(material))).collect();
            world.drains = drains.into_iter().map(|d| scale.region(d)).collect();
            world.sensors = sensors.into_iter().map(|s| scale.region(s)).collect();
            world.tools = tools.into_iter().map(|t| scale.scripted_tool(t)).collect();
            let (spawn, region, rate, tools) = host;
            let host = Host {
                spawn: scale.spawn(spawn.0, named(spawn.1)),
                region: scale.region(region),
                rate: scale.rate(rate, 100.0),
                tools: tools.into_iter().map(|t| scale.tool(t)).collect(),
            };
            world.materials = materials;
            // If materials do not suit the scheme, or are too stiff for the step, the published scheme is used.
            let longest = world.materials.iter().map(|m| m.stable_dt(cell)).fold(f64::INFINITY, f64::min);
            let takes = |m: &Material| scheme.takes(m.model);
            let falls =
                world.gravity.length() * dt * dt / cell <= (0.25 * f64::from(iterations).powi(2)).min(16.0) * 0.999;
            let bears = match scheme {
                Scheme::Published => true,
                Scheme::Implicit => falls,
                Scheme::Explicit => dt <= longest,
            };
            let fits = world.materials.iter().all(takes) && bears;
            let sleep = sleep.map(|(speed, time): (f64, f64)| Sleep {
                speed: (speed * cell / dt).min(100.0),
                time: (time * dt).min(1000.0),
            });
            // Bodies do not feel the weight of sleeping matter.
            world.colliders.iter_mut().for_each(|c| c.measure &= sleep.is_none());
            world.settings = pbmpm::Settings {
                dt,
                sleep,
                scheme: if fits { scheme } else { Scheme::Published },
                iterations,
                tolerance,
                max_displacement: displacement,
                max_fill: fill,
                volume_correction_time: time,
                tension_limit: tension,
                ..pbmpm::Settings::default()
            };
            // Half a minute of emission in steps of microseconds needs more room than a test has.
            let room = room.or(if world.capacity().is_ok_and(|n| n > 20_000) { Some(1000) } else { None });
            world.settings.capacity = room.map(|room| room + world.particle_count().unwrap_or(0) as u32);
            (world, host)
        },
    )
}
