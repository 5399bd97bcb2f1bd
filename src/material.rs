//! What the matter is made of.

use crate::error::{Check, Result};

/// Cells that sound may travel in a step of the explicit scheme. At 1/√3 an isolated particle oscillates about its
/// volume without decay; the rest is margin.
pub(crate) const COURANT: f64 = 0.5;

/// How matter responds to deformation.
///
/// The models of the published scheme, in three dimensions: each names the deformation that an iteration steers back
/// to. Their formulas are in `docs/method.md`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum Model {
    /// Keeps its volume, not its shape. Particles carry a volume ratio in place of a deformation gradient.
    #[default]
    Liquid,
    /// Returns to its shape (corotated): the target is the nearest rotation.
    Elastic {
        /// Weight of the shape against the volume in the target: 1 steers to the nearest rotation, 0 to the deformation
        /// itself at its volume at rest. 0 … 1, default 1. (`elasticityRatio` of the reference.)
        #[cfg_attr(feature = "scene", serde(default = "one"))]
        shape_weight: f64,
    },
    /// Grains without cohesion (Drucker–Prager): elastic under pressure, up to a shear stress of the tangent of the
    /// friction angle times the pressure; free to come apart.
    Sand {
        /// Angle of internal friction as Mohr and Coulomb mean it, degrees: a slope or a rough incline steeper than
        /// this gives way. 0 … 60, default 30.
        #[cfg_attr(feature = "scene", serde(default = "default_friction_angle"))]
        friction_angle: f64,
    },
    /// Elastic up to a shear strain, beyond which it flows at constant volume (von Mises): clay, dough, foam.
    Viscoplastic {
        /// Logarithmic strain at which pure shear yields: a stretch of `e^y` along one axis and `e^−y` across. 0 … 2,
        /// default 0.05. (The reference's `plasticity` p is 1 − y.)
        #[cfg_attr(feature = "scene", serde(default = "default_yield_strain"))]
        yield_strain: f64,
    },
}

#[cfg(feature = "scene")]
fn one() -> f64 {
    1.0
}
#[cfg(feature = "scene")]
fn default_friction_angle() -> f64 {
    30.0
}
#[cfg(feature = "scene")]
fn default_yield_strain() -> f64 {
    0.05
}

impl Model {
    fn validate(self, check: &Check<'_>) -> Result<()> {
        match self {
            Model::Liquid => Ok(()),
            Model::Elastic { shape_weight } => {
                check.range("model.elastic.shape_weight", shape_weight, 0.0, 1.0, "0 to 1")
            }
            Model::Sand { friction_angle } => {
                check.range("model.sand.friction_angle", friction_angle, 0.0, 60.0, "0 to 60 degrees")
            }
            Model::Viscoplastic { yield_strain } => {
                check.range("model.viscoplastic.yield_strain", yield_strain, 0.0, 2.0, "0 to 2")
            }
        }
    }
}

/// A material.
///
/// `relaxation` and `viscous_relaxation` are the knobs of the published method: they act per iteration, so that the
/// stiffness and viscosity they amount to depend on time step, iterations and cell size. Far from convergence a liquid
/// carries sound at `c = Δx/(2 Δt) · √(relaxation · iterations / 3)`, and a solid has a shear modulus of about
/// `relaxation · iterations · ρ (Δx/Δt)²/8`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Material {
    /// Name by which spawns refer to this material; unique in a world.
    pub name: String,
    /// Density at rest, kg/m³. Default 1000. Allowed 1e-3 … 1e5.
    #[cfg_attr(feature = "scene", serde(default = "default_density"))]
    pub rest_density: f64,
    /// How it responds to deformation. Default liquid.
    #[cfg_attr(feature = "scene", serde(default))]
    pub model: Model,
    /// Share of the error (of volume, or of a solid's elastic strain) that one iteration removes from an isolated
    /// particle: 1 is a full correction, above 1 over-relaxed. Default 1.5. Allowed 0 … 1.9 (at 2 an isolated particle
    /// no longer converges).
    #[cfg_attr(feature = "scene", serde(default = "default_relaxation"))]
    pub relaxation: f64,
    /// Share of the shear rate (deviatoric, symmetric part of the displacement gradient) that one iteration removes;
    /// amounts to a kinematic viscosity of `v Δx²/(8 Δt)` per iteration. Spin is untouched. Default 0. Allowed 0 … 1.
    #[cfg_attr(feature = "scene", serde(default))]
    pub viscous_relaxation: f64,
    /// Of liquids in the implicit and the explicit scheme: bulk modulus, the pressure per relative loss of volume, Pa.
    /// Default 2.2e9, that of water. It is limited by [`Settings::bulk_limit`](crate::Settings::bulk_limit); in the
    /// implicit scheme also by [`Settings::iterations`](crate::Settings::iterations), in the explicit one to a sound of
    /// half a cell to a cell per step. Allowed 1e-3 … 1e12.
    #[cfg_attr(feature = "scene", serde(default = "default_bulk_modulus"))]
    pub bulk_modulus: f64,
    /// In the implicit and the explicit scheme: dynamic viscosity, Pa s. In steps longer than
    /// [`World::viscous_dt`](crate::World::viscous_dt) it is limited: to ρ Δx²/(8 Δt) in the explicit scheme and for
    /// viscoplastic matter, to 128 ρ Δx²/Δt otherwise. Default 0. Allowed 0 … 1e9.
    #[cfg_attr(feature = "scene", serde(default))]
    pub viscosity: f64,
    /// Of solids in the implicit and the explicit scheme: Young's modulus, Pa. Default 1e5, that of soft rubber or
    /// gelatine. Allowed 1e-3 … 1e12.
    #[cfg_attr(feature = "scene", serde(default = "default_youngs_modulus"))]
    pub youngs_modulus: f64,
    /// Of solids in the implicit and the explicit scheme: Poisson's ratio. Default 0.3. Allowed 0 … 0.499.
    #[cfg_attr(feature = "scene", serde(default = "default_poisson_ratio"))]
    pub poisson_ratio: f64,
    /// Of viscoplastic solids in the implicit and the explicit scheme: shear stress at which they flow, Pa. Default: 2μ
    /// y, with the model's yield strain y and the shear modulus μ. Allowed 0 … 1e12.
    #[cfg_attr(feature = "scene", serde(default, skip_serializing_if = "Option::is_none"))]
    pub yield_stress: Option<f64>,
    /// Colour for drawing, linear red, green, blue in 0 … 1.
    #[cfg_attr(feature = "scene", serde(default = "default_color"))]
    pub color: [f32; 3],
}

