//! Settings for a requested quality, in place of a step and iterations.

use crate::collider::Collider;
use crate::emitter::Emitter;
use crate::material::{COURANT, Material, Model};
use crate::settings::{SHORTEST, Scheme, Settings};
use crate::shape::{Shape, unit};
use crate::stages::stress::FIRMEST;
use crate::world::World;
use glam::{DQuat, DVec3};

/// How good a simulation should be, from which its settings follow. `docs/accuracy.md` says what each quality gives.
///
/// ```
/// use pbmpm::{DVec3, Material, Quality, Scheme, World};
///
/// let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.02);
/// world.materials.push(Material::liquid("water"));
/// world.settings = Quality::Realtime.settings(&world);
/// assert_eq!((world.settings.scheme, world.settings.dt), (Scheme::Implicit, 1.0 / 300.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case"))]
pub enum Quality {
    /// As little as holds together.
    Draft,
    /// What a game can afford.
    Realtime,
    /// What a film can afford.
    Accurate,
}

/// Steps for cells of [`CELL`], under [`GRAVITY`], with matter up to [`DEPTH`] or [`DEPTH_SHARED`] deep.
struct Preset {
    hertz: f64,
    iterations: u32,
    /// Of the implicit scheme.
    tolerance: Option<f64>,
}

/// Edge of the cells that presets are written down for, m.
const CELL: f64 = 0.02;
/// Gravity that they are written down for, m/s².
const GRAVITY: f64 = 9.81;
/// Depth of liquid, cells, for which they are stiff enough; and the same where the liquids of a block share a pressure.
const DEPTH: f64 = 32.0;
const DEPTH_SHARED: f64 = 64.0;
/// The longest step, s, however large the cells and weak the gravity: bodies, tools and emitters act once per step.
const LONGEST: f64 = 1.0 / 30.0;

/// The time constant of the volume correction on these cells, under this gravity, s; and the largest multiple of it, as
/// of steps.
const CORRECTION_TIME: f64 = 0.05;
const SLOWEST: f64 = 10.0;

/// The largest factor by which viscosity shortens steps.
const MOST_VISCOUS: f64 = 16.0;

/// The largest factor by which liquids of several densities raise iterations.
const MOST_RAISED: f64 = 2.0;

/// Kinematic viscosities of liquids, in cells² per step, between which transfers to the grid and back make a noticeable
/// difference: they add 0.11 k² of it to waves of wavenumber k per cell, as much as the least for waves 47 cells long,
/// and a hundredth of the largest for waves 15 cells long.
const BLURRED: [f64; 2] = [2e-3, 2.0];

/// The square of the time that gravity takes to move matter by a cell, over that on [`CELL`] and under [`GRAVITY`].
fn slowness(world: &World) -> f64 {
    world.domain.cell_size / CELL * (GRAVITY / world.gravity.length())
}

/// The time constant of the volume correction, s: a step is the same share of it on any scale.
fn correction_time(world: &World) -> f64 {
    let slower = if world.gravity == DVec3::ZERO { 1.0 } else { slowness(world).sqrt() };
    CORRECTION_TIME * slower.clamp(1e-2, SLOWEST)
}

impl Scheme {
    /// The scheme that suits a world: the implicit one where there are liquids, if it takes the other materials as
    /// well, else the explicit one, the only other whose stiffness is the materials'.
    ///
    /// Liquids: at realtime the implicit scheme loses a quarter as much of a column's height as the explicit one (0.5
    /// and 2.0 % of 32 cells) in half again the time, and as much in equal time. It has a third to two thirds of the
    /// explicit scheme's damping, at accurate a quarter, as steps damp and iterations do not. At draft the explicit
    /// scheme would lose half as much.
    ///
    /// Solids: for each cell that sound travels, the implicit scheme needs 2.8 iterations ([`World::followed_dt`]); the
    /// explicit one needs 2 steps and damps less. The implicit scheme is worth that where it serves a liquid beside
    /// them.
    #[must_use]
    pub fn suited_to(world: &World) -> Scheme {
        let liquid = world.materials.is_empty() || world.has(|m| m.model == Model::Liquid);
        let implicit = liquid && !world.has(|m| !Scheme::Implicit.takes(m.model));
        if implicit { Scheme::Implicit } else { Scheme::Explicit }
    }
}

