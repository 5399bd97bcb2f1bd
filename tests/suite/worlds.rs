//! Small worlds for the tests, and measures of the results.

use pbmpm::{
    Action, Boundary, Collider, DQuat, DVec3, Fate, Fill, Material, Model, Particle, Scheme, ScriptedTool, Settings,
    Shape, Simulate, Sleep, Spawn, Wall, Walls, World,
};

/// Cell size of most test worlds, m.
pub const DX: f64 = 0.02;

/// A domain of this many cells of [`DX`] from the origin, one material, no matter; in the published scheme.
pub fn empty(cells: [f64; 3], walls: Wall) -> World {
    let mut world = World::new(DVec3::ZERO, DVec3::from_array(cells) * DX, DX);
    world.domain.walls = Walls::all(walls);
    world.materials.push(Material::liquid("water"));
    world.settings = Settings { scheme: Scheme::Published, dt: 1.0 / 120.0, ..world.settings };
    world
}

/// A block of `water` between two corners in cells, with a velocity in m/s.
pub fn block(lo: [f64; 3], hi: [f64; 3], velocity: [f64; 3]) -> Spawn {
    let spawn = Spawn::cuboid("water", DVec3::from_array(lo) * DX, DVec3::from_array(hi) * DX);
    Spawn { velocity: DVec3::from_array(velocity), ..spawn }
}

/// `count` particles in a row along x from `first`, in cells, half a cell apart.
pub fn row(first: [f64; 3], count: u32) -> Spawn {
    let spacing = 0.5 * DX;
    let half = DVec3::new(f64::from(count), 1.0, 1.0) * spacing * 0.5;
    let centre = DVec3::from_array(first) * DX + DVec3::X * spacing * 0.5 * f64::from(count - 1);
    Spawn { fill: Fill::Spacing(spacing), ..Spawn::cuboid("water", centre - half, centre + half) }
}

/// One particle at this point in m.
pub fn one(at: DVec3) -> Spawn {
    let half = DVec3::splat(0.25 * DX);
    Spawn { fill: Fill::Spacing(0.5 * DX), ..Spawn::cuboid("water", at - half, at + half) }
}

/// A body at a point in cells; its shape in m.
pub fn body(shape: Shape, at: [f64; 3]) -> Collider {
    Collider::new(shape, DVec3::from_array(at) * DX)
}

/// A box shape with these half edges in cells.
pub fn cuboid(half: [f64; 3]) -> Shape {
    Shape::Box { half_size: DVec3::from_array(half) * DX }
}

/// A ball shape with this radius in cells.
pub fn ball(radius: f64) -> Shape {
    Shape::Sphere { radius: radius * DX }
}

/// A capsule shape along y with this radius and half height in cells.
pub fn capsule(radius: f64, half_height: f64) -> Shape {
    Shape::Capsule { radius: radius * DX, half_height: half_height * DX }
}

/// A cylinder shape along y with this radius and half height in cells.
pub fn cylinder(radius: f64, half_height: f64) -> Shape {
    Shape::Cylinder { radius: radius * DX, half_height: half_height * DX }
}

/// Two liquids that fall on a floor with a turning box and a ball: every feature of a step in 1640 particles.
pub fn busy() -> World {
    let mut world = empty([14.0, 14.0, 14.0], Wall::Slip);
    world.name = "busy".to_owned();
    world.settings.iterations = 2;
    world.domain.walls.y_min = Wall::Friction(0.3);
    world.domain.walls.x_max = Wall::Stick;
    world.materials.push(Material {
        rest_density: 800.0,
        relaxation: 1.2,
        viscous_relaxation: 0.05,
        ..Material::liquid("oil")
    });
    let oil = block([8.0, 6.0, 6.0], [12.0, 10.0, 11.0], [-0.4, 0.0, 0.0]);
    world.spawns = vec![
        block([2.0, 6.0, 2.0], [7.0, 11.0, 7.0], [0.3, -0.4, 0.2]),
        Spawn { material: "oil".to_owned(), jitter: 0.2, ..oil },
    ];
    let mut rotor = body(cuboid([3.0, 1.0, 0.75]), [5.0, 2.0, 5.0]);
    rotor.rotation = DQuat::from_rotation_z(0.2);
    rotor.angular_velocity = DVec3::new(0.0, 6.0, 0.0);
    rotor.boundary = Boundary::Friction(0.5);
    world.colliders = vec![rotor, body(ball(2.0), [10.0, 1.5, 9.0])];
    world
}

