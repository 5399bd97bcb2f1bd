//! The measured worlds.

use pbmpm::{
    Action, Collider, DVec3, Emitter, Fill, Material, Quality, Rate, Region, Scheme, ScriptedTool, Shape, Sleep, Spawn,
    UVec3, World,
};
use std::path::Path;

/// The thesis' basin, with this many particles along each axis of both blocks and cells of `cell_size` m.
pub fn basin(per_axis: u32, iterations: u32, cell_size: f64, hertz: f64) -> World {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/thesis_basin.json");
    let mut world = pbmpm::scene::from_file(&path).unwrap_or_else(|error| panic!("{error}"));
    world.spawns.iter_mut().for_each(|spawn| spawn.fill = Fill::Inclusive(UVec3::splat(per_axis)));
    world.domain.cell_size = cell_size;
    world.settings.iterations = iterations;
    world.settings.dt = 1.0 / hertz;
    world
}

/// The baseline of the thesis' sweeps.
pub fn baseline() -> World {
    basin(25, 1, 1.0, 30.0)
}

/// The same with higher walls, a rotor that turns a third as fast, and matter that hardly falls, so that none gets over
/// the walls or near the roof: objects there cannot matter.
pub fn calm() -> World {
    let mut world = baseline();
    world.spawns.iter_mut().for_each(|spawn| spawn.position.y = 9.5);
    for collider in &mut world.colliders {
        match &mut collider.shape {
            Shape::Box { half_size } if collider.name.starts_with("wall") => {
                half_size.z += 20.0;
                collider.position.y += 20.0;
            }
            _ => collider.angular_velocity /= 3.0,
        }
    }
    world
}

/// Steps after which the calm basin is calm.
pub const CALM: u32 = 400;

/// A cubic metre of matter that collapses in a box of two, with 8 particles per cell. Steps are proportional to the
/// cells, so that stiffness does not depend on their number.
pub fn plain_box(particles: f64, material: Material) -> World {
    let cells = (particles / 8.0).cbrt();
    let mut world = World::new(DVec3::ZERO, DVec3::new(2.0, 1.5, 1.0), 1.0 / cells);
    world.name = "plain box".to_owned();
    world.spawns.push(Spawn::cuboid(material.name.clone(), DVec3::ZERO, DVec3::ONE));
    world.materials.push(material);
    world.settings.scheme = Scheme::Published;
    world.settings.dt = 1.0 / (12.0 * cells);
    world
}

/// The same with water and the settings of `realtime`.
pub fn realtime(particles: f64) -> World {
    let mut world = plain_box(particles, Material::liquid("water"));
    world.settings = Quality::Realtime.settings(&world);
    world
}

/// The calm basin in a domain ten times as large along each axis. Its lower corner stays, so that positions in cells
/// are the same numbers.
pub fn vast() -> World {
    let mut world = calm();
    world.domain.max = world.domain.min + (world.domain.max - world.domain.min) * 10.0;
    world
}

/// The calm basin with a material that has no matter.
pub fn with_material(material: Material) -> World {
    let mut world = calm();
    world.materials.push(material);
    world
}

/// The same where a host may add matter of it.
pub fn with_addable(material: Material) -> World {
    let mut world = with_material(material);
    world.settings.capacity = world.particle_count().ok().and_then(|count| u32::try_from(count).ok());
    world
}

/// The calm basin with an emitter that has ended before the measurement.
pub fn with_ended_emitter() -> World {
    let mut world = calm();
    let shape = Shape::Box { half_size: DVec3::ONE };
    let mut emitter = Emitter::new("mint", shape, DVec3::new(0.0, 45.0, 0.0), Rate::Particles(100.0));
    (emitter.start, emitter.end) = (0.0, Some(0.0));
    world.emitters.push(emitter);
    world
}

/// The calm basin with a drain and a sensor that no matter reaches.
pub fn with_regions() -> World {
    let mut world = calm();
    let region = Region::new(Shape::Box { half_size: DVec3::ONE }, DVec3::new(0.0, 45.0, 0.0));
    world.drains.push(region.clone());
    world.sensors.push(region);
    world
}

/// The calm basin with 256 boxes under its roof, where no matter is.
pub fn with_boxes() -> World {
    let mut world = calm();
    for i in 0..256 {
        let (x, z) = (f64::from(i % 16), f64::from(i / 16));
        let position = DVec3::new(-22.0 + 2.9 * x, 48.0, -22.0 + 2.9 * z);
        world.colliders.push(Collider::new(Shape::Box { half_size: DVec3::ONE }, position));
    }
    world
}

/// The calm basin, with loads measured on all bodies.
pub fn with_loads() -> World {
    let mut world = calm();
    world.colliders.iter_mut().for_each(|collider| collider.measure = true);
    world
}

/// 32,768 particles of water in the implicit scheme: a standing column or a falling cube.
pub fn implicit(falls: bool, tolerance: f64) -> World {
    let size = if falls { DVec3::new(1.0, 4.0, 1.0) } else { DVec3::new(0.32, 0.64, 0.32) };
    let corner = if falls { DVec3::new(0.34, 3.5, 0.34) } else { DVec3::ZERO };
    let mut world = World::new(DVec3::ZERO, size, 0.02);
    world.materials.push(Material::liquid("water"));
    world.spawns.push(Spawn::cuboid("water", corner, corner + DVec3::splat(0.32)));
    world.settings.scheme = Scheme::Implicit;
    world.settings.dt = 1.0 / 300.0;
    world.settings.iterations = 8;
    world.settings.tolerance = tolerance;
    world
}

/// A pool of 100,000 particles on 50 by 5 by 50 cells of 5 cm; one corner may be stirred from step [`STIRRED`] on. With
/// `sleep`, matter sleeps where all is slower than 5 cm/s for half a second.
pub fn pool(stirred: bool, sleep: bool) -> World {
    const CELL: f64 = 0.05;
    let mut world = World::new(DVec3::ZERO, DVec3::new(50.0, 14.0, 50.0) * CELL, CELL);
    world.name = "pool".to_owned();
    world.materials.push(Material::liquid("water"));
    world.spawns.push(Spawn::cuboid("water", DVec3::ZERO, DVec3::new(50.0, 5.0, 50.0) * CELL));
    world.settings = Quality::Realtime.settings(&world);
    if stirred {
        let stir = Action::Stir { angular_velocity: DVec3::Y * 10.0, time: 0.05 };
        let start = f64::from(STIRRED) * world.settings.dt;
        world.tools.push(ScriptedTool { start, ..ScriptedTool::new(stir, 3.0 * CELL, DVec3::splat(3.0 * CELL)) });
    }
    world.settings.sleep = sleep.then_some(Sleep { speed: 0.05, time: 0.5 });
    world
}

/// Steps after which the pool sleeps, and its corner is stirred.
pub const STIRRED: u32 = 220;