impl Quality {
    /// The settings of this quality for a world, in the scheme that [suits](Scheme::suited_to) it. Settings that affect
    /// neither accuracy nor cost stay as the world has them. They follow from all else in the world, gravity and a
    /// stated [`capacity`](Settings::capacity) included: ask for them last.
    #[must_use]
    pub fn settings(self, world: &World) -> Settings {
        self.settings_in(Scheme::suited_to(world), world)
    }

    /// The same in a given scheme, which may not support the world's materials.
    ///
    /// The step is proportional to the root of cell size over gravity, so that gravity moves matter by the same number
    /// of cells per step on any scale. Where the matter at the start is more than 32 cells deep (64 with shared
    /// pressures), the step is also inversely proportional to the root of that depth: the share of its height that a
    /// liquid loses then stays the same (more iterations would not achieve that, see `docs/accuracy.md`). Under any
    /// gravity, and without, the step is at most 1/30 s and moves nothing that is spawned or emitted farther than
    /// [`courant`](Settings::courant) (less in the schemes whose stiffness comes from short steps), and no body farther
    /// than three quarters of [`max_displacement`](Settings::max_displacement), lest it pass matter by. In the explicit
    /// scheme it is at most a [share](Self::stable_share) of the longest step that is stable for solids. With solids
    /// the implicit scheme gets steps and iterations that resolve their sound ([`World::followed_dt`]). Viscosity is
    /// resolved as well ([`World::viscous_dt`], [`World::viscous_iterations`]), by up to 16 times as many steps; matter
    /// that is more viscous than that is treated as less viscous.
    ///
    /// Except in drafts, liquids of the implicit scheme share a pressure per block where they can
    /// ([`Settings::block_pressure`]). Where liquids of several densities cannot, they get up to twice the iterations.
    ///
    /// Where transfers to the grid and back would noticeably add to the viscosity of a liquid, realtime
    /// [sharpens](Settings::sharpen), as the accurate quality always does: from ν = 0.002 to 2 Δx²/Δt, 0.24 to 240 Pa s
    /// for a liquid as dense as water on cells of 2 cm.
    ///
    /// The [`Settings::volume_correction_time`] is proportional to the same root, up to half a second; without gravity
    /// it is 0.05 s.
    ///
    /// Liquids get a [`Settings::bulk_limit`], so that iterations and shorter steps do not make them stiffer than is
    /// useful. In the implicit scheme it follows from the height from which matter can fall within the domain and from
    /// the initial speeds. In the explicit one it is what is stable in steps as long as gravity, depth and motion
    /// allow, without regard to solids and viscosity.
    #[must_use]
    pub fn settings_in(self, scheme: Scheme, world: &World) -> Settings {
        let alone = self.settings_for(scheme, world, false);
        if self.shares(scheme) {
            let shared = self.settings_for(scheme, world, true);
            let stiffer = Settings { iterations: alone.iterations.max(shared.iterations), ..shared.clone() };
            for settings in [shared, stiffer] {
                let sharing = World { settings, ..world.clone() };
                if sharing.shares_pressure() {
                    return sharing.settings;
                }
            }
        }
        alone
    }

    /// The same for a stated [`Settings::block_pressure`].
    pub(crate) fn settings_for(self, scheme: Scheme, world: &World, block_pressure: bool) -> Settings {
        let courant = self.courant();
        let Preset { iterations, tolerance, .. } = self.preset(scheme);
        let swept = world.settings.largest_sweep() * world.domain.cell_size / stirring(world);
        let mut dt = self.unhindered_dt(scheme, world, speed(world), block_pressure).min(swept);
        let mut needed = 0;
        if scheme == Scheme::Explicit {
            dt = dt.min(self.stable_share() * world.stable_dt());
        }
        if scheme == Scheme::Implicit {
            let (longest, sound) = world.followed_dt(dt);
            (dt, needed) = (dt.min(longest), sound);
        }
        let dt = dt.min(world.viscous_dt(scheme).max(dt / MOST_VISCOUS)).max(SHORTEST);
        if scheme == Scheme::Implicit {
            needed = needed.max(world.viscous_iterations(dt));
            if !block_pressure {
                needed = needed.max((f64::from(iterations) * raised(world)).round() as u32);
            }
        }
        Settings {
            dt,
            bulk_limit: self.stiffness(scheme, world, dt),
            scheme,
            iterations: iterations.max(needed),
            tolerance: tolerance.unwrap_or(world.settings.tolerance),
            block_pressure,
            sharpen: scheme != Scheme::Published && self.sharpens(world, dt),
            courant,
            volume_correction_time: correction_time(world),
            ..world.settings.clone()
        }
    }