/// The first of these, repeated along x and z, on two flush plates that reach past these sides.
pub fn repeated() -> World {
    let mut world = busy();
    world.name = "repeated".to_owned();
    world.domain.max = DVec3::new(16.0, 14.0, 12.0) * DX;
    world.domain.walls = Walls { y_min: Wall::Friction(0.3), ..around(Wall::Periodic) };
    let mut spoon = body(cuboid([2.0, 1.0, 0.75]), [7.0, 2.0, 6.0]);
    spoon.angular_velocity = DVec3::new(0.0, 6.0, 0.0);
    let plate = |x: f64| body(cuboid([6.0, 1.25, 9.0]), [x, 0.0, 6.0]);
    world.colliders = vec![spoon, plate(2.0), plate(14.0)];
    for spawn in &mut world.spawns {
        spawn.velocity *= 4.0;
    }
    world
}

/// Sides of this kind around the vertical axis, with a floor and a ceiling.
pub fn around(wall: Wall) -> Walls {
    Walls { y_min: Wall::Slip, y_max: Wall::Slip, ..Walls::all(wall) }
}

/// The same in the implicit scheme, sooner at the floor, with loads and a tool that stirs.
pub fn flowing() -> World {
    let mut world = busy();
    world.name = "flowing".to_owned();
    world.settings.scheme = Scheme::Implicit;
    world.settings.iterations = 6;
    world.settings.tolerance = 0.02;
    world.materials[1].viscosity = 2.0;
    for spawn in &mut world.spawns {
        spawn.velocity.y = -2.0;
    }
    world.colliders.iter_mut().for_each(|c| c.measure = true);
    let stir = Action::Stir { angular_velocity: DVec3::Y * 5.0, time: 0.1 };
    world.tools.push(ScriptedTool::new(stir, 4.0 * DX, DVec3::new(7.0, 5.0, 7.0) * DX));
    world
}

/// Liquid, rubber, sand and clay thrown at each other over a floor: every model in one grid.
pub fn mixed() -> World {
    let mut world = busy();
    world.name = "mixed".to_owned();
    world.materials.push(Material { relaxation: 1.0, ..Material::elastic("rubber") });
    world.materials.push(Material {
        model: Model::Elastic { shape_weight: 0.3 },
        viscous_relaxation: 0.02,
        relaxation: 1.0,
        ..Material::elastic("jelly")
    });
    world.materials.push(Material { rest_density: 1000.0, relaxation: 1.0, ..Material::sand("sand", 35.0) });
    world.materials.push(Material { relaxation: 1.0, ..Material::viscoplastic("clay", 0.03) });
    let of = |material: &str, lo, hi, velocity| Spawn {
        material: material.to_owned(),
        jitter: 0.1,
        ..block(lo, hi, velocity)
    };
    world.spawns = vec![
        of("water", [1.0, 6.0, 1.0], [4.0, 9.0, 4.0], [0.3, -0.8, 0.2]),
        of("rubber", [6.0, 5.0, 2.0], [9.0, 8.0, 5.0], [0.0, -1.0, 0.4]),
        of("jelly", [2.0, 5.0, 8.0], [5.0, 8.0, 11.0], [0.5, -1.0, -0.4]),
        of("sand", [8.0, 6.0, 8.0], [11.0, 9.0, 11.0], [0.0, -1.0, 0.0]),
        of("clay", [9.0, 9.0, 2.0], [12.0, 12.0, 5.0], [-0.5, -1.5, 0.0]),
    ];
    world
}

/// The same in the explicit scheme, with some viscosity.
pub fn mixed_explicit() -> World {
    let mut world = mixed();
    world.name = "mixed, explicit".to_owned();
    world.settings.scheme = Scheme::Explicit;
    for (name, viscosity) in [("water", 0.1), ("jelly", 5.0)] {
        let viscous = world.materials.iter_mut().filter(|m| m.name == name);
        viscous.for_each(|m| m.viscosity = viscosity);
    }
    for material in world.materials.iter_mut().filter(|m| m.name == "clay") {
        material.yield_stress = Some(300.0);
    }
    world.settings.dt = 0.9 * world.stable_dt();
    world
}

/// The same in the implicit scheme, without sand.
pub fn mixed_implicit() -> World {
    let mut world = mixed_explicit();
    world.name = "mixed, implicit".to_owned();
    world.settings.scheme = Scheme::Implicit;
    world.settings.iterations = 8;
    world.settings.dt = 1.0 / 240.0;
    world.spawns.retain(|s| s.material != "sand");
    world.materials.retain(|m| m.name != "sand");
    world
}

