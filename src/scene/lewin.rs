//! Reads the scene files of Chris Lewin's 2D reference (electronicarts/pbmpm, format version 2) as slabs in 3D.
//!
//! `docs/scene-format.md`, "Lewin's scenes", says how each value is converted.

use super::{TOP, located};
use crate::camera::Camera;
use crate::collider::Collider;
use crate::domain::{MAX_CELLS_PER_AXIS, Wall};
use crate::emitter::{Emitter, MAX_RATE, Rate};
use crate::error::{Check, Error, Result};
use crate::material::{Material, Model};
use crate::region::Region;
use crate::settings::Scheme;
use crate::shape::{Pose, Shape};
use crate::spawn::{Fill, Spawn};
use crate::world::{MAX_PARTICLES, World};
use glam::{DQuat, DVec2, DVec3};
use serde::{Deserialize, Deserializer};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// How the plane becomes a slab.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slab {
    /// Edge of a cell, m; `None`: that which makes his gravity 9.81 m/s². Default `None`.
    pub cell_size: Option<f64>,
    /// Thickness in cells, 1 … 1024. Default 6.
    pub depth: u32,
}

impl Default for Slab {
    fn default() -> Self {
        Slab { cell_size: None, depth: 6 }
    }
}

/// A scene that was read.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Imported {
    /// The world.
    pub world: World,
    /// What could not be taken over as it stands, one sentence each.
    pub notes: Vec<String>,
}

/// Whether a document looks like one of his scenes.
pub fn is_lewin(document: &serde_json::Value) -> bool {
    document.get("resolution").is_some() && document.get("shapes").is_some()
}

/// Reads a scene.
///
/// # Errors
/// [`Error::Scene`] where the text is not JSON or not of his format, [`Error::Invalid`] where the world that it
/// describes is not valid, or the slab is not.
pub fn from_json(text: &str, slab: &Slab) -> Result<Imported> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let file: File = serde_path_to_error::deserialize(&mut reader).map_err(|e| located(&e))?;
    reader.end().map_err(|e| Error::Scene { path: TOP.to_owned(), message: e.to_string() })?;
    file.check()?;
    let check = Check { path: "slab" };
    check.that((1..=1024).contains(&slab.depth), "depth", slab.depth, "1 to 1024 cells")?;
    let (settings, mut notes) = Settings::read(&file.settings)?;
    let world = Plane::new(&file, &settings, slab)?.world(&file, &settings, &mut notes);
    world.validate()?;
    Ok(Imported { world, notes })
}

#[derive(Deserialize)]
struct File {
    version: Number,
    /// Pixels.
    resolution: [Number; 2],
    #[serde(default)]
    settings: Vec<Setting>,
    shapes: Vec<Figure>,
}

#[derive(Deserialize)]
struct Setting {
    name: String,
    value: serde_json::Value,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Figure {
    #[serde(default)]
    id: serde_json::Value,
    position: Point,
    half_size: Point,
    radius: Number,
    rotation: Number,
    shape: Number,
    function: Number,
    #[serde(default)]
    emit_material: Number,
    #[serde(default)]
    emission_rate: Number,
}

#[derive(Deserialize)]
struct Point {
    x: Number,
    y: Number,
}

/// A number, which his pages may write as a string.
#[derive(Clone, Copy, Default)]
struct Number(f64);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(reader: D) -> Result<Self, D::Error> {
        let value = serde_json::Value::deserialize(reader)?;
        number(&value).map(Number).ok_or_else(|| serde::de::Error::custom(format!("{value} is not a number")))
    }
}

fn number(value: &serde_json::Value) -> Option<f64> {
    let found = value.as_f64().or_else(|| value.as_str().and_then(|text| text.trim().parse().ok()));
    found.filter(|x| x.is_finite())
}

