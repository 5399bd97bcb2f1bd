//! Assembles a stage's WGSL: `#import name` inserts a file of `shaders/lib`, `#if NAME` … `#else` … `#endif` keeps its
//! lines only in variants that have it. `var<colliders>` becomes the address space that the colliders are bound in,
//! `Colliders` their type. Code that a scene does not need is not in the text.

use super::layout::{Collider, shared_constants};
use super::slots::Slot;
use super::tuning::Tuning;
use crate::collider::Shapes;
use crate::features::Features;
use crate::plan::Stage;
use crate::settings::Scheme;
use crate::stages::collider_cull::BODIES_PER_WORD;
use crate::stages::kernel;

/// What a world's shaders are made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    /// What the world asks of its steps.
    pub features: Features,
    /// Where walls and bodies are bound.
    pub colliders: ColliderStore,
    /// Which shapes the bodies have.
    pub shapes: Shapes,
    /// How many materials there are.
    pub materials: usize,
    /// Which shapes the drains have, if there are any.
    pub drains: Option<Shapes>,
    /// Which shapes the sensors have, if there are any.
    pub sensors: Option<Shapes>,
    /// Particles appear while the world runs.
    pub emission: bool,
    /// The load of some body is measured.
    pub loads: bool,
    /// There are tools.
    pub tools: bool,
    /// How passes are cut into workgroups.
    pub tuning: Tuning,
    /// Invocations of a workgroup in stages that look at bodies.
    pub lanes_beside: u32,
    /// Invocations of a workgroup that works alone.
    pub solo_lanes: u32,
}

/// Where the shaders read walls and bodies. All invocations of a workgroup read the same ones at about the same time,
/// which is fastest from uniform buffers; but those are small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColliderStore {
    /// There are none.
    Absent,
    /// In a uniform buffer of this many.
    Uniform(u32),
    /// In a storage buffer.
    Storage,
}

impl ColliderStore {
    /// For `count` colliders on a device whose uniform bindings hold `limit` bytes.
    pub fn choose(count: u32, limit: u64) -> Self {
        match count {
            0 => ColliderStore::Absent,
            n if u64::from(n) * size_of::<Collider>() as u64 <= limit => ColliderStore::Uniform(n),
            _ => ColliderStore::Storage,
        }
    }

    /// Whether there are any.
    pub fn any(self) -> bool {
        self != ColliderStore::Absent
    }

    /// Whether a block notes them in more than one word.
    fn crowd(self) -> bool {
        match self {
            ColliderStore::Absent => false,
            ColliderStore::Uniform(count) => count as usize > BODIES_PER_WORD,
            ColliderStore::Storage => true,
        }
    }

    fn address_space(self) -> &'static str {
        if matches!(self, ColliderStore::Uniform(_)) { "uniform" } else { "storage, read" }
    }

    fn alias(self) -> String {
        match self {
            ColliderStore::Absent => String::new(),
            ColliderStore::Uniform(count) => format!("alias Colliders = array<Collider, {count}u>;\n"),
            ColliderStore::Storage => "alias Colliders = array<Collider>;\n".to_owned(),
        }
    }
}

impl Variant {
    /// The part of it that concerns a stage.
    pub fn of_stage(self, stage: Stage) -> Variant {
        let beside = kernel(stage).binds.iter().any(|bind| bind.slot == Slot::Colliders);
        let lanes = match stage {
            _ if beside => self.lanes_beside,
            _ if self.tuning.tiles && takes_shares(stage) => self.tuning.tile_lanes,
            Stage::BlockSolve => self.solo_lanes,
            _ => self.tuning.lanes,
        };
        let tuning = Tuning { lanes, ..self.tuning };
        // What nodes exert in a prediction is only a guess.
        let loads = self.loads && stage != Stage::Predict;
        Variant { shapes: self.shapes_of(stage), loads, tuning, ..self }
    }

    /// The shapes that concern a stage.
    pub fn shapes_of(self, stage: Stage) -> Shapes {
        match stage {
            Stage::Drain => self.drains.unwrap_or_default(),
            Stage::Sense => self.sensors.unwrap_or_default(),
            _ => self.shapes,
        }
    }

    /// Whether iterations of the published scheme are fused (see [`Tuning::fused`]).
    pub fn fused(self) -> bool {
        self.tuning.fused && self.features.fuses()
    }

    /// Whether there are several of those.
    pub fn repeats(self) -> bool {
        self.fused() && self.features.repeats
    }

    /// Whether the scheme is the published one.
    pub fn published(self) -> bool {
        self.features.scheme == Scheme::Published
    }