    /// Step of the explicit scheme over the longest that is stable for a world's solids ([`World::stable_dt`]).
    pub fn stable_share(self) -> f64 {
        if self == Quality::Accurate { 0.5 } else { 1.0 }
    }

    /// The step, s, that gravity, depth and this speed alone ask for.
    fn unhindered_dt(self, scheme: Scheme, world: &World, speed: f64, block_pressure: bool) -> f64 {
        let cell_size = world.domain.cell_size;
        // What motion alone needs, in a scheme whose stiffness comes from iterations.
        let enough = self.preset(Scheme::Implicit).hertz;
        // Liquids of the explicit scheme are as soft as the step is long. Solids need no more steps than sound asks
        // for.
        let sound = scheme == Scheme::Explicit && !world.has(|m| m.model == Model::Liquid);
        let hertz = if sound { enough } else { self.preset(scheme).hertz };
        let deeper = (depth(world) / if block_pressure { DEPTH_SHARED } else { DEPTH }).max(1.0);
        let by_gravity = (slowness(world) / deeper).sqrt() / hertz;
        let by_motion = LONGEST.min(self.courant() * cell_size / speed) * (enough / hertz).min(1.0);
        by_gravity.min(by_motion)
    }

    /// The bulk modulus, Pa, that liquids need. In the implicit scheme, in steps of `dt`, its sound is some
    /// [times](Self::outrun) as fast as the fastest that matter begins with or bodies come to, followed by a fall to
    /// the lowest point of the domain, and travels at least about a cell and a half per step. At the foot of a depth h
    /// matter is then compressed by half of one over the square of that factor. In the explicit one it is what evenly
    /// lying matter bears in steps set by gravity, depth and motion alone, including the motion of bodies. `None` where
    /// nothing has weight and nothing moves at the start.
    pub(crate) fn stiffness(self, scheme: Scheme, world: &World, dt: f64) -> Option<f64> {
        let density = world.densest_liquid();
        let speed = speed(world).max(stirring(world));
        let fastest = speed.powi(2) + 2.0 * world.gravity.length() * height(world);
        let square = |dt: f64| (world.domain.cell_size / dt).powi(2);
        let needed = match scheme {
            Scheme::Published => return None,
            Scheme::Implicit => density * (fastest * self.outrun().powi(2)).max(2.0 * square(dt)),
            Scheme::Explicit => {
                density * FIRMEST * COURANT * COURANT * square(self.unhindered_dt(scheme, world, speed, false))
            }
        };
        (fastest > 0.0 && density > 0.0).then(|| needed.clamp(1e-3, 1e12))
    }

    /// Whether motion that transfers smooth away is restored in steps of `dt`. Eddies then last as long as they should,
    /// also those of pools that come to rest, which a game may prefer to be still, except where a liquid has a
    /// viscosity of its own of about that size.
    fn sharpens(self, world: &World, dt: f64) -> bool {
        let [least, largest] = BLURRED;
        let blurred = |m: &Material| {
            let viscosity = m.viscosity / m.rest_density * dt / world.domain.cell_size.powi(2);
            m.model == Model::Liquid && least <= viscosity && viscosity <= largest
        };
        match self {
            Quality::Draft => false,
            Quality::Realtime => world.has(blurred),
            Quality::Accurate => true,
        }
    }

    /// Whether liquids share a pressure per block where they can. In the steps of drafts they can only in shallow
    /// pools.
    fn shares(self, scheme: Scheme) -> bool {
        self != Quality::Draft && scheme == Scheme::Implicit
    }

