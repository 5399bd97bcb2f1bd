//! Matter that exists at time 0, or that a host adds.

use crate::collider::Collider;
use crate::domain::Domain;
use crate::error::{Check, Result};
use crate::shape::{MAX_LENGTH, Pose, Shape, turned, unit, validate_rotation};
use glam::{DQuat, DVec3, UVec3};

/// How a spawn's shape is filled with particles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(rename_all = "snake_case", deny_unknown_fields))]
#[non_exhaustive]
pub enum Fill {
    /// A cubic lattice with this many particles per grid cell, 0.01 … 1000; 8 is usual. In a box it is stretched as
    /// with [`Fill::Spacing`].
    PerCell(f64),
    /// A cubic lattice with this spacing, m. In a box it is stretched along each axis as little as possible so that a
    /// whole number of spacings, at least one, goes from face to face: the matter then has the box's volume, if the box
    /// is at least a quarter of a spacing thick. In other shapes the matter has the volume of the lattice points
    /// inside; what is too small to hold any is one particle, of a full spacing's volume.
    Spacing(f64),
    /// The thesis' spacing, for boxes only: this many particles per axis from face to face, both included. Each
    /// stands for the product of the three steps, so that the matter is larger than the box by half a step on every
    /// side. At least 2 per axis.
    Inclusive(#[cfg_attr(feature = "scene", schemars(with = "[u32; 3]"))] UVec3),
}

/// A body of one material, filled with particles at time 0. Particles that would be inside a collider are left out,
/// unless it is `fixed`: such a collider holds what is inside. A spawn of a world that makes no particle at all is an
/// error.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields))]
pub struct Spawn {
    /// Name of the material.
    pub material: String,
    /// The region to fill; bounded.
    pub shape: Shape,
    /// Position of the shape's centre, m.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Rotation of the shape and of its lattice, quaternion `[x, y, z, w]`. Default none.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 4]"), serde(default = "crate::shape::no_rotation"))]
    pub rotation: DQuat,
    /// How it is filled.
    pub fill: Fill,
    /// Velocity of every particle at time 0, m/s. At most 1e6 on each axis, default 0.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
    pub velocity: DVec3,
    /// Angular velocity about the shape's centre in world axes, rad/s, on top of `velocity`. Default 0.
    #[cfg_attr(feature = "scene", schemars(with = "[f64; 3]"), serde(default))]
    pub angular_velocity: DVec3,
    /// Each particle is moved by at most this share of the spacing on each axis, uniformly distributed. 0 … 0.5,
    /// default 0.
    #[cfg_attr(feature = "scene", serde(default))]
    pub jitter: f64,
    /// Seed of the jitter. Equal seeds give equal particles. Default 0.
    #[cfg_attr(feature = "scene", serde(default))]
    pub seed: u64,
}

/// The thinnest layer that particles stand for, in spacings: sums have no room for much less.
const THINNEST: f64 = 0.25;

/// A particle before the first step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Seed {
    /// m
    pub position: DVec3,
    /// m/s
    pub velocity: DVec3,
    /// rad/s
    pub angular_velocity: DVec3,
    /// Volume at rest, m³.
    pub volume: f64,
    /// Index into `World::materials`.
    pub material: u32,
}

impl Spawn {
    /// A box of `material` between two corners, at rest, filled with 8 particles per cell.
    pub fn cuboid(material: impl Into<String>, lo: DVec3, hi: DVec3) -> Self {
        Spawn {
            material: material.into(),
            shape: Shape::Box { half_size: (hi - lo) * 0.5 },
            position: (lo + hi) * 0.5,
            rotation: DQuat::IDENTITY,
            fill: Fill::PerCell(8.0),
            velocity: DVec3::ZERO,
            angular_velocity: DVec3::ZERO,
            jitter: 0.0,
            seed: 0,
        }
    }

