//! Which of a world's materials take part, and what those that do ask of steps.

use super::{Wall, World};
use crate::collider::{Boundary, Collider};
use crate::material::{Material, Model};
use crate::quality::depth_along;
use crate::settings::{Scheme, Settings};
use crate::stages::compliance::{SOLID_LIMIT, SOLID_SHARE, THICKEST};
use glam::DVec3;

/// How many times as viscous as takes all shear from a particle by itself matter is that contact is not to be decided by its pressure: twice what
/// liquids are as stiff as to pressure at most. Below, pools beneath slanting walls rest ten times as quietly if it is.
const STIFF_TO_SHEAR: f64 = 64.0;

impl World {
    /// Whether a material takes part: a spawn or an emitter names it, or hosts may add any, as [`Settings::capacity`](crate::Settings::capacity)
    /// is stated. Of what takes no part nothing is stored, compiled or asked of steps. Where nothing is spawned or emitted, all do.
    pub(crate) fn takes_part(&self, material: &Material) -> bool {
        let spawned = self.spawns.iter().map(|spawn| &spawn.material);
        let mut named = spawned.chain(self.emitters.iter().map(|emitter| &emitter.material)).peekable();
        self.settings.capacity.is_some() || named.peek().is_none() || named.any(|name| *name == material.name)
    }

    /// The materials that take part, with their indices.
    pub(crate) fn taking_part(&self) -> impl Iterator<Item = (usize, &Material)> {
        self.materials.iter().enumerate().filter(|(_, material)| self.takes_part(material))
    }

    /// Whether one of these is such.
    pub(crate) fn has(&self, such: impl Fn(&Material) -> bool) -> bool {
        self.taking_part().any(|(_, material)| such(material))
    }

    /// The longest step that the world's solids bear in the explicit scheme, s: the shortest of its materials'
    /// [`Material::stable_dt`]; infinite without solids.
    pub fn stable_dt(&self) -> f64 {
        let cell_size = self.domain.cell_size;
        self.taking_part().map(|(_, m)| m.stable_dt(cell_size)).fold(f64::INFINITY, f64::min)
    }

    /// The longest step, s, in which a scheme takes all matter for as viscous as it is; in longer ones it is as much less viscous. Infinite
    /// without viscosity.
    ///
    /// In the explicit scheme ρ Δx²/(8 η) of the most viscous, since a particle can lose no more than all of its shear rate. In the implicit one
    /// that of the most viscous viscoplastic matter, and 1024 times that of the most viscous liquid and elastic matter, whose viscosity it
    /// solves for (that of liquids only where [`Settings::dt`](crate::Settings::dt) is longer than ρ Δx²/(8 η) of one of them). In the
    /// published scheme, which knows [`Material::viscous_relaxation`] only, infinite.
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

    /// The iterations that a step of `dt` of the [implicit scheme](crate::Scheme::Implicit) needs to stop in one go what is as viscous as
    /// the most viscous matter: the root of 8 η Δt/(ρ Δx²), by experience. With fewer, thick matter bursts where it falls on a floor; what
    /// flows slowly needs but few, since stresses are brought along. 0 without viscosity that is solved for.
    pub fn viscous_iterations(&self, dt: f64) -> u32 {
        let longest = self.longest_viscous(|model| !matches!(model, Model::Viscoplastic { .. }));
        (dt / longest).min(THICKEST).sqrt().floor() as u32
    }

    /// Whether the solve takes care of a material's viscosity; not of what is thin beside thicker liquids, as the fixed-point sums of the solve
    /// have room for but so many orders of compliance.
    pub(crate) fn solves_viscosity(&self, material: &Material) -> bool {
        match material.model {
            Model::Liquid => self.is_thick() && self.viscous_share(material) > 1.0 / 16.0,
            Model::Elastic { .. } => self.settings.scheme == Scheme::Implicit,
            _ => false,
        }
    }

    /// Whether a liquid sticks to something and is viscous enough for that to matter: in a step it loses a thousandth of its shear by itself.
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

    /// Whether the solve begins with what shear stress there was in the step before as its first direction of search, not as what motion is
    /// predicted with: where viscosity that it solves for takes all shear from a liquid's particle by itself. Contact would be decided by a
    /// prediction that is far off. Rubber that is no more viscous than that bears its load by elasticity.
    pub(crate) fn resumes(&self) -> bool {
        self.is_thick() || self.resumes_pressure()
    }

    /// Whether the liquids of a block share a pressure beside those of their particles. It is one per mass, and its stiffness is
    /// one, for which liquids have to be alike in density and modulus. What begins its search with what was brought along does not predict motion
    /// with it. What particles answer with holds them in place under some tenth of it; beyond, all would boil.
    pub(crate) fn shares_pressure(&self) -> bool {
        let mut liquids = self.taking_part().map(|(_, m)| m).filter(|m| m.model == Model::Liquid);
        let of = |m: &Material| (m.rest_density, m.bulk_modulus);
        let alike = liquids.next().map(of).is_some_and(|first| liquids.all(|m| of(m) == first));
        let implicit = self.settings.scheme == Scheme::Implicit && alike;
        let fall = self.gravity * (self.settings.dt.powi(2) / self.domain.cell_size);
        let held = Settings::bears(self.settings.stiffest(), self.deepest(), fall);
        self.settings.block_pressure && implicit && held && !self.resumes()
    }

    /// Along each axis the cells of matter that may come to lie beside each other: of what is spawned, or of all that there is room for.
    pub(crate) fn deepest(&self) -> DVec3 {
        let more = !self.emitters.is_empty() || self.settings.capacity.is_some() || self.spawns.is_empty();
        if more {
            return self.domain.extent_cells();
        }
        DVec3::from_array(DVec3::AXES.map(|axis| depth_along(self, axis)))
    }

    /// Whether with its pressure, which is far off as well where matter is stiffer to shear than to that.
    pub(crate) fn resumes_pressure(&self) -> bool {
        let longest = self.longest_viscous(|model| !matches!(model, Model::Viscoplastic { .. }));
        self.settings.scheme == Scheme::Implicit && self.settings.dt > STIFF_TO_SHEAR * longest
    }

    /// The share of its shear that viscosity takes from a particle by itself in a step.
    fn viscous_share(&self, material: &Material) -> f64 {
        let cell = self.domain.cell_size * self.domain.cell_size;
        8.0 * material.viscosity * self.settings.dt / (material.rest_density * cell)
    }

    fn longest_viscous(&self, counts: impl Fn(Model) -> bool) -> f64 {
        let cell = self.domain.cell_size * self.domain.cell_size;
        let viscous = self.taking_part().map(|(_, m)| m).filter(|m| m.viscosity > 0.0 && counts(m.model));
        viscous.map(|m| m.rest_density * cell / (8.0 * m.viscosity)).fold(f64::INFINITY, f64::min)
    }

    /// The longest step, s, in which the [implicit scheme](crate::Scheme::Implicit) follows the sound of the solids, which travels 2.8
    /// cells in it, and the iterations that a step of `dt` needs for that. Of longer steps or with fewer iterations the solids are taken
    /// for softer than they are. Infinite and 0 without solids.
    pub fn followed_dt(&self, dt: f64) -> (f64, u32) {
        // Half a cell in the longest explicit step.
        let longest = 2.0 * SOLID_LIMIT.sqrt() * self.stable_dt();
        let sound = 0.5 * dt.min(longest) / self.stable_dt();
        (longest, (sound * (2.0 / SOLID_SHARE).sqrt()).ceil() as u32)
    }
}
