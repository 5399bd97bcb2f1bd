//! A world as plain data, in SI units; y is up and axes are right-handed. The same world serves every solver.

use crate::camera::Camera;
use crate::collider::Collider;
use crate::domain::{Domain, Walls};
use crate::emitter::{self, Emitter};
use crate::error::{Check, Result};
use crate::material::Material;
use crate::math::distance_grid::DistanceGrid;
use crate::region::Region;
use crate::settings::Settings;
use crate::shape::Shape;
use crate::spawn::{self, Seed, Spawn};
use crate::tool::{self, ScriptedTool};
use glam::DVec3;
use std::sync::Arc;

mod materials;

/// The most particles a world may hold at a time.
pub const MAX_PARTICLES: u64 = 1 << 26;
/// The most materials in a world.
pub const MAX_MATERIALS: usize = 256;
/// The most colliders in a world.
pub const MAX_COLLIDERS: usize = 4096;
/// The most emitters in a world; likewise the most drains, sensors and tools, and the most regions that a host may empty
/// in a step.
pub const MAX_REGIONS: usize = 256;
/// Without a stated capacity there is room for what emitters emit in this time, s …
const ROOM_FOR_SECONDS: f64 = 30.0;
/// … but for no more particles than this.
const ROOM_FOR_PARTICLES: f64 = (1u64 << 22) as f64;
/// The most different meshes and heightfields among the colliders, drains and sensors of a world; in a scene, among all
/// shapes.
pub const MAX_MESHES: usize = 256;
/// The most points of all their distance grids together, 64 MiB.
pub(crate) const MAX_DISTANCES: usize = 1 << 24;

/// Fails for the first distance grid, naming its shape, that a solver has no room for beside those before it.
pub(crate) fn check_distances<'g>(
    check: &Check<'_>,
    grids: impl Iterator<Item = (String, &'g DistanceGrid)>,
) -> Result<()> {
    let (mut count, mut points) = (0, 0);
    for (name, grid) in grids {
        (count, points) = (count + 1, points + grid.values.len());
        check.that(count <= MAX_MESHES, &name, count, "one of at most 256 different meshes")?;
        let allowed = "within 2^24 points in all distance grids together; a larger grid_spacing has fewer";
        check.that(points <= MAX_DISTANCES, &name, points, allowed)?;
    }
    Ok(())
}

/// All that exists and how it is stepped.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct World {
    /// Title, for people.
    #[cfg_attr(feature = "scene", serde(default))]
    pub name: String,
    /// The box and its grid.
    pub domain: Domain,
    /// Acceleration of free fall, m/s². Default (0, −9.81, 0).
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default = "default_gravity"))]
    pub gravity: DVec3,
    /// What matter is made of; spawns and emitters refer to these by name. A material that none of them names takes no
    /// part and costs nothing, unless [`Settings::capacity`] is stated: then hosts may add particles of it at any time.
    pub materials: Vec<Material>,
    /// Matter at time 0.
    #[cfg_attr(feature = "scene", serde(default))]
    pub spawns: Vec<Spawn>,
    /// Solid bodies.
    #[cfg_attr(feature = "scene", serde(default))]
    pub colliders: Vec<Collider>,
    /// Where matter comes into being.
    #[cfg_attr(feature = "scene", serde(default))]
    pub emitters: Vec<Emitter>,
    /// Where matter ceases to be.
    #[cfg_attr(feature = "scene", serde(default))]
    pub drains: Vec<Region>,
    /// What pushes, attracts, grabs or stirs.
    #[cfg_attr(feature = "scene", serde(default))]
    pub tools: Vec<ScriptedTool>,
    /// Where matter is counted and weighed.
    #[cfg_attr(feature = "scene", serde(default))]
    pub sensors: Vec<Region>,
    /// For pictures; default: an overview of the domain.
    #[cfg_attr(feature = "scene", serde(default))]
    pub camera: Option<Camera>,
    /// Time step, iterations and bounds.
    #[cfg_attr(feature = "scene", serde(default))]
    pub settings: Settings,
}

fn default_gravity() -> DVec3 {
    DVec3::new(0.0, -9.81, 0.0)
}