fn default_density() -> f64 {
    1000.0
}
fn default_relaxation() -> f64 {
    1.5
}
fn default_bulk_modulus() -> f64 {
    2.2e9
}
fn default_youngs_modulus() -> f64 {
    1e5
}
fn default_poisson_ratio() -> f64 {
    0.3
}
fn default_color() -> [f32; 3] {
    [0.10, 0.35, 0.80]
}

impl Material {
    /// A liquid with the defaults of every field.
    pub fn liquid(name: impl Into<String>) -> Self {
        Material {
            name: name.into(),
            rest_density: default_density(),
            model: Model::Liquid,
            relaxation: default_relaxation(),
            viscous_relaxation: 0.0,
            bulk_modulus: default_bulk_modulus(),
            viscosity: 0.0,
            youngs_modulus: default_youngs_modulus(),
            poisson_ratio: default_poisson_ratio(),
            yield_stress: None,
            color: default_color(),
        }
    }

    /// An elastic solid with the defaults of every field.
    pub fn elastic(name: impl Into<String>) -> Self {
        Material { model: Model::Elastic { shape_weight: 1.0 }, ..Material::liquid(name) }
    }

    /// Sand with this angle of internal friction, degrees, of 1600 kg/m³, and the defaults of every other field.
    pub fn sand(name: impl Into<String>, friction_angle: f64) -> Self {
        Material { model: Model::Sand { friction_angle }, rest_density: 1600.0, ..Material::liquid(name) }
    }

    /// A viscoplastic solid that yields at this logarithmic strain in pure shear, with the defaults of every other
    /// field.
    pub fn viscoplastic(name: impl Into<String>, yield_strain: f64) -> Self {
        Material { model: Model::Viscoplastic { yield_strain }, ..Material::liquid(name) }
    }

    /// Bulk and shear modulus, Pa.
    pub(crate) fn moduli(&self) -> [f64; 2] {
        if self.model == Model::Liquid {
            return [self.bulk_modulus, 0.0];
        }
        let (young, poisson) = (self.youngs_modulus, self.poisson_ratio);
        [young / (3.0 * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))]
    }

    /// The longest step of the explicit scheme, s, on cells of `cell_size` m: sound, whose speed in a solid is √((K +
    /// 4μ/3)/ρ), travels half a cell in it. Infinite for liquids.
    pub fn stable_dt(&self, cell_size: f64) -> f64 {
        if self.model == Model::Liquid {
            return f64::INFINITY;
        }
        COURANT * cell_size * (self.rest_density / self.wave_modulus()).sqrt()
    }

    /// Speed of sound, m/s.
    pub(crate) fn sound(&self) -> f64 {
        (self.wave_modulus() / self.rest_density).sqrt()
    }

    /// K + 4μ/3, Pa.
    fn wave_modulus(&self) -> f64 {
        let [bulk, shear] = self.moduli();
        bulk + 4.0 / 3.0 * shear
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        check.that(!self.name.is_empty(), "name", &self.name, "a non-empty name")?;
        check.range("rest_density", self.rest_density, 1e-3, 1e5, "1e-3 to 1e5 kg/m³")?;
        check.range("relaxation", self.relaxation, 0.0, 1.9, "0 to 1.9")?;
        check.range("viscous_relaxation", self.viscous_relaxation, 0.0, 1.0, "0 to 1")?;
        check.range("bulk_modulus", self.bulk_modulus, 1e-3, 1e12, "1e-3 to 1e12 Pa")?;
        check.range("viscosity", self.viscosity, 0.0, 1e9, "0 to 1e9 Pa s")?;
        check.range("youngs_modulus", self.youngs_modulus, 1e-3, 1e12, "1e-3 to 1e12 Pa")?;
        check.range("poisson_ratio", self.poisson_ratio, 0.0, 0.499, "0 to 0.499")?;
        if let Some(stress) = self.yield_stress {
            check.range("yield_stress", stress, 0.0, 1e12, "0 to 1e12 Pa")?;
        }
        self.model.validate(&check)?;
        let color_ok = self.color.iter().all(|c| (0.0..=1.0).contains(c));
        check.that(color_ok, "color", self.color, "three numbers from 0 to 1")
    }
}
