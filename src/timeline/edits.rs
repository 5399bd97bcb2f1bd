//! What hosts ask for between steps: particles to be added and removed, bodies to be placed.

use super::Timeline;
use super::disturbance::Bounds;
use crate::error::{Check, Result};
use crate::math::distance_grid::DistanceGrid;
use crate::region::Region;
use crate::shape::{Pose, Shape, validate_rotation};
use crate::spawn::{self, Seed, Spawn};
#[cfg(feature = "snapshot")]
use crate::world::World;
use crate::world::{MAX_PARTICLES, MAX_REGIONS, check_distances};
use std::sync::Arc;

/// A host's requests, to be done in one step.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Edits {
    pub(super) added: Vec<Seed>,
    pub(super) removed: Vec<Region>,
    /// The slots of quarantined particles are to be given back.
    pub(super) release: bool,
    /// Colliders that were given a pose, in their order, each once; the pose is among the moment's as well.
    pub(super) placed: Vec<(usize, Pose)>,
    /// Where these requests wake matter at rest, besides where colliders were placed.
    pub(super) disturbed: Vec<Bounds>,
}

impl Edits {
    /// Builds the meshes of what is to be removed, which a file only names or lists, or takes those of the world that
    /// are the same.
    #[cfg(feature = "snapshot")]
    pub fn build(&mut self, world: &World) -> Result<()> {
        for shape in self.removed.iter_mut().map(|region| &mut region.shape) {
            let known = world.placed_shapes().map(|(.., known)| known).find(|known| known.is_stated_as(shape)).cloned();
            match known {
                Some(known) => *shape = known,
                None => drop(shape.build("snapshot.clock.edits.removed.shape", None, world.domain.cell_size)?),
            }
        }
        Ok(())
    }

    /// The largest speed of what is to be added, m/s.
    pub fn max_speed(&self) -> f64 {
        self.added.iter().map(|seed| seed.velocity.length()).fold(0.0, f64::max)
    }

    /// Notes that a collider was given a pose; returns whether that is its first in this step.
    pub fn place(&mut self, collider: usize, pose: Pose) -> bool {
        let place = self.placed.binary_search_by_key(&collider, |(known, _)| *known);
        match place {
            Ok(i) => self.placed[i].1 = pose,
            Err(i) => self.placed.insert(i, (collider, pose)),
        }
        place.is_err()
    }
}

impl Timeline {
    /// Requests the particles of a spawn at the end of the next step; returns their number. `check` decides whether so
    /// many may appear in one step.
    pub fn add(&mut self, spawn: &Spawn, capacity: usize, check: impl Fn(usize) -> Result<()>) -> Result<usize> {
        spawn.validate("spawn")?;
        let material = self.materials.iter().position(|m| m.name == spawn.material);
        let named = Check { path: "spawn" };
        named.that(material.is_some(), "material", &spawn.material, "the name of one of the world's materials")?;
        let takes_part = material.is_none_or(|i| self.present.contains(&i));
        let allowed = "one that is spawned or emitted, or any where settings.capacity is stated";
        named.that(takes_part, "material", &spawn.material, allowed)?;
        let cell_size = self.units.cell_size;
        let points = spawn.lattice_points(cell_size);
        named.that(points <= MAX_PARTICLES, "fill", points, "at most 2^26 particles")?;
        // Where they are when the particles appear.
        let (_, poses) = self.end();
        let bodies = self.colliders.iter().zip(poses);
        let seeds = spawn.seeds_among("spawn".to_owned(), &self.domain, material.unwrap_or(0) as u32, bodies);
        let others = self.edits.added.len();
        let (mut seeds, count) = spawn::gathered(seeds, points, capacity.saturating_sub(others))?;
        let all = count + others;
        let room =
            format!("few enough particles, with those to be added in the same step, for the capacity of {capacity}");
        named.that(all <= capacity, "fill", all, &room)?;
        check(all + self.most_emitted())?;
        self.expect_masses(&seeds)?;
        let edits = Arc::make_mut(&mut self.edits);
        edits.disturbed.extend(Bounds::of(seeds.iter().map(|seed| seed.position), cell_size));
        edits.added.append(&mut seeds);
        Ok(count)
    }

    /// Requests that everything in a region be deleted at the end of the next step. `check` decides whether there is
    /// room for these distance grids.
    pub fn remove(&mut self, region: &Region, check: impl Fn(&[Arc<DistanceGrid>]) -> Result<()>) -> Result<()> {
        region.validate("region")?;
        let named = Check { path: "region" };
        let others = self.edits.removed.len();
        named.that(others < MAX_REGIONS, "others in the same step", others, "at most 255")?;
        self.know(&named, &region.shape, check)?;
        let pose = region.pose(self.end().0);
        let edits = Arc::make_mut(&mut self.edits);
        edits.disturbed.push(Bounds::of_shape(&region.shape, region.inverted, &pose));
        edits.removed.push(region.clone());
        Ok(())
    }

    /// Requests that the slots of quarantined particles be freed at the end of the next step.
    pub fn release_quarantined(&mut self) {
        Arc::make_mut(&mut self.edits).release = true;
    }

    /// The most particles that hosts and emitters may bring in one of the steps that are asked for.
    pub fn most_added(&self) -> usize {
        let asked = self.due.iter().map(|asked| &asked.edits).chain([&self.edits]);
        self.most_emitted() + asked.map(|edits| edits.added.len()).max().unwrap_or(0)
    }

