//! The domain: the box in which matter can be, and what its six sides are.

use crate::bins::EDGE;
use crate::collider::Boundary;
use crate::error::{Check, Result};
use crate::shape::MAX_LENGTH;
use crate::spawn::Seed;
use glam::DVec3;

/// The most grid cells along one axis of a domain (10 bits of a block key, 4 cells a block, a margin on both sides).
pub const MAX_CELLS_PER_AXIS: f64 = 4080.0;

/// How far outside of the domain a particle may be spawned, in cells: on a face that the two share.
const ROUNDING: f64 = 1e-9;

/// Blocks between periodic sides, so that those on either side of a block differ.
const LEAST_BLOCKS: f64 = 3.0;

/// How far the length between periodic sides may be off a whole number of blocks, in blocks: rounding of decimals.
const PERIOD_ROUNDING: f64 = 1e-7;

/// One side of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum Wall {
    /// A frictionless wall.
    #[default]
    Slip,
    /// A wall with this Coulomb coefficient, 0 … 10.
    Friction(f64),
    /// A wall that matter in contact sticks to (no slip), see [`Boundary::Stick`].
    Stick,
    /// No wall: a particle that crosses it is deleted and counted in
    /// [`Faults::escaped`](crate::Faults::escaped).
    Open,
    /// No wall: a particle that crosses it enters on the opposite side, which is periodic as well; see the domain.
    Periodic,
}

impl Wall {
    /// The surface of a closed side; `None` for an open or a periodic one.
    pub fn boundary(self) -> Option<Boundary> {
        match self {
            Wall::Slip => Some(Boundary::Slip),
            Wall::Friction(mu) => Some(Boundary::Friction(mu)),
            Wall::Stick => Some(Boundary::Stick),
            Wall::Open | Wall::Periodic => None,
        }
    }
}

/// The six sides of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct Walls {
    /// Side at the smallest x.
    pub x_min: Wall,
    /// Side at the largest x.
    pub x_max: Wall,
    /// Floor.
    pub y_min: Wall,
    /// Ceiling.
    pub y_max: Wall,
    /// Side at the smallest z.
    pub z_min: Wall,
    /// Side at the largest z.
    pub z_max: Wall,
}

impl Walls {
    /// All six sides alike.
    pub fn all(wall: Wall) -> Self {
        Walls { x_min: wall, x_max: wall, y_min: wall, y_max: wall, z_min: wall, z_max: wall }
    }

    /// The lower or upper side of an axis.
    fn of(&self, axis: usize, upper: bool) -> Wall {
        self.sides()[2 * axis + usize::from(upper)].2
    }

    /// With axis (0 … 2) and whether it is the upper side, in a fixed order.
    pub(crate) fn sides(&self) -> [(usize, bool, Wall, &'static str); 6] {
        [
            (0, false, self.x_min, "x_min"),
            (0, true, self.x_max, "x_max"),
            (1, false, self.y_min, "y_min"),
            (1, true, self.y_max, "y_max"),
            (2, false, self.z_min, "z_min"),
            (2, true, self.z_max, "z_max"),
        ]
    }
}

/// The box in which matter can be. Grid nodes lie at `min + i · cell_size`; empty space costs nothing, so that the
/// domain may be far larger than the matter.
///
/// Between periodic sides it is a multiple of four cells long, 12 at least, and the nodes lie half a cell further along
/// that axis. Matter continues across these sides; colliders, drains, sensors and tools are where they are stated and
/// nowhere else, so what should continue reaches two cells beyond both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Domain {
    /// Lower corner, m.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub min: DVec3,
    /// Upper corner, m. Need not be a whole number of cells away, but liquids come to rest best where it is.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub max: DVec3,
    /// Edge of a grid cell, m. 1e-5 … 1e4, and so long that no axis of the domain has more than 4080 cells.
    pub cell_size: f64,
    /// What the six sides are. Default: slip walls.
    #[cfg_attr(feature = "scene", serde(default))]
    pub walls: Walls,
}

impl Domain {
    /// Edges in cells.
    pub fn extent_cells(&self) -> DVec3 {
        (self.max - self.min) / self.cell_size
    }

    /// Whole cells along each axis that cover the box.
    pub fn cells(&self) -> glam::UVec3 {
        (self.extent_cells() - 1e-6).ceil().max(DVec3::ONE).as_uvec3()
    }

    /// Lengths along the axes after which matter is repeated, in cells; 0 where it is not.
    pub(crate) fn period_cells(&self) -> DVec3 {
        let extent = self.extent_cells();
        let period = |axis| if self.walls.of(axis, false) == Wall::Periodic { extent[axis].round() } else { 0.0 };
        DVec3::new(period(0), period(1), period(2))
    }

    /// A particle that `spawn` makes, on the side beyond which it lies by no more than rounding; fails where it is
    /// outside.
    pub(crate) fn inside(&self, spawn: &str, seed: Seed) -> Result<Seed> {
        let position = seed.position.clamp(self.min, self.max);
        let inside = position.distance(seed.position) <= ROUNDING * self.cell_size;
        let allowed = "a region whose particles all lie inside the domain";
        Check { path: "" }.that(inside, spawn, seed.position.to_array(), allowed)?;
        Ok(Seed { position, ..seed })
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        check.range("cell_size", self.cell_size, 1e-5, 1e4, "1e-5 to 1e4 m")?;
        check.vector("min", self.min, MAX_LENGTH, "finite, at most 1e6 m")?;
        check.vector("max", self.max, MAX_LENGTH, "finite, at most 1e6 m")?;
        let extent = self.extent_cells();
        check.that(
            extent.min_element() >= 1.0,
            "max",
            self.max.to_array(),
            "at least one cell above `min` on each axis",
        )?;
        check.that(
            // A quotient of decimal fractions may come out a little above the whole number that was meant.
            extent.max_element() <= MAX_CELLS_PER_AXIS + 1e-6,
            "cell_size",
            self.cell_size,
            "large enough for at most 4080 cells along each axis of the domain",
        )?;
        for (axis, upper, wall, name) in self.walls.sides() {
            let periodic = |wall| wall == Wall::Periodic;
            let opposite = self.walls.of(axis, !upper);
            let allowed = "periodic if and only if the opposite side is";
            check.that(periodic(wall) == periodic(opposite), &format!("walls.{name}"), wall, allowed)?;
            let blocks = extent[axis] / EDGE as f64;
            let whole = blocks > LEAST_BLOCKS - PERIOD_ROUNDING && (blocks - blocks.round()).abs() <= PERIOD_ROUNDING;
            let allowed = "a multiple of four cells, 12 at least, above `min` between periodic sides";
            check.that(!periodic(wall) || whole, "max", self.max.to_array(), allowed)?;
            if let Some(boundary) = wall.boundary() {
                boundary.validate(&check, &format!("walls.{name}"))?;
            }
        }
        Ok(())
    }
}