impl File {
    fn check(&self) -> Result<()> {
        let check = Check { path: "" };
        check.that(self.version.0 == 2.0, "version", self.version.0, "2")?;
        for (axis, pixels) in self.resolution.iter().enumerate() {
            check.range(&format!("resolution[{axis}]"), pixels.0, 1.0, 65_536.0, "1 to 65536 pixels")?;
        }
        check.that(self.shapes.len() <= 4096, "shapes", self.shapes.len(), "at most 4096 shapes")?;
        for (i, figure) in self.shapes.iter().enumerate() {
            figure.check(&format!("shapes[{i}]"))?;
        }
        Ok(())
    }
}

impl Figure {
    fn check(&self, path: &str) -> Result<()> {
        let check = Check { path };
        let one_of = |name: &str, value: f64, last: f64, allowed: &str| {
            check.that(value.fract() == 0.0 && (0.0..=last).contains(&value), name, value, allowed)
        };
        one_of("shape", self.shape.0, 1.0, "0 (box) or 1 (circle)")?;
        let functions = "0 (emitter), 1 (collider), 2 (drain) or 3 (initial emitter)";
        one_of("function", self.function.0, 3.0, functions)?;
        one_of("emitMaterial", self.emit_material.0, 3.0, "0 (liquid), 1 (elastic), 2 (sand) or 3 (visco)")?;
        let lengths = [
            ("position.x", self.position.x.0, -1e6),
            ("position.y", self.position.y.0, -1e6),
            ("halfSize.x", self.half_size.x.0, 0.0),
            ("halfSize.y", self.half_size.y.0, 0.0),
            ("radius", self.radius.0, 0.0),
        ];
        for (name, value, least) in lengths {
            check.range(name, value, least, 1e6, if least < 0.0 { "at most 1e6 in size" } else { "0 to 1e6" })?;
        }
        check.range("emissionRate", self.emission_rate.0, 0.0, 1e6, "0 to 1e6")?;
        let circle = self.is_circle();
        check.that(!circle || self.radius.0 > 0.0, "radius", self.radius.0, "above 0 for a circle")?;
        let [x, y] = [self.half_size.x.0, self.half_size.y.0];
        check.that(circle || x.min(y) > 0.0, "halfSize", [x, y], "above 0 for a box")
    }

    fn is_circle(&self) -> bool {
        self.shape.0 == 1.0
    }

    /// Whether he fills its cells, at the start or all the time.
    fn is_filled(&self) -> bool {
        matches!(self.function.0, 0.0 | 3.0)
    }

    fn name(&self) -> String {
        match &self.id {
            serde_json::Value::Null => String::new(),
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        }
    }
}

/// The sliders of his page that say something about the world.
struct Settings {
    pixels_per_cell: f64,
    per_axis: f64,
    rate: f64,
    grid_volume: bool,
    gravity: f64,
    viscosity: f64,
    iterations: u32,
    elasticity: f64,
    liquid_relaxation: f64,
    elastic_relaxation: f64,
    friction_angle: f64,
    plasticity: f64,
    border_friction: f64,
}

impl Settings {
    fn read(list: &[Setting]) -> Result<(Self, Vec<String>)> {
        let mut s = Settings {
            pixels_per_cell: 8.0,
            per_axis: 2.0,
            rate: 240.0,
            grid_volume: true,
            gravity: 2.5,
            viscosity: 0.01,
            iterations: 5,
            elasticity: 1.0,
            liquid_relaxation: 1.5,
            elastic_relaxation: 1.5,
            friction_angle: 30.0,
            plasticity: 0.9,
            border_friction: 0.5,
        };
        let mut notes = Vec::new();
        for (i, setting) in list.iter().enumerate() {
            let path = format!("settings[{i}]");
            let check = Check { path: &path };
            let within = |lo: f64, hi: f64| -> Result<f64> {
                let value = number(&setting.value).unwrap_or(f64::NAN);
                let allowed = format!("{lo} to {hi} for {}", setting.name);
                check.that((lo..=hi).contains(&value), "value", &setting.value, &allowed)?;
                Ok(value)
            };
            // No more than this solver bears: at 2 an iteration overshoots without end.
            let mut relaxation = || -> Result<f64> {
                let asked = within(0.0, 10.0)?;
                if asked > 1.9 {
                    notes.push(format!("{} = {asked} is taken as 1.9, the largest that is stable", setting.name));
                }
                Ok(asked.min(1.9))
            };
            match setting.name.as_str() {
                "simResDivisor" => s.pixels_per_cell = within(1.0, 256.0)?,
                "particlesPerCellAxis" => s.per_axis = within(1.0, 8.0)?,
                "simRate" => s.rate = within(5.0, 1e5)?,
                "useGridVolumeForLiquid" => s.grid_volume = truth(&setting.value),
                "gravityStrength" => s.gravity = within(0.0, 1e3)?,
                "liquidViscosity" => s.viscosity = within(0.0, 1.0)?,
                "iterationCount" => s.iterations = within(1.0, 1000.0)? as u32,
                "elasticityRatio" => s.elasticity = within(0.0, 1.0)?,
                "liquidRelaxation" => s.liquid_relaxation = relaxation()?,
                "elasticRelaxation" => s.elastic_relaxation = relaxation()?,
                "frictionAngle" => s.friction_angle = within(0.0, 45.0)?,
                "plasticity" => s.plasticity = within(0.0, 1.0)?,
                "borderFriction" => s.border_friction = within(0.0, 1.0)?,
                "fixedPointMultiplierExponent" | "mouseFunction" | "renderMode" => {}
                other => notes.push(format!("the setting {other} is not known and has no effect")),
            }
        }
        Ok((s, notes))
    }

