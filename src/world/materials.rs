//! Which of a world's materials take part, and what these require of steps.

use super::World;
use crate::collider::{Boundary, Collider};
use crate::domain::Wall;
use crate::material::{Material, Model};
use crate::quality::depth_along;
use crate::settings::{Scheme, Settings};
use crate::stages::compliance::{SOLID_LIMIT, SOLID_SHARE, THICKEST};
use glam::DVec3;

/// Viscosity, in multiples of that which removes all shear of an isolated particle in a step, above which matter is
/// much stiffer to shear than to pressure: twice the largest stiffness of liquids to pressure.
const STIFF_TO_SHEAR: f64 = 64.0;

impl World {
    /// Whether a material takes part: a spawn or an emitter names it, or hosts may add any, since
    /// [`Settings::capacity`](crate::Settings::capacity) is stated. If nothing is spawned or emitted, all take part.
    /// Other materials are not stored or compiled, and require nothing of steps.
    pub(crate) fn takes_part(&self, material: &Material) -> bool {
        let spawned = self.spawns.iter().map(|spawn| &spawn.material);
        let mut named = spawned.chain(self.emitters.iter().map(|emitter| &emitter.material)).peekable();
        self.settings.capacity.is_some() || named.peek().is_none() || named.any(|name| *name == material.name)
    }

    /// The materials that take part, with their indices.
    pub(crate) fn taking_part(&self) -> impl Iterator<Item = (usize, &Material)> {
        self.materials.iter().enumerate().filter(|(_, material)| self.takes_part(material))
    }

    /// The liquids that take part.
    pub(crate) fn liquids(&self) -> impl Iterator<Item = &Material> {
        self.taking_part().map(|(_, m)| m).filter(|m| m.model == Model::Liquid)
    }

    /// Whether a material that takes part satisfies `such`.
    pub(crate) fn has(&self, such: impl Fn(&Material) -> bool) -> bool {
        self.taking_part().any(|(_, material)| such(material))
    }

    /// The longest step, s, that is stable for the world's solids in the explicit scheme: the shortest of the
    /// materials' [`Material::stable_dt`]; infinite without solids.
    pub fn stable_dt(&self) -> f64 {
        let cell_size = self.domain.cell_size;
        self.taking_part().map(|(_, m)| m.stable_dt(cell_size)).fold(f64::INFINITY, f64::min)
    }

    /// The longest step, s, in which a scheme accounts for the full viscosity of all matter; in longer steps matter is
    /// less viscous in proportion. Infinite without viscosity.
    ///
    /// In the explicit scheme it is ρ Δx²/(8 η) of the most viscous material, since a particle can lose no more than
    /// its whole shear rate. In the implicit scheme it is that of the most viscous viscoplastic material, or 1024 times
    /// that of the most viscous liquid or elastic material, whose viscosity the scheme solves for (for liquids only if
    /// [`Settings::dt`](crate::Settings::dt) is longer than ρ Δx²/(8 η) of one of them). It is infinite in the
    /// published scheme, which uses only [`Material::viscous_relaxation`].
    pub fn viscous_dt(&self, scheme: Scheme) -> f64 {
        let yielding = |model: Model| matches!(model, Model::Viscoplastic { .. });
        match scheme {
            Scheme::Published => f64::INFINITY,
            Scheme::Implicit => {
                self.longest_viscous(yielding).min(THICKEST * self.longest_viscous(|model| !yielding(model)))
            }
            Scheme::Explicit => self.longest_viscous(|_| true),
        }
    }

    /// The iterations that a step of `dt` of the [implicit scheme](crate::Scheme::Implicit) needs to stop the most
    /// viscous matter in one step when it hits something: √(8 η Δt/(ρ Δx²)), by experience. With fewer, thick matter
    /// bursts when it falls on a floor. Slow flow needs few, since stresses are carried over. 0 without viscosity that
    /// is solved for.
    pub fn viscous_iterations(&self, dt: f64) -> u32 {
        let longest = self.longest_viscous(|model| !matches!(model, Model::Viscoplastic { .. }));
        (dt / longest).min(THICKEST).sqrt().floor() as u32
    }

    /// Whether a material's viscosity is part of the solve. That of thin liquids beside thicker ones is not, since the
    /// fixed-point sums of the solve have room for a limited range of compliances.
    pub(crate) fn solves_viscosity(&self, material: &Material) -> bool {
        match material.model {
            Model::Liquid => self.is_thick() && self.viscous_share(material) > 1.0 / 16.0,
            Model::Elastic { .. } => self.settings.scheme == Scheme::Implicit,
            _ => false,
        }
    }