impl World {
    /// An empty world with slip walls, earth's gravity and [`Settings::default`]. These know nothing of what is in the
    /// world: once that is complete, take those of a [`Quality`](crate::Quality).
    pub fn new(min: DVec3, max: DVec3, cell_size: f64) -> Self {
        World {
            name: String::new(),
            domain: Domain { min, max, cell_size, walls: Walls::default() },
            gravity: default_gravity(),
            materials: Vec::new(),
            spawns: Vec::new(),
            colliders: Vec::new(),
            emitters: Vec::new(),
            drains: Vec::new(),
            sensors: Vec::new(),
            tools: Vec::new(),
            camera: None,
            settings: Settings::default(),
        }
    }

    /// Reads the files that shapes name, relative to `folder`, and builds the meshes' distance grids. Equal meshes are
    /// built once.
    #[cfg(feature = "scene")]
    pub(crate) fn build_meshes(&mut self, folder: Option<&std::path::Path>) -> Result<()> {
        let cell_size = self.domain.cell_size;
        let spawns = self.spawns.iter_mut().enumerate().map(|(i, s)| (format!("spawns[{i}].shape"), &mut s.shape));
        let bodies =
            self.colliders.iter_mut().enumerate().map(|(i, c)| (format!("colliders[{i}].shape"), &mut c.shape));
        let sources = self.emitters.iter_mut().enumerate().map(|(i, e)| (format!("emitters[{i}].shape"), &mut e.shape));
        let drains = self.drains.iter_mut().enumerate().map(|(i, d)| (format!("drains[{i}].shape"), &mut d.shape));
        let sensors = self.sensors.iter_mut().enumerate().map(|(i, s)| (format!("sensors[{i}].shape"), &mut s.shape));
        let mut built: Vec<(Shape, Shape)> = Vec::new();
        let mut points = 0;
        for (path, shape) in spawns.chain(bodies).chain(sources).chain(drains).chain(sensors) {
            if let Some((_, same)) = built.iter().find(|(named, _)| named == shape) {
                *shape = same.clone();
                continue;
            }
            let named = shape.clone();
            if shape.build(&path, folder, cell_size)? {
                let check = Check { path: &path };
                check.that(built.len() < MAX_MESHES, "", built.len() + 1, "one of at most 256 different meshes")?;
                points += shape.grid().map_or(0, |grid| grid.values.len());
                check.that(points <= MAX_DISTANCES, "", points, "within 2^24 points in all distance grids together")?;
                built.push((named, shape.clone()));
            }
        }
        Ok(())
    }

    /// The shapes of colliders, drains and sensors, with the lists that they are in and their places there.
    pub(crate) fn placed_shapes(&self) -> impl Iterator<Item = (&'static str, usize, &Shape)> {
        let bodies = self.colliders.iter().enumerate().map(|(i, c)| ("colliders", i, &c.shape));
        let drains = self.drains.iter().enumerate().map(|(i, d)| ("drains", i, &d.shape));
        bodies.chain(drains).chain(self.sensors.iter().enumerate().map(|(i, s)| ("sensors", i, &s.shape)))
    }

    /// The distance grids of colliders, drains and sensors, in metres, each once.
    pub(crate) fn distance_grids(&self) -> impl Iterator<Item = &DistanceGrid> {
        self.placed_grids().map(|(_, _, grid)| grid)
    }

    /// The same, each with the list and place of the first shape that has it.
    fn placed_grids(&self) -> impl Iterator<Item = (&'static str, usize, &DistanceGrid)> {
        let all = move || self.placed_shapes().filter_map(|(list, i, shape)| Some((list, i, shape.grid()?)));
        let known = move |n: usize, grid: &DistanceGrid| {
            all().take(n).any(|(_, _, before)| Arc::ptr_eq(&before.values, &grid.values))
        };
        all().enumerate().filter(move |(n, (_, _, grid))| !known(*n, grid)).map(|(_, placed)| placed)
    }