/// Such a world with its rubber in an oblique clamp, and its jelly in one that moves.
pub fn clamped(mut world: World) -> World {
    world.name += ", clamped";
    for (at, angle, speed) in [([7.5, 6.5, 3.5], 0.3, 0.0), ([3.5, 6.6, 9.5], 0.0, 0.2)] {
        let mut clamp = body(cuboid([1.7, 0.8, 2.1]), at);
        clamp.boundary = Boundary::Fixed;
        clamp.rotation = DQuat::from_rotation_z(angle);
        clamp.linear_velocity = DVec3::Y * speed;
        world.colliders.push(clamp);
    }
    world
}

/// Two liquids, one so viscous that its viscosity is solved for, with the stress carried over as first direction.
pub fn thick() -> World {
    let mut world = flowing();
    world.name = "thick".to_owned();
    world.materials[0].viscosity = 450.0;
    world
}

/// All materials that the implicit scheme supports, some of them that viscous.
pub fn mixed_thick() -> World {
    let mut world = mixed_implicit();
    world.name = "mixed, thick".to_owned();
    for (name, viscosity) in [("water", 50.0), ("rubber", 200.0), ("clay", 5.0)] {
        let viscous = world.materials.iter_mut().filter(|m| m.name == name);
        viscous.for_each(|m| m.viscosity = viscosity);
    }
    world
}

/// A trough that is stirred at one end and falls asleep at the other within 15 steps.
pub fn dozing(scheme: Scheme) -> World {
    let mut world = empty([40.0, 12.0, 4.0], Wall::Slip);
    world.name = format!("dozing, {scheme:?}");
    world.settings.scheme = scheme;
    world.settings.dt = 1.0 / 240.0;
    world.settings.iterations = 5;
    world.settings.sleep = Some(Sleep { speed: 0.4, time: 0.06 });
    world.spawns.push(block([0.0, 0.0, 0.0], [40.0, 4.0, 4.0], [0.0; 3]));
    let stir = Action::Stir { angular_velocity: DVec3::Z * 30.0, time: 0.02 };
    world.tools.push(ScriptedTool::new(stir, 3.0 * DX, DVec3::new(4.0, 2.0, 2.0) * DX));
    world
}

/// The thesis' basin with its rotor.
pub fn basin() -> World {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/thesis_basin.json");
    pbmpm::scene::from_file(file).expect("the scene is valid")
}

/// A solver's particles.
pub fn particles(solver: &mut dyn Simulate) -> Vec<Particle> {
    solver.particles().unwrap_or_else(|e| panic!("{e}"))
}

/// The state after this many steps.
pub fn after(solver: &mut dyn Simulate, steps: u32) -> Vec<Particle> {
    solver.steps(steps).unwrap_or_else(|e| panic!("{e}"));
    particles(solver)
}

/// Sums over the particles.
pub fn state(solver: &mut dyn Simulate) -> pbmpm::State {
    solver.state().unwrap_or_else(|e| panic!("{e}"))
}

/// Momentum over mass, m/s.
pub fn mean_velocity(solver: &mut dyn Simulate) -> DVec3 {
    let now = state(solver);
    DVec3::from_array(now.momentum) / now.mass_kg
}

/// Counts.
pub fn report(solver: &mut dyn Simulate) -> pbmpm::StepReport {
    solver.report().unwrap_or_else(|e| panic!("{e}"))
}

/// The larger of two numbers; NaN, which `f64::max` drops, if either is.
pub fn larger<T: PartialOrd>(a: T, b: T) -> T {
    if a >= b || a.partial_cmp(&a).is_none() { a } else { b }
}

/// Largest distance between the same particles of two states, m.
pub fn apart(a: &[Particle], b: &[Particle]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.position.distance(b.position)).fold(0.0, larger)
}

/// Fails if a number of a particle is NaN, or if any left except by a drain.
pub fn assert_sound(particles: &[Particle]) {
    for (i, p) in particles.iter().enumerate() {
        let finite = p.position.is_finite() && p.velocity.is_finite() && p.velocity_gradient.is_finite();
        assert!(finite && p.volume_ratio.is_finite(), "particle {i}: {p:?}");
        assert!(matches!(p.fate, Fate::Alive | Fate::Drained | Fate::Vacant), "particle {i}: {p:?}");
    }
}

/// Largest depth of a particle inside the bodies and behind the closed sides, m; negative if all are outside.
pub fn depth(world: &World, solver: &mut dyn Simulate) -> f64 {
    let poses = solver.poses().to_vec();
    let mut deepest = f64::NEG_INFINITY;
    for p in particles(solver).iter().filter(|p| p.fate == Fate::Alive) {
        for (collider, pose) in world.colliders.iter().zip(&poses) {
            let local = pose.rotation.inverse() * (p.position - pose.position);
            deepest = deepest.max(-collider.signed_distance(local));
        }
        let outside = (world.domain.min - p.position).max(p.position - world.domain.max);
        deepest = deepest.max(outside.max_element());
    }
    deepest
}