    /// Whether a liquid can stick to something and is viscous enough for that to matter: an isolated particle loses at
    /// least a thousandth of its shear rate in a step.
    pub(crate) fn sticks(&self) -> bool {
        let viscous = self.has(|m| m.model == Model::Liquid && self.viscous_share(m) >= 1e-3);
        let holds = |c: &Collider| matches!(c.boundary, Boundary::Stick | Boundary::Fixed);
        let walls = self.domain.walls.sides().iter().any(|side| side.2 == Wall::Stick);
        viscous && self.settings.scheme != Scheme::Published && (walls || self.colliders.iter().any(holds))
    }

    /// Whether the implicit scheme solves for the viscosity of liquids.
    pub(crate) fn is_thick(&self) -> bool {
        let longest = self.longest_viscous(|model| model == Model::Liquid);
        self.settings.scheme == Scheme::Implicit && self.settings.dt > longest
    }

    /// Whether the solve begins with the stress carried over from the step before as its first direction of search,
    /// instead of predicting motion with it: where there are bodies, and matter that is much stiffer to shear than to
    /// pressure. The prediction would be far off, and it decides contact; beside the domain's sides that does no harm.
    pub(crate) fn resumes(&self) -> bool {
        self.stiff_to_shear() && !self.colliders.is_empty()
    }

    /// Whether the liquids of a block share a pressure besides those of their particles. Where the search begins with
    /// the stress carried over, motion is not predicted with it, and there is no shared pressure. The stiffness of
    /// particles holds them in place only under pressures up to about a tenth of it; beyond, all would boil.
    pub(crate) fn shares_pressure(&self) -> bool {
        let implicit = self.settings.scheme == Scheme::Implicit && self.liquids().next().is_some();
        let fall = self.gravity * (self.settings.dt.powi(2) / self.domain.cell_size);
        let held = Settings::bears(self.settings.stiffest(), self.deepest(), fall);
        self.settings.block_pressure && implicit && held && !self.resumes()
    }

    /// The largest number of cells of matter that may lie in a row along each axis: of the spawned matter, or of all
    /// that the domain has room for. If liquids differ in density it is all of the densest and weighed in cells of the
    /// lightest, which is the softest.
    pub(crate) fn deepest(&self) -> DVec3 {
        let more = !self.emitters.is_empty() || self.settings.capacity.is_some() || self.spawns.is_empty();
        let deepest = if more {
            self.domain.extent_cells()
        } else {
            DVec3::from_array(DVec3::AXES.map(|axis| depth_along(self, axis)))
        };
        deepest * self.contrast()
    }

    /// The density of the densest liquid over that of the lightest, 1 without liquids.
    pub(crate) fn contrast(&self) -> f64 {
        let (densest, lightest) = (self.densest_liquid(), self.lightest_liquid());
        if densest > 0.0 { densest / lightest } else { 1.0 }
    }

    /// The density of the densest liquid, kg/m³; 0 without liquids.
    pub(crate) fn densest_liquid(&self) -> f64 {
        self.liquids().map(|m| m.rest_density).fold(0.0, f64::max)
    }

    /// The density of the lightest liquid, kg/m³; infinite without liquids.
    pub(crate) fn lightest_liquid(&self) -> f64 {
        self.liquids().map(|m| m.rest_density).fold(f64::INFINITY, f64::min)
    }

    /// Whether the implicit scheme solves for so much viscosity that matter is much stiffer to shear than to pressure.
    fn stiff_to_shear(&self) -> bool {
        let longest = self.longest_viscous(|model| !matches!(model, Model::Viscoplastic { .. }));
        self.settings.scheme == Scheme::Implicit && self.settings.dt > STIFF_TO_SHEAR * longest
    }

    /// The share of its shear rate that an isolated particle loses in a step by viscosity.
    fn viscous_share(&self, material: &Material) -> f64 {
        let cell = self.domain.cell_size * self.domain.cell_size;
        8.0 * material.viscosity * self.settings.dt / (material.rest_density * cell)
    }

    fn longest_viscous(&self, counts: impl Fn(Model) -> bool) -> f64 {
        let cell = self.domain.cell_size * self.domain.cell_size;
        let viscous = self.taking_part().map(|(_, m)| m).filter(|m| m.viscosity > 0.0 && counts(m.model));
        viscous.map(|m| m.rest_density * cell / (8.0 * m.viscosity)).fold(f64::INFINITY, f64::min)
    }

    /// The longest step, s, in which the [implicit scheme](crate::Scheme::Implicit) can follow sound in the solids,
    /// which travels 2.8 cells in it, and the iterations that a step of `dt` needs for that. In longer steps or with
    /// fewer iterations solids count as softer than they are. Infinite and 0 without solids.
    pub fn followed_dt(&self, dt: f64) -> (f64, u32) {
        // Sound travels half a cell in the longest explicit step.
        let longest = 2.0 * SOLID_LIMIT.sqrt() * self.stable_dt();
        let sound = 0.5 * dt.min(longest) / self.stable_dt();
        (longest, (sound * (2.0 / SOLID_SHARE).sqrt()).ceil() as u32)
    }
}