    /// Whether a stage has the lines under a condition. Without a stage, lines of single stages are left out.
    fn has(self, stage: Option<Stage>, condition: &str) -> bool {
        let features = self.features;
        match condition {
            // In one stage only: pushes of particles are summed per block; contact notes the directions in which it
            // holds nodes, and the kernel share that bodies occlude; gaps are written behind the bits of the bodies
            // in reach.
            "BLOCK_TILES" => stage == Some(Stage::BlockP2g),
            "HOLDS" => stage == Some(Stage::Predict),
            "SEES_ROOM" => stage == Some(Stage::Integrate),
            "NOTES_GAPS" => stage == Some(Stage::Gap),
            "PUBLISHED" => self.published(),
            "IMPLICIT" => features.implicit(),
            "SHARES_PRESSURE" => features.shares_pressure,
            "SCALARS" => features.implicit() && !features.tensors(),
            "TENSORS" => features.tensors(),
            "CORRECTS" => features.corrects,
            "CORRECTS_STRESS" => features.corrects && features.tensors(),
            "GAPS" => self.colliders.any() && features.gaps(),
            "COLLIDERS" => self.colliders.any(),
            "CROWD" => self.colliders.crowd(),
            "LIQUID" => features.liquid,
            "SOLIDS" => features.solids(),
            "TELLS_MATERIALS" => features.tells_materials(),
            "KINDS" => features.kinds(),
            "DEFORMS" => features.deforms(),
            "STICKS" => features.sticks,
            "RESUMES" => features.resumes,
            "WALLS" => features.walls,
            "FACES" => features.faces,
            "BOXES" => self.shapes.boxes,
            "SPHERES" => self.shapes.spheres,
            "CAPSULES" => self.shapes.capsules,
            "CYLINDERS" => self.shapes.cylinders,
            "MESHES" => self.shapes.meshes > 0,
            "CONTAINERS" => self.shapes.containers,
            "EDGES" => self.shapes.containers || self.shapes.boxes || self.shapes.cylinders,
            "LOADS" => self.loads,
            "TOOLS" => self.tools,
            "SLEEP" => features.sleep,
            "PERIODIC" => features.periodic,
            "TILES" => self.tuning.tiles,
            "FUSED" => self.fused(),
            "REPEATS" => self.repeats(),
            "VOLUMES" => features.volumes,
            "MIXES" => features.mixes(),
            "FIRM" => features.firm(),
            "EVENNESS" => !features.volumes || features.firm(),
            // For every share, not only where a particle needs it.
            "LOOKS_AROUND" => features.firm() || (!features.volumes && !self.tuning.tiles),
            "YIELDING" => features.yielding(),
            other => unreachable!("no variant is called {other}"),
        }
    }
}

/// Whether a stage scatters shares of chunks (`shares.wgsl`, which stages that only gather import as well) to tiles.
fn takes_shares(stage: Stage) -> bool {
    matches!(stage, Stage::VolumeP2g | Stage::P2g | Stage::G2p2g | Stage::Seek | Stage::BlockP2g)
}