    /// Checks every field by itself. [`World::capacity`] and the solvers check what depends on the spawned particles:
    /// whether each spawn makes some, and whether they lie inside the domain and find room.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for the first field that is out of its range.
    pub fn validate(&self) -> Result<()> {
        self.domain.validate("domain")?;
        let top = Check { path: "" };
        top.vector("gravity", self.gravity, 1e6, "finite, at most 1e6 m/s²")?;
        self.settings.validate("settings")?;
        let period = self.domain.period_cells();
        let shortest = period.to_array().into_iter().filter(|length| *length > 0.0).fold(f64::INFINITY, f64::min);
        let most = self.settings.max_displacement;
        let allowed = "at least two cells less than the domain is long between periodic sides";
        Check { path: "settings" }.that(most + 2.0 <= shortest, "max_displacement", most, allowed)?;
        top.that(self.materials.len() <= MAX_MATERIALS, "materials", self.materials.len(), "at most 256 materials")?;
        for (i, material) in self.materials.iter().enumerate() {
            material.validate(&format!("materials[{i}]"))?;
            let first = self.materials.iter().position(|m| m.name == material.name);
            top.that(first == Some(i), &format!("materials[{i}].name"), &material.name, "a name used once")?;
            let solved = self.settings.scheme.takes(material.model) || !self.takes_part(material);
            let allowed = "any but sand where settings.scheme is implicit, which cannot solve it; explicit can";
            top.that(solved, &format!("materials[{i}].model"), material.model, allowed)?;
        }
        self.settings.check_stable(self.taking_part(), self.domain.cell_size, self.gravity)?;
        top.that(self.colliders.len() <= MAX_COLLIDERS, "colliders", self.colliders.len(), "at most 4096 colliders")?;
        for (i, collider) in self.colliders.iter().enumerate() {
            collider.validate(&format!("colliders[{i}]"))?;
            collider.check_turn(&format!("colliders[{i}]"), self.settings.dt)?;
            let felt = !(collider.measure && self.settings.sleep.is_some());
            let allowed = "false where settings.sleep is given: a body does not feel what sleeps on it";
            top.that(felt, &format!("colliders[{i}].measure"), collider.measure, allowed)?;
        }
        top.that(self.emitters.len() <= MAX_REGIONS, "emitters", self.emitters.len(), "at most 256 emitters")?;
        for (i, emitter) in self.emitters.iter().enumerate() {
            emitter.validate(&format!("emitters[{i}]"), self.domain.cell_size)?;
            self.material_index(&format!("emitters[{i}]"), &emitter.material)?;
        }
        emitter::check_sum(self.emitters.iter().map(|e| e.particles_per_second(self.domain.cell_size)))?;
        top.that(self.drains.len() <= MAX_REGIONS, "drains", self.drains.len(), "at most 256 drains")?;
        for (i, drain) in self.drains.iter().enumerate() {
            drain.validate(&format!("drains[{i}]"))?;
        }
        top.that(self.tools.len() <= MAX_REGIONS, "tools", self.tools.len(), "at most 256 tools")?;
        tool::validate_all(&self.tools)?;
        top.that(self.sensors.len() <= MAX_REGIONS, "sensors", self.sensors.len(), "at most 256 sensors")?;
        for (i, sensor) in self.sensors.iter().enumerate() {
            sensor.validate(&format!("sensors[{i}]"))?;
        }
        let grids = self.placed_grids().map(|(list, i, grid)| (format!("{list}[{i}].shape"), grid));
        check_distances(&top, grids)?;
        let mut points = 0u64;
        for (i, spawn) in self.spawns.iter().enumerate() {
            spawn.validate(&format!("spawns[{i}]"))?;
            self.material_index(&format!("spawns[{i}]"), &spawn.material)?;
            points = points.saturating_add(spawn.lattice_points(self.domain.cell_size));
            top.that(points <= MAX_PARTICLES, &format!("spawns[{i}].fill"), points, "at most 2^26 particles in all")?;
        }
        self.camera.map_or(Ok(()), |camera| camera.validate("camera"))
    }

    pub(crate) fn material_index(&self, user: &str, name: &str) -> Result<u32> {
        let index = self.materials.iter().position(|m| m.name == name);
        Check { path: user }.that(index.is_some(), "material", name, "the name of one of `materials`")?;
        Ok(index.unwrap_or(0) as u32)
    }

