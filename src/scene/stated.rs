//! Settings as a scene states them: what it leaves out is chosen by a quality, realtime unless it states another, or
//! has its default.

use crate::quality::Quality;
use crate::settings::{Scheme, Settings, Sleep};
use crate::world::World;
use serde::{Deserialize, Deserializer};

/// What a quality chooses.
pub(super) const CHOSEN: [&str; 9] = [
    "dt",
    "scheme",
    "iterations",
    "tolerance",
    "bulk_limit",
    "block_pressure",
    "sharpen",
    "courant",
    "volume_correction_time",
];

/// The object `settings` of a scene.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Stated {
    #[serde(deserialize_with = "given")]
    quality: Option<Quality>,
    #[serde(deserialize_with = "given")]
    dt: Option<f64>,
    #[serde(deserialize_with = "given")]
    scheme: Option<Scheme>,
    #[serde(deserialize_with = "given")]
    iterations: Option<u32>,
    #[serde(deserialize_with = "given")]
    tolerance: Option<f64>,
    bulk_limit: Option<f64>,
    #[serde(deserialize_with = "given")]
    block_pressure: Option<bool>,
    #[serde(deserialize_with = "given")]
    sharpen: Option<bool>,
    #[serde(deserialize_with = "given")]
    courant: Option<f64>,
    #[serde(deserialize_with = "given")]
    max_displacement: Option<f64>,
    #[serde(deserialize_with = "given")]
    max_fill: Option<f64>,
    #[serde(deserialize_with = "given")]
    volume_correction_time: Option<f64>,
    #[serde(deserialize_with = "given")]
    tension_limit: Option<f64>,
    capacity: Option<u32>,
    sleep: Option<Sleep>,
}

/// A value that may be left out, but is not `null`.
fn given<'de, D: Deserializer<'de>, T: Deserialize<'de>>(reader: D) -> Result<Option<T>, D::Error> {
    T::deserialize(reader).map(Some)
}

impl Stated {
    /// Settles the settings of `world`, whose meshes are built.
    pub fn settle(self, world: &mut World) {
        // What is chosen depends on these two.
        world.settings.capacity = self.capacity;
        world.settings.max_displacement = self.max_displacement.unwrap_or(world.settings.max_displacement);
        let scheme = self.scheme.unwrap_or_else(|| Scheme::suited_to(world));
        // A step that is stated, and no quality, is that of every step.
        let fixed = self.dt.is_some() && self.quality.is_none();
        // Who states what iterations follow, or a step bears, has liquids as stiff as that.
        let iterated = scheme == Scheme::Implicit && self.iterations.is_some();
        let by_hand = fixed || iterated && self.quality.is_none();
        let quality = self.quality.unwrap_or(Quality::Realtime);
        let chosen = match self.block_pressure {
            Some(false) => quality.settings_for(scheme, world, false),
            _ => quality.settings_in(scheme, world),
        };
        let dt = self.dt.unwrap_or(chosen.dt);
        let stiff = if by_hand { None } else { quality.stiffness(scheme, world, dt) };
        world.settings = Settings {
            dt,
            scheme,
            iterations: self.iterations.unwrap_or(chosen.iterations),
            tolerance: self.tolerance.unwrap_or(chosen.tolerance),
            bulk_limit: self.bulk_limit.or(stiff),
            block_pressure: self.block_pressure.unwrap_or(chosen.block_pressure),
            sharpen: self.sharpen.unwrap_or(chosen.sharpen),
            courant: self.courant.unwrap_or(if fixed { 0.0 } else { chosen.courant }),
            max_displacement: world.settings.max_displacement,
            max_fill: self.max_fill.unwrap_or(chosen.max_fill),
            volume_correction_time: self.volume_correction_time.unwrap_or(if fixed {
                world.settings.volume_correction_time
            } else {
                chosen.volume_correction_time
            }),
            tension_limit: self.tension_limit.unwrap_or(chosen.tension_limit),
            capacity: world.settings.capacity,
            sleep: self.sleep,
        };
    }
}