    pub(crate) fn validate(&self, path: &str) -> Result<()> {
        let check = Check { path };
        self.shape.validate(&format!("{path}.shape"))?;
        let bounded = self.shape.half_extent().is_some();
        check.that(bounded, "shape", &self.shape, "a bounded shape, which all but half-spaces are")?;
        check.vector("position", self.position, MAX_LENGTH, "finite, at most 1e6 m")?;
        validate_rotation(&check, "rotation", self.rotation)?;
        check.vector("velocity", self.velocity, 1e6, "finite, at most 1e6 m/s")?;
        check.vector("angular_velocity", self.angular_velocity, 1e6, "finite, at most 1e6 rad/s")?;
        check.range("jitter", self.jitter, 0.0, 0.5, "0 to 0.5")?;
        match self.fill {
            Fill::PerCell(n) => check.range("fill.per_cell", n, 0.01, 1000.0, "0.01 to 1000"),
            Fill::Spacing(s) => check.range("fill.spacing", s, 1e-6, MAX_LENGTH, "1e-6 to 1e6 m"),
            Fill::Inclusive(n) => {
                check.that(
                    matches!(self.shape, Shape::Box { .. }),
                    "fill.inclusive",
                    n.to_array(),
                    "used with a box",
                )?;
                let counts = n.min_element() >= 2 && n.max_element() <= 4096;
                check.that(counts, "fill.inclusive", n.to_array(), "2 to 4096 particles on each axis")
            }
        }
    }

    /// Lattice: particles per axis, step on each axis in m, first point relative to the centre.
    fn lattice(&self, cell_size: f64) -> (UVec3, DVec3, DVec3) {
        let half = self.shape.half_extent().unwrap_or(DVec3::ZERO);
        let spacing = match self.fill {
            Fill::Inclusive(n) => {
                let step = half * 2.0 / (n - UVec3::ONE).as_dvec3();
                return (n, step, -half);
            }
            Fill::PerCell(n) => cell_size / n.cbrt(),
            Fill::Spacing(s) => s,
        };
        // A body thinner than half the spacing still gets a layer.
        let n = (half * 2.0 / spacing).round().max(DVec3::ONE).as_uvec3();
        let step = match self.shape {
            Shape::Box { .. } => (half * 2.0 / n.as_dvec3()).max(DVec3::splat(THINNEST * spacing)),
            _ => DVec3::splat(spacing),
        };
        (n, step, step * (n - UVec3::ONE).as_dvec3() * -0.5)
    }

    /// How many lattice points lie in the shape's bounding box: an upper bound for the particles, without making them.
    pub(crate) fn lattice_points(&self, cell_size: f64) -> u64 {
        let n = self.lattice(cell_size).0;
        n.to_array().iter().fold(1u64, |a, &b| a.saturating_mul(u64::from(b)))
    }

    /// Its particles, made on demand.
    fn seeds(&self, cell_size: f64, material: u32) -> impl Iterator<Item = Seed> {
        let (n, step, first) = self.lattice(cell_size);
        let row = move |y, z| (0..n.x).map(move |x| DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
        let places = (0..n.z).flat_map(move |z| (0..n.y).flat_map(move |y| row(y, z)));
        let local = places.map(move |place| first + place * step);
        let inside = move |local: &DVec3| self.shape.signed_distance(*local) <= 1e-9 * step.max_element();
        let mut inside_of_lattice = local.filter(inside).peekable();
        // What is too small to hold a point of its lattice is one particle.
        let alone = inside_of_lattice.peek().is_none().then_some(DVec3::ZERO).filter(inside);
        let inside = inside_of_lattice.chain(alone);
        let mut random = SplitMix(self.seed);
        let rotation = unit(self.rotation);
        inside.map(move |local| {
            let offset = DVec3::new(random.symmetric(), random.symmetric(), random.symmetric());
            let from_centre = rotation * (local + offset * step * self.jitter);
            Seed {
                position: self.position + from_centre,
                velocity: self.velocity + self.angular_velocity.cross(from_centre),
                angular_velocity: self.angular_velocity,
                volume: step.x * step.y * step.z,
                material,
            }
        })
    }

    /// Its particles in a domain, except those that would begin inside a body; an error for each that lies outside the
    /// domain.
    pub(crate) fn seeds_among<'a>(
        &'a self,
        path: String,
        domain: &'a Domain,
        material: u32,
        bodies: impl Iterator<Item = (&'a Collider, Pose)>,
    ) -> impl Iterator<Item = Result<Seed>> {
        let cell_size = domain.cell_size;
        let bounds = self.bounds(cell_size);
        let near: Vec<_> = bodies.filter(|(body, pose)| !is_beyond(body, pose, bounds)).collect();
        let mut all = self.seeds(cell_size, material).map(move |seed| domain.inside(&path, seed));
        let runs = std::iter::from_fn(move || {
            let run: Vec<_> = all.by_ref().take(RUN).collect();
            (!run.is_empty()).then_some(run)
        });
        runs.flat_map(move |run| {
            let bounds = self::bounds(run.iter().flatten().map(|seed| seed.position));
            let beside: Vec<_> = near.iter().copied().filter(|(body, pose)| !is_beyond(body, pose, bounds)).collect();
            let free = move |at| !beside.iter().any(|(body, pose)| begins_inside(body, pose, at, cell_size));
            run.into_iter().filter(move |seed| seed.as_ref().map_or(true, |seed| free(seed.position)))
        })
    }

    /// The corners between which all of its particles lie.
    fn bounds(&self, cell_size: f64) -> [DVec3; 2] {
        let (_, step, first) = self.lattice(cell_size);
        let half = (first.abs() + step * self.jitter) * (1.0 + 1e-9);
        let reach = turned(unit(self.rotation), half);
        [self.position - reach, self.position + reach]
    }
}

/// Particles that follow each other, and so lie in a row, for which the bodies near them are looked for together.
const RUN: usize = 64;

/// How deep in a body a particle may begin, in cells.
const GRAZE: f64 = 1e-6;

/// Whether a particle here would begin inside a body that does not hold it there.
pub(crate) fn begins_inside(body: &Collider, pose: &Pose, position: DVec3, cell_size: f64) -> bool {
    !body.clamps() && body.signed_distance(pose.local(position)) < -GRAZE * cell_size
}

/// The least and the largest coordinates of points.
pub(crate) fn bounds(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lo, hi], x| [lo.min(x), hi.max(x)])
}