    /// How many times as fast as the fastest matter sound should be, so that pressure waves and the compression in them
    /// are small.
    fn outrun(self) -> f64 {
        match self {
            Quality::Draft => 3.0,
            Quality::Realtime => 10.0,
            Quality::Accurate => 20.0,
        }
    }

    /// The most cells that the fastest particle moves in a step.
    fn courant(self) -> f64 {
        match self {
            Quality::Draft => 2.0,
            Quality::Realtime => 1.0,
            Quality::Accurate => 0.5,
        }
    }

    fn preset(self, scheme: Scheme) -> Preset {
        let (hertz, iterations, tolerance) = match (scheme, self) {
            (Scheme::Published, Quality::Draft) => (60.0, 4, None),
            (Scheme::Published, Quality::Realtime) => (120.0, 10, None),
            // Substeps serve this scheme better than iterations.
            (Scheme::Published, Quality::Accurate) => (1200.0, 1, None),
            (Scheme::Implicit, Quality::Draft) => (120.0, 3, Some(0.03)),
            (Scheme::Implicit, Quality::Realtime) => (300.0, 4, Some(0.01)),
            (Scheme::Implicit, Quality::Accurate) => (300.0, 8, Some(0.001)),
            (Scheme::Explicit, Quality::Draft) => (450.0, 1, None),
            (Scheme::Explicit, Quality::Realtime) => (900.0, 1, None),
            (Scheme::Explicit, Quality::Accurate) => (1800.0, 1, None),
        };
        Preset { hertz, iterations, tolerance }
    }
}

/// Multiple of the iterations where the liquids of a block share no pressure and differ in density: from a light one
/// that bears a dense one, iterations see little of the motion.
fn raised(world: &World) -> f64 {
    (1.0 + world.contrast().log10()).min(MOST_RAISED)
}

/// The largest speed of what is spawned or emitted, m/s.
fn speed(world: &World) -> f64 {
    let spawned = world.spawns.iter().map(|s| s.shape.outermost([s.velocity.length(), s.angular_velocity.length()]));
    spawned.chain(world.emitters.iter().map(Emitter::fastest)).fold(0.0, f64::max)
}

/// The largest initial speed of bodies, or speed that their motion reaches, m/s.
fn stirring(world: &World) -> f64 {
    world.colliders.iter().map(Collider::fastest).fold(0.0, f64::max)
}

/// The height of the highest spawned or emitted matter above the lowest point of the domain, m.
fn height(world: &World) -> f64 {
    let down = world.gravity.normalize_or_zero();
    let lowest = DVec3::select(down.cmpgt(DVec3::ZERO), world.domain.max, world.domain.min).dot(down);
    let spawned = world.spawns.iter().map(|s| (s.position, &s.shape, s.rotation));
    let emitted = world.emitters.iter().map(|e| (e.position, &e.shape, e.rotation));
    let above = |(position, shape, rotation): (DVec3, &Shape, DQuat)| {
        lowest - (position.dot(down) - reach(shape, rotation, down))
    };
    spawned.chain(emitted).map(above).fold(0.0, f64::max)
}

/// How far a shape so turned reaches from its centre along a direction, m; 0 for an unbounded one.
fn reach(shape: &Shape, rotation: DQuat, along: DVec3) -> f64 {
    shape.half_extent().map_or(0.0, |half| half.dot((unit(rotation).inverse() * along).abs()))
}

/// Depth of the spawns along gravity in cells: the extent that they span, or their height stacked up where that is
/// less.
fn depth(world: &World) -> f64 {
    depth_along(world, world.gravity.normalize_or_zero())
}

/// The same along another direction; 0 where nothing is spawned.
pub(crate) fn depth_along(world: &World, down: DVec3) -> f64 {
    let (mut lo, mut hi, mut stacked) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
    for spawn in &world.spawns {
        let reach = reach(&spawn.shape, spawn.rotation, down);
        let at = spawn.position.dot(down);
        (lo, hi, stacked) = (lo.min(at - reach), hi.max(at + reach), stacked + 2.0 * reach);
    }
    stacked.min(hi - lo).max(0.0) / world.domain.cell_size
}
