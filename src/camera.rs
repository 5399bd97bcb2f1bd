//! The viewpoint for pictures of a world.

use crate::domain::Domain;
use crate::error::{Check, Result};
use crate::shape::MAX_LENGTH;
use glam::DVec3;

/// The viewpoint for a picture of the world.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Camera {
    /// Eye, m.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Point in the middle of the picture, m.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub target: DVec3,
    /// Vertical field of view, degrees. Default 60. Allowed 1 … 170.
    #[cfg_attr(feature = "scene", serde(default = "default_fov"))]
    pub vertical_fov: f64,
}

#[cfg(feature = "scene")]
fn default_fov() -> f64 {
    60.0
}

impl Camera {
    /// Looks at the whole of `domain` from above one corner.
    pub fn overlooking(domain: &Domain) -> Self {
        let (centre, half) = ((domain.min + domain.max) * 0.5, (domain.max - domain.min) * 0.5);
        let away = DVec3::new(0.35, 0.35, 0.9).normalize();
        let right = DVec3::Y.cross(away).normalize();
        let up = away.cross(right);
        let vertical_fov: f64 = 45.0;
        let slope = (0.5 * vertical_fov).to_radians().tan();
        // The distance from which each corner is in sight, in a picture that is no higher than wide.
        let needed = (0..8).map(|i| {
            let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half * DVec3::new(sign(0), sign(1), sign(2));
            corner.dot(right).abs().max(corner.dot(up).abs()) / slope + corner.dot(away)
        });
        let distance = needed.fold(0.0, f64::max) * 1.02;
        Camera { position: centre + away * distance, target: centre, vertical_fov }
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        check.vector("position", self.position, MAX_LENGTH, "finite, at most 1e6 m")?;
        check.vector("target", self.target, MAX_LENGTH, "finite, at most 1e6 m")?;
        check.range("vertical_fov", self.vertical_fov, 1.0, 170.0, "1 to 170 degrees")?;
        check.that(self.position != self.target, "target", self.target.to_array(), "another point than `position`")
    }
}