    /// How many particles there is room for: as stated, or for those spawned and what the emitters emit at first.
    pub(crate) fn room(&self, spawned: usize) -> Result<usize> {
        if let Some(stated) = self.settings.capacity {
            let allowed = format!("at least the {spawned} particles that are spawned, at most 2^26");
            let fits = stated as usize >= spawned && u64::from(stated) <= MAX_PARTICLES;
            Check { path: "settings" }.that(fits, "capacity", stated, &allowed)?;
            return Ok(stated as usize);
        }
        let emitted = |e: &Emitter| {
            let end = e.end.unwrap_or(f64::INFINITY).min(e.start + ROOM_FOR_SECONDS);
            (e.particles_per_second(self.domain.cell_size) * (end - e.start)).ceil()
        };
        let emitted = self.emitters.iter().map(emitted).sum::<f64>().min(ROOM_FOR_PARTICLES);
        Ok((spawned + emitted as usize).min(MAX_PARTICLES as usize))
    }

    /// How many particles the spawns make.
    ///
    /// # Errors
    /// As [`World::validate`], and a spawn that reaches outside the domain or makes no particle.
    pub fn particle_count(&self) -> Result<usize> {
        self.each_seed()?.try_fold(0, |count, seed| seed.map(|_| count + 1))
    }

    /// How many particles there is room for: [`Settings::capacity`], or its default for this world.
    ///
    /// # Errors
    /// As [`World::particle_count`], and a stated capacity below the number of particles that are spawned.
    pub fn capacity(&self) -> Result<usize> {
        self.room(self.particle_count()?)
    }

    /// Every particle of every spawn, in order.
    ///
    /// # Errors
    /// As [`World::capacity`].
    pub(crate) fn seeds(&self) -> Result<Vec<Seed>> {
        let points = self.spawns.iter().map(|spawn| spawn.lattice_points(self.domain.cell_size));
        let most = self.settings.capacity.map_or(usize::MAX, |stated| stated as usize);
        let (seeds, count) = spawn::gathered(self.each_seed()?, points.sum(), most)?;
        self.room(count)?;
        Ok(seeds)
    }

    /// The same, made on demand.
    fn each_seed(&self) -> Result<impl Iterator<Item = Result<Seed>>> {
        self.validate()?;
        let materials = self.spawns.iter().map(|spawn| self.material_index("spawns", &spawn.material));
        let materials = materials.collect::<Result<Vec<_>>>()?;
        Ok(self.spawns.iter().zip(materials).enumerate().flat_map(move |(i, (spawn, material))| {
            let bodies = self.colliders.iter().map(|body| (body, body.pose()));
            let path = format!("spawns[{i}]");
            let mut seeds = spawn.seeds_among(path.clone(), &self.domain, material, bodies).peekable();
            let some = Check { path: &path }.that(
                seeds.peek().is_some(),
                "",
                &spawn.shape,
                "one that holds a particle outside of the colliders",
            );
            some.err().map(Err).into_iter().chain(seeds)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All corners of the domain are in a square picture, one of them near its edge.
    #[test]
    fn a_camera_overlooks_the_whole_domain() {
        for size in [DVec3::ONE, DVec3::new(10.0, 1.0, 2.0), DVec3::new(1.0, 30.0, 1.0), DVec3::new(0.1, 0.2, 5.0)] {
            let domain = World::new(DVec3::splat(-3.0), size - 3.0, 0.02).domain;
            let camera = Camera::overlooking(&domain);
            let forward = (camera.target - camera.position).normalize();
            let right = forward.cross(DVec3::Y).normalize();
            let up = right.cross(forward);
            let slope = (0.5 * camera.vertical_fov).to_radians().tan();
            let corners = (0..8).map(|i| {
                let share = DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2));
                let way = domain.min + share * (domain.max - domain.min) - camera.position;
                way.dot(right).abs().max(way.dot(up).abs()) / (way.dot(forward) * slope)
            });
            let outermost = corners.fold(0.0, f64::max);
            assert!((0.9..1.0).contains(&outermost), "{size}: {outermost}");
        }
    }
}