    /// Solves per step: his first pass of a step moves nothing.
    fn solves(&self) -> u32 {
        self.iterations.saturating_sub(1).max(1)
    }

    fn materials(&self) -> Vec<Material> {
        let solid = |name: &str, model, color| Material {
            model,
            relaxation: self.elastic_relaxation,
            color,
            ..Material::liquid(name)
        };
        let elastic = Model::Elastic { shape_weight: self.elasticity };
        let sand = Model::Sand { friction_angle: self.friction_angle };
        let visco = Model::Viscoplastic { yield_strain: 1.0 - self.plasticity };
        vec![
            Material {
                relaxation: self.liquid_relaxation,
                viscous_relaxation: self.viscosity,
                color: [0.1, 0.35, 0.85],
                ..Material::liquid("liquid")
            },
            solid("elastic", elastic, [0.15, 0.6, 0.25]),
            Material { viscous_relaxation: self.viscosity, ..solid("sand", sand, [0.85, 0.7, 0.3]) },
            solid("visco", visco, [0.85, 0.4, 0.6]),
        ]
    }
}

fn truth(value: &serde_json::Value) -> bool {
    value.as_bool().unwrap_or_else(|| !matches!(value.as_str(), Some("false" | "0" | "")) && number(value) != Some(0.0))
}

/// His grid, and where it lies in the world.
struct Plane {
    /// Cells along x and y.
    cells: [u32; 2],
    pixels_per_cell: f64,
    cell_size: f64,
    depth: f64,
    gravity: f64,
}

/// Cells at the border of his grid that matter keeps out of.
const BORDER: f64 = 4.5;

impl Plane {
    fn new(file: &File, settings: &Settings, slab: &Slab) -> Result<Self> {
        let cells = file.resolution.map(|pixels| (pixels.0 / settings.pixels_per_cell).floor() as u32);
        let check = Check { path: "" };
        let most = (MAX_CELLS_PER_AXIS + 2.0 * BORDER) as u32;
        let some = cells.iter().all(|n| (11..=most).contains(n));
        check.that(some, "resolution", cells, &format!("11 to {most} cells on each axis"))?;
        // His gravity is so many heights of the grid per s².
        let heights = settings.gravity * f64::from(cells[1]);
        let cell_size = slab.cell_size.unwrap_or(if heights > 0.0 { 9.81 / heights } else { 0.02 });
        Check { path: "slab" }.range("cell_size", cell_size, 1e-5, 1e4, "1e-5 to 1e4 m")?;
        let plane = Plane {
            cells,
            pixels_per_cell: settings.pixels_per_cell,
            cell_size,
            depth: f64::from(slab.depth),
            gravity: heights * cell_size,
        };
        let filling = file.shapes.iter().filter(|figure| figure.is_filled());
        let examined: u64 =
            filling.map(|f| plane.around(f).map(|cells| cells.len() as u64).iter().product::<u64>()).sum();
        let all = "boxes around emitters and initial emitters that cover at most 2^26 cells together";
        check.that(examined <= MAX_PARTICLES, "shapes", examined, all)?;
        Ok(plane)
    }