const LIBRARY: [(&str, &str); 77] = [
    ("layout", include_str!("../../shaders/lib/layout.wgsl")),
    ("active", include_str!("../../shaders/lib/active.wgsl")),
    ("bounded", include_str!("../../shaders/lib/bounded.wgsl")),
    ("corrected", include_str!("../../shaders/lib/corrected.wgsl")),
    ("correction", include_str!("../../shaders/lib/correction.wgsl")),
    ("momentum_scale", include_str!("../../shaders/lib/momentum_scale.wgsl")),
    ("motion_scale", include_str!("../../shaders/lib/motion_scale.wgsl")),
    ("largest_motion", include_str!("../../shaders/lib/largest_motion.wgsl")),
    ("gradient", include_str!("../../shaders/lib/gradient.wgsl")),
    ("linear", include_str!("../../shaders/lib/linear.wgsl")),
    ("svd", include_str!("../../shaders/lib/svd.wgsl")),
    ("kernel", include_str!("../../shaders/lib/kernel.wgsl")),
    ("bins", include_str!("../../shaders/lib/bins.wgsl")),
    ("neighbours", include_str!("../../shaders/lib/neighbours.wgsl")),
    ("table", include_str!("../../shaders/lib/table.wgsl")),
    ("chunk", include_str!("../../shaders/lib/chunk.wgsl")),
    ("lookup", include_str!("../../shaders/lib/lookup.wgsl")),
    ("slots", include_str!("../../shaders/lib/slots.wgsl")),
    ("scan", include_str!("../../shaders/lib/scan.wgsl")),
    ("idle", include_str!("../../shaders/lib/idle.wgsl")),
    ("around", include_str!("../../shaders/lib/around.wgsl")),
    ("halt", include_str!("../../shaders/lib/halt.wgsl")),
    ("distance_grid", include_str!("../../shaders/lib/distance_grid.wgsl")),
    ("sdf", include_str!("../../shaders/lib/sdf.wgsl")),
    ("contact", include_str!("../../shaders/lib/contact.wgsl")),
    ("matter", include_str!("../../shaders/lib/matter.wgsl")),
    ("corner", include_str!("../../shaders/lib/corner.wgsl")),
    ("joint", include_str!("../../shaders/lib/joint.wgsl")),
    ("sides", include_str!("../../shaders/lib/sides.wgsl")),
    ("seam", include_str!("../../shaders/lib/seam.wgsl")),
    ("swept", include_str!("../../shaders/lib/swept.wgsl")),
    ("footing", include_str!("../../shaders/lib/footing.wgsl")),
    ("tool", include_str!("../../shaders/lib/tool.wgsl")),
    ("sum64", include_str!("../../shaders/lib/sum64.wgsl")),
    ("load", include_str!("../../shaders/lib/load.wgsl")),
    ("believed", include_str!("../../shaders/lib/believed.wgsl")),
    ("even", include_str!("../../shaders/lib/even.wgsl")),
    ("rest", include_str!("../../shaders/lib/rest.wgsl")),
    ("takes_part", include_str!("../../shaders/lib/takes_part.wgsl")),
    ("still", include_str!("../../shaders/lib/still.wgsl")),
    ("sound", include_str!("../../shaders/lib/sound.wgsl")),
    ("exponential", include_str!("../../shaders/lib/exponential.wgsl")),
    ("solid", include_str!("../../shaders/lib/solid.wgsl")),
    ("cells", include_str!("../../shaders/lib/cells.wgsl")),
    ("shares", include_str!("../../shaders/lib/shares.wgsl")),
    ("gather", include_str!("../../shaders/lib/gather.wgsl")),
    ("gather_tile", include_str!("../../shaders/lib/gather_tile.wgsl")),
    ("gather_grid", include_str!("../../shaders/lib/gather_grid.wgsl")),
    ("scatter", include_str!("../../shaders/lib/scatter.wgsl")),
    ("scatter_tile", include_str!("../../shaders/lib/scatter_tile.wgsl")),
    ("scatter_grid", include_str!("../../shaders/lib/scatter_grid.wgsl")),
    ("walls", include_str!("../../shaders/lib/walls.wgsl")),
    ("faces", include_str!("../../shaders/lib/faces.wgsl")),
    ("room", include_str!("../../shaders/lib/room.wgsl")),
    ("rows", include_str!("../../shaders/lib/rows.wgsl")),
    ("meet", include_str!("../../shaders/lib/meet.wgsl")),
    ("stretch", include_str!("../../shaders/lib/stretch.wgsl")),
    ("bound", include_str!("../../shaders/lib/bound.wgsl")),
    ("bound_gradient", include_str!("../../shaders/lib/bound_gradient.wgsl")),
    ("node_position", include_str!("../../shaders/lib/node_position.wgsl")),
    ("node", include_str!("../../shaders/lib/node.wgsl")),
    ("drag", include_str!("../../shaders/lib/drag.wgsl")),
    ("kept_out", include_str!("../../shaders/lib/kept_out.wgsl")),
    ("hold", include_str!("../../shaders/lib/hold.wgsl")),
    ("force_scale", include_str!("../../shaders/lib/force_scale.wgsl")),
    ("scales", include_str!("../../shaders/lib/scales.wgsl")),
    ("totals", include_str!("../../shaders/lib/totals.wgsl")),
    ("compliance", include_str!("../../shaders/lib/compliance.wgsl")),
    ("symmetric", include_str!("../../shaders/lib/symmetric.wgsl")),
    ("search", include_str!("../../shaders/lib/search.wgsl")),
    ("stress", include_str!("../../shaders/lib/stress.wgsl")),
    ("add_force", include_str!("../../shaders/lib/add_force.wgsl")),
    ("motion", include_str!("../../shaders/lib/motion.wgsl")),
    ("viscosity", include_str!("../../shaders/lib/viscosity.wgsl")),
    ("liquid", include_str!("../../shaders/lib/liquid.wgsl")),
    ("pressures", include_str!("../../shaders/lib/pressures.wgsl")),
    ("couplings", include_str!("../../shaders/lib/couplings.wgsl")),
];

/// The text of a library file.
pub fn library(name: &str) -> &'static str {
    let found = LIBRARY.iter().find(|(n, _)| *n == name);
    found.map_or_else(|| unreachable!("no library file is called {name}"), |(_, text)| text)
}

/// The whole text of a stage's shader. Imports come first, in the order in which they are named.
pub fn source(stage: Stage, variant: Variant) -> String {
    let variant = variant.of_stage(stage);
    let mut text = shared_constants(&variant) + &variant.colliders.alias();
    let body = expand(kernel(stage).source, Some(stage), variant, &mut text);
    text + &body
}

/// The lines that a stage has in a variant; appends what they import to `imports`.
pub fn expand(source: &str, stage: Option<Stage>, variant: Variant, imports: &mut String) -> String {
    let mut body = String::new();
    // Whether the lines under each of the conditions around a line are kept.
    let mut under: Vec<bool> = Vec::new();
    for line in source.lines() {
        let keep = under.iter().all(|keep| *keep);
        if let Some(condition) = line.strip_prefix("#if ") {
            under.push(variant.has(stage, condition.trim()));
        } else if line.trim() == "#else" {
            under.last_mut().into_iter().for_each(|keep| *keep = !*keep);
        } else if line.trim() == "#endif" {
            under.pop();
        } else if let Some(name) = line.strip_prefix("#import ") {
            if keep {
                let text = expand(library(name.trim()), stage, variant, imports);
                imports.push_str(&text);
            }
        } else if keep {
            body.push_str(&line.replace("var<colliders>", &format!("var<{}>", variant.colliders.address_space())));
            body.push('\n');
        }
    }
    body
}