    /// Adds the distance grids of regions to be removed, and checks that all of these edits could have been requested.
    pub(super) fn know_edits(&mut self, edits: &Edits) -> Result<()> {
        let check = Check { path: "snapshot.clock.edits" };
        for seed in &edits.added {
            let sound = seed.position.is_finite() && seed.velocity.is_finite() && seed.angular_velocity.is_finite();
            let known = self.present.contains(&(seed.material as usize));
            // Its mass was known when it was asked for.
            let counted = known && seed.volume > 0.0 && self.counts(seed);
            check.that(sound && known && counted, "added", seed, "a particle that could have been asked for")?;
        }
        for bounds in &edits.disturbed {
            check.that(bounds.is_sound(), "disturbed", bounds, "finite, lower corner first")?;
        }
        check.that(edits.removed.len() <= MAX_REGIONS, "removed", edits.removed.len(), "at most 256 regions")?;
        for region in &edits.removed {
            region.validate("snapshot.clock.edits.removed")?;
            self.know(&check, &region.shape, |_| Ok(()))?;
        }
        let count = self.colliders.len();
        let ordered = edits.placed.is_sorted_by(|(a, _), (b, _)| a < b);
        check.that(ordered, "placed", edits.placed.len(), "colliders in their order, each once")?;
        for (i, pose) in &edits.placed {
            check.that(*i < count, "placed", i, &format!("below the world's {count} colliders"))?;
            check.vector("placed.position", pose.position, f64::MAX, "finite")?;
            validate_rotation(&check, "placed.rotation", pose.rotation)?;
        }
        Ok(())
    }

    /// Adds the distance grid of a shape that has one, unless it is known already.
    fn know(
        &mut self,
        check: &Check<'_>,
        shape: &Shape,
        may_be_known: impl Fn(&[Arc<DistanceGrid>]) -> Result<()>,
    ) -> Result<()> {
        let known = |grid: &DistanceGrid| self.grids.iter().any(|known| Arc::ptr_eq(&known.values, &grid.values));
        if let Some(new) = shape.grid().filter(|grid| !known(grid)) {
            let all = self.grids.iter().map(Arc::as_ref).chain([new]);
            check_distances(check, all.map(|grid| ("shape".to_owned(), grid)))?;
            let mut grids = self.grids.clone();
            grids.push(Arc::new(new.scaled(self.units.length_in(1.0))));
            may_be_known(&grids)?;
            self.grids = grids;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collider::Collider;
    use crate::material::Material;
    use glam::DVec3;

    /// An empty box with room, and a body.
    fn timeline() -> Timeline {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
        world.materials.push(Material::liquid("water"));
        world.settings.capacity = Some(1000);
        world.colliders.push(Collider::new(Shape::Sphere { radius: 0.1 }, DVec3::splat(0.5)));
        Timeline::new(&world, &[]).unwrap()
    }

    fn cube(x: f64) -> Spawn {
        let (centre, half) = (DVec3::new(x, 0.5, 0.5), DVec3::splat(0.05));
        Spawn::cuboid("water", centre - half, centre + half)
    }

    fn region(x: f64) -> Region {
        Region::new(Shape::Box { half_size: DVec3::splat(0.06) }, DVec3::new(x, 0.5, 0.5))
    }

    fn step(timeline: &mut Timeline) {
        let input = timeline.input();
        timeline.advance(&input);
    }

    /// A host that places a body in each of its frames while no step is taken does not fill the memory.
    #[test]
    fn a_body_placed_often_is_placed_once() {
        let mut timeline = timeline();
        for n in 0..1000 {
            let position = DVec3::new(0.3 + 1e-4 * f64::from(n), 0.5, 0.5);
            let pose = Pose { position, ..timeline.now().poses[0] };
            timeline.set_collider(0, Some(pose), DVec3::ZERO, DVec3::ZERO).unwrap();
        }
        let edits = &timeline.edits;
        assert_eq!((edits.placed.len(), edits.disturbed.len()), (1, 1));
        assert_eq!(edits.placed[0].1.position.x, 0.3 + 1e-4 * 999.0);
    }

    #[test]
    fn a_step_empties_as_many_regions_as_devices_take() {
        let mut timeline = timeline();
        for _ in 0..MAX_REGIONS {
            timeline.remove(&region(0.5), |_| Ok(())).unwrap();
        }
        assert!(timeline.remove(&region(0.5), |_| Ok(())).unwrap_err().to_string().contains("256"));
        step(&mut timeline);
        timeline.remove(&region(0.5), |_| Ok(())).unwrap();
    }

    /// What may be added after a rewind does not depend on what had been added in the time that was undone.
    #[test]
    fn a_rewind_forgets_light_particles() {
        let mut timeline = timeline();
        let clock = timeline.clock();
        let one = |spacing: f64| Spawn { fill: crate::Fill::Spacing(spacing), ..cube(0.2) };
        timeline.add(&one(0.02), 1000, |_| Ok(())).unwrap();
        assert!(timeline.smallest < timeline.resumed(&clock).unwrap().smallest);
    }

    /// A place that a body leaves within the step is free, one that it reaches is not.
    #[test]
    fn what_is_added_keeps_out_of_bodies_at_the_end_of_the_step() {
        let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
        world.materials.push(Material::liquid("water"));
        world.settings.capacity = Some(1000);
        let piston = Collider::new(Shape::Box { half_size: DVec3::splat(0.1) }, DVec3::new(0.2, 0.5, 0.5));
        world.colliders.push(Collider { linear_velocity: DVec3::X * 30.0, ..piston });
        let mut timeline = Timeline::new(&world, &[]).unwrap();
        timeline.set_dt(0.01).unwrap();
        let mut add = |x: f64| {
            let (centre, half) = (DVec3::new(x, 0.5, 0.5), DVec3::splat(0.05));
            timeline.add(&Spawn::cuboid("water", centre - half, centre + half), 1000, |_| Ok(()))
        };
        assert_eq!([add(0.2), add(0.5), add(0.8)], [Ok(64), Ok(0), Ok(64)]);
    }
}