    /// A figure's centre in cells, y up.
    fn centre(&self, figure: &Figure) -> DVec2 {
        let [x, y] = [figure.position.x, figure.position.y].map(|pixels| pixels.0 / self.pixels_per_cell);
        DVec2::new(x, f64::from(self.cells[1]) - y)
    }

    /// Its shape with this half thickness in cells, where it is, and how it is turned.
    fn body(&self, figure: &Figure, half_depth: f64) -> (Shape, DVec3, DQuat) {
        let centre = self.centre(figure);
        let position = DVec3::new(centre.x, centre.y, 0.5 * self.depth) * self.cell_size;
        let pixel = self.cell_size / self.pixels_per_cell;
        let half_height = half_depth * self.cell_size;
        if figure.is_circle() {
            // Cylinders stand along y.
            let shape = Shape::Cylinder { radius: figure.radius.0 * pixel, half_height };
            return (shape, position, DQuat::from_rotation_x(FRAC_PI_2));
        }
        let half_size = DVec3::new(figure.half_size.x.0 * pixel, figure.half_size.y.0 * pixel, half_height);
        (Shape::Box { half_size }, position, self.turn(figure))
    }

    /// Clockwise on a screen whose y points down.
    fn turn(&self, figure: &Figure) -> DQuat {
        DQuat::from_rotation_z(-figure.rotation.0.to_radians())
    }

    /// The columns and rows of cells around a figure, inside the border.
    fn around(&self, figure: &Figure) -> [Range<u32>; 2] {
        let (shape, position, rotation) = self.body(figure, self.depth);
        let reach = shape.half_extent_turned(rotation).unwrap_or(DVec3::INFINITY);
        [0, 1].map(|axis| {
            let [lo, hi] = [position - reach, position + reach].map(|edge| edge[axis] / self.cell_size);
            (lo.floor() as u32).max(5)..(hi.ceil() as u32).saturating_add(1).min(self.cells[axis] - 5)
        })
    }

    /// The cells that he fills: those inside the border whose lower corner is in the figure. Row by row of those around
    /// it, of which the first is named.
    fn filled(&self, figure: &Figure) -> ([u32; 2], Vec<Vec<bool>>) {
        let (shape, position, rotation) = self.body(figure, self.depth);
        let inside = |x: u32, y: u32| {
            let at = DVec3::new(f64::from(x), f64::from(y), 0.5 * self.depth) * self.cell_size;
            shape.signed_distance(Pose { position, rotation }.local(at)) <= 1e-9 * self.cell_size
        };
        let [columns, rows] = self.around(figure);
        let first = [columns.start, rows.start];
        (first, rows.map(|y| columns.clone().map(|x| inside(x, y)).collect()).collect())
    }