/// Whether no point within these bounds can be in a body, by its size.
pub(crate) fn is_beyond(body: &Collider, pose: &Pose, [lo, hi]: [DVec3; 2]) -> bool {
    let radius = body.shape.half_extent().filter(|_| !body.inverted).map_or(f64::INFINITY, DVec3::length);
    (pose.position.clamp(lo.min(hi), hi) - pose.position).length() > radius
}

/// Collects the first `most` particles of `all`, which has no more than `points`, and counts all of them.
pub(crate) fn gathered(
    mut all: impl Iterator<Item = Result<Seed>>,
    points: u64,
    most: usize,
) -> Result<(Vec<Seed>, usize)> {
    let mut seeds = Vec::with_capacity(points.min(most as u64) as usize);
    all.by_ref().take(most).try_for_each(|seed| seed.map(|seed| seeds.push(seed)))?;
    let count = all.try_fold(seeds.len(), |count, seed| seed.map(|_| count + 1))?;
    Ok((seeds, count))
}

/// SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct SplitMix(pub u64);

impl SplitMix {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniformly distributed in −1 … 1.
    fn symmetric(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn boxes_have_their_volume_and_stay_within_it() {
        for per_cell in [0.1, 1.0, 2.0, 4.0, 8.0, 27.0] {
            for size in [DVec3::new(10.0, 4.0, 3.0), DVec3::new(3.17, 0.6, 12.9), DVec3::splat(1.0)] {
                let spawn = Spawn { fill: Fill::PerCell(per_cell), ..Spawn::cuboid("water", DVec3::ZERO, size) };
                let seeds: Vec<_> = spawn.seeds(1.0, 0).collect();
                let volume: f64 = seeds.iter().map(|seed| seed.volume).sum();
                assert!(
                    (volume / (size.x * size.y * size.z) - 1.0).abs() < 1e-12,
                    "{per_cell} per cell, {size}: {volume}"
                );
                let within = |p: DVec3| p.cmpgt(DVec3::ZERO).all() && p.cmplt(size).all();
                assert!(seeds.iter().all(|seed| within(seed.position)), "{per_cell} per cell, {size}");
            }
        }
    }

    /// Of what finds no room only the number is learnt.
    #[test]
    fn no_more_are_kept_than_there_is_room_for() {
        let domain = World::new(DVec3::ZERO, DVec3::splat(4.0), 1.0).domain;
        let spawn = Spawn::cuboid("water", DVec3::ZERO, DVec3::splat(4.0));
        let body = Collider::new(Shape::Box { half_size: DVec3::ONE }, DVec3::splat(2.0));
        let all = || spawn.seeds_among("spawn".to_owned(), &domain, 0, std::iter::once((&body, body.pose())));
        let (kept, count) = gathered(all(), 512, 100).unwrap();
        assert_eq!((kept.len(), kept.capacity(), count), (100, 100, 512 - 64));
        let (whole, count) = gathered(all(), 512, usize::MAX).unwrap();
        assert_eq!((whole.len(), whole.capacity(), count), (448, 512, 448));
        assert_eq!(whole[..100], kept);
    }

    /// Whatever bodies are near, only the particles in one of them are left out, in the same order.
    #[test]
    fn all_bodies_near_count() {
        let domain = World::new(DVec3::splat(-8.0), DVec3::splat(24.0), 1.0).domain;
        let rotation = DQuat::from_rotation_y(0.4);
        let spawn = Spawn { rotation, ..Spawn::cuboid("water", DVec3::ZERO, DVec3::new(16.0, 6.0, 16.0)) };
        let mut random = SplitMix(7);
        let bodies: Vec<_> = (0..60)
            .map(|n| {
                let at = DVec3::new(random.symmetric(), random.symmetric(), random.symmetric()) * 9.0 + 8.0;
                let radius = 0.3 + 0.7 * random.symmetric().abs();
                let half_size = DVec3::splat(radius);
                Collider::new(if n % 2 == 0 { Shape::Sphere { radius } } else { Shape::Box { half_size } }, at)
            })
            .collect();
        let placed = || bodies.iter().map(|body| (body, body.pose()));
        let found: Vec<_> = spawn.seeds_among(String::new(), &domain, 0, placed()).map(Result::unwrap).collect();
        let free = |seed: &Seed| !placed().any(|(body, pose)| begins_inside(body, &pose, seed.position, 1.0));
        let wanted: Vec<_> = spawn.seeds(1.0, 0).filter(free).collect();
        assert!(wanted.len() + 100 < spawn.seeds(1.0, 0).count());
        assert!(found == wanted, "{} instead of {}", found.len(), wanted.len());
    }

    /// A rotation may be off length 1 by a thousandth; it turns all the same, and does not stretch.
    #[test]
    fn rotations_do_not_stretch() {
        let turn = DQuat::from_rotation_y(0.785);
        let seeds = |rotation| {
            let spawn = Spawn { rotation, ..Spawn::cuboid("water", DVec3::ZERO, DVec3::splat(10.0)) };
            spawn.seeds(1.0, 0).map(|seed| seed.position).collect::<Vec<_>>()
        };
        let apart = seeds(turn).iter().zip(seeds(turn * 1.0008)).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        assert!(apart < 1e-12, "{apart} m");
        let pose = Pose { position: DVec3::ONE, rotation: turn * 1.0008 };
        let local = turn.inverse() * DVec3::splat(2.0);
        assert!(pose.local(DVec3::splat(3.0)).distance(local) < 1e-12);
    }

    /// Particles on the faces of a domain are inside, wherever rounding puts them; drops smaller than the lattice are
    /// one particle.
    #[test]
    fn what_is_flush_or_tiny_is_made() {
        for n in 1..400 {
            let (lo, hi) = (DVec3::splat(0.1 * f64::from(n)), DVec3::splat(0.1 * f64::from(n) + 0.655));
            let mut world = World::new(lo, hi, 0.05);
            world.materials.push(crate::material::Material::liquid("water"));
            let fill = Fill::Inclusive(UVec3::splat(4 + n % 9));
            world.spawns.push(Spawn { fill, ..Spawn::cuboid("water", lo, hi) });
            let seeds = world.seeds().unwrap();
            assert!(seeds.iter().all(|seed| seed.position.clamp(lo, hi) == seed.position), "{n}");
        }
        for radius in [0.1, 0.375, 0.4, 0.425] {
            let shape = Shape::Sphere { radius };
            let drop = Spawn { shape, ..Spawn::cuboid("water", DVec3::ZERO, DVec3::ONE) };
            assert_eq!(drop.seeds(1.0, 0).count(), 1, "radius {radius}");
        }
    }

    #[test]
    fn the_thinnest_layer_is_a_quarter_of_a_spacing() {
        let size = DVec3::new(2.0, 1e-3, 2.0);
        let seeds: Vec<_> = Spawn::cuboid("water", DVec3::ZERO, size).seeds(1.0, 0).collect();
        assert_eq!((seeds.len(), seeds[0].volume), (16, 0.125 * 0.25));
    }
}
