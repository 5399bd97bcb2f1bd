//! What the matter is made of.

use crate::error::{Check, Result};

/// A liquid of the published scheme.
///
/// `relaxation` and `viscous_relaxation` are the knobs of the published method: they act per iteration, so that the
/// stiffness and viscosity they amount to depend on time step, iterations and cell size. Far from convergence the
/// liquid carries sound at `c = Δx/(2 Δt) · √(relaxation · iterations / 3)`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Material {
    /// Name by which spawns refer to this material; unique in a world.
    pub name: String,
    /// Density at rest, kg/m³. Default 1000. Allowed 1e-3 … 1e5.
    #[cfg_attr(feature = "scene", serde(default = "default_density"))]
    pub rest_density: f64,
    /// Share of the volume error that one iteration takes off an isolated particle: 1 is a full correction, above 1
    /// over-relaxed. Default 1.5. Allowed 0 … 1.9 (at 2 an isolated particle no longer converges).
    #[cfg_attr(feature = "scene", serde(default = "default_relaxation"))]
    pub relaxation: f64,
    /// Share of the shear rate (deviatoric, symmetric part of the displacement gradient) that one iteration removes;
    /// amounts to a kinematic viscosity of `v Δx²/(8 Δt)` per iteration. Spin is untouched. Default 0. Allowed 0 … 1.
    #[cfg_attr(feature = "scene", serde(default))]
    pub viscous_relaxation: f64,
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
fn default_color() -> [f32; 3] {
    [0.10, 0.35, 0.80]
}

impl Material {
    /// A liquid with the defaults of every field.
    pub fn liquid(name: impl Into<String>) -> Self {
        Material {
            name: name.into(),
            rest_density: default_density(),
            relaxation: default_relaxation(),
            viscous_relaxation: 0.0,
            color: default_color(),
        }
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        check.that(!self.name.is_empty(), "name", &self.name, "a non-empty name")?;
        check.range("rest_density", self.rest_density, 1e-3, 1e5, "1e-3 to 1e5 kg/m³")?;
        check.range("relaxation", self.relaxation, 0.0, 1.9, "0 to 1.9")?;
        check.range("viscous_relaxation", self.viscous_relaxation, 0.0, 1.0, "0 to 1")?;
        let color_ok = self.color.iter().all(|c| (0.0..=1.0).contains(c));
        check.that(color_ok, "color", self.color, "three numbers from 0 to 1")
    }
}