    fn world(&self, file: &File, settings: &Settings, notes: &mut Vec<String>) -> World {
        let [w, h] = self.cells.map(f64::from);
        let scale = |cells: [f64; 3]| DVec3::from_array(cells) * self.cell_size;
        let (min, max) = (scale([BORDER, BORDER, 0.0]), scale([w - BORDER, h - BORDER, self.depth]));
        let mut world = World::new(min, max, self.cell_size);
        let border = match settings.border_friction {
            0.0 => Wall::Slip,
            1.0 => Wall::Stick,
            share => Wall::Friction(share),
        };
        let walls = &mut world.domain.walls;
        (walls.x_min, walls.x_max, walls.y_min, walls.y_max) = (border, border, border, border);
        world.gravity = DVec3::new(0.0, -self.gravity, 0.0);
        world.materials = settings.materials();
        let solves = settings.solves();
        world.settings.scheme = Scheme::Published;
        world.settings.dt = 1.0 / settings.rate;
        world.settings.iterations = solves;
        // Each of his solves moves the volume ratio by a tenth of the way.
        let per_step = -0.9f64.ln() * f64::from(solves);
        world.settings.volume_correction_time =
            if settings.grid_volume { (world.settings.dt / per_step).clamp(1e-4, 1e3) } else { 1e3 };
        let size = max - min;
        let distance = 0.62 * size.y.max(size.x * 0.6) / (20f64.to_radians()).tan();
        let target = (min + max) * 0.5;
        world.camera = Some(Camera { position: target + DVec3::Z * distance, target, vertical_fov: 40.0 });
        for figure in &file.shapes {
            self.add(&mut world, figure, settings, notes);
        }
        let per_second: f64 = world.emitters.iter().map(|e| e.particles_per_second(self.cell_size)).sum();
        if per_second > MAX_RATE {
            let most = format!("are taken to emit {MAX_RATE:e} particles per second, the most that there may be");
            notes.push(format!("emitters, of {per_second:e} together, {most}"));
            for emitter in &mut world.emitters {
                let rate = emitter.particles_per_second(self.cell_size);
                emitter.rate = Rate::Particles(rate * MAX_RATE / per_second);
            }
        }
        world
    }

    fn add(&self, world: &mut World, figure: &Figure, settings: &Settings, notes: &mut Vec<String>) {
        let material = figure.emit_material.0 as usize;
        let name = world.materials[material].name.clone();
        // Bodies and drains reach beyond the slab's sides, so that their ends are never met.
        let (shape, position, rotation) = self.body(figure, 0.5 * self.depth + 1.0);
        match figure.function.0 as u32 {
            0 => {
                let (shape, position, rotation) = self.body(figure, 0.5 * self.depth);
                let cells = self.filled(figure).1.iter().flatten().filter(|inside| **inside).count();
                // In each of his places a particle comes every whole number of steps.
                let every = (settings.rate / figure.emission_rate.0).floor().max(1.0);
                let places = cells as f64 * self.depth * settings.per_axis.powi(3);
                let per_second = if figure.emission_rate.0 > 0.0 { places * settings.rate / every } else { 0.0 };
                if per_second == 0.0 {
                    notes.push(format!("emitter {} emits nothing", figure.name()));
                }
                world.emitters.push(Emitter {
                    name: figure.name(),
                    rotation,
                    per_cell: settings.per_axis.powi(3),
                    fill_limit: if material == 0 { 1.5 } else { 1e6 },
                    ..Emitter::new(name, shape, position, Rate::Particles(per_second))
                });
            }
            1 => world.colliders.push(Collider { name: figure.name(), rotation, ..Collider::new(shape, position) }),
            2 => world.drains.push(Region { name: figure.name(), rotation, ..Region::new(shape, position) }),
            _ => {
                let (first, filled) = self.filled(figure);
                for [x, y, w, h] in rectangles(filled) {
                    let [x, y] = [first[0] + x, first[1] + y];
                    let corner = |x: u32, y: u32, z: f64| DVec3::new(f64::from(x), f64::from(y), z) * self.cell_size;
                    let (lo, hi) = (corner(x, y, 0.0), corner(x + w, y + h, self.depth));
                    world.spawns.push(Spawn {
                        fill: Fill::PerCell(settings.per_axis.powi(3)),
                        jitter: 0.225,
                        seed: world.spawns.len() as u64,
                        ..Spawn::cuboid(name.clone(), lo, hi)
                    });
                }
            }
        }
    }
}

/// Cuts what is set into rectangles: corner and size.
fn rectangles(mut set: Vec<Vec<bool>>) -> Vec<[u32; 4]> {
    let mut found = Vec::new();
    for y in 0..set.len() {
        for x in 0..set[y].len() {
            if !set[y][x] {
                continue;
            }
            let w = set[y][x..].iter().take_while(|inside| **inside).count();
            let full = |row: &&Vec<bool>| row[x..x + w].iter().all(|inside| *inside);
            let h = set[y..].iter().take_while(full).count();
            set[y..y + h].iter_mut().for_each(|row| row[x..x + w].fill(false));
            found.push([x, y, w, h].map(|n| n as u32));
        }
    }
    found
}
