//! Where something happens in a step that matter at rest does not show, so that it may not sleep there.

use super::{ColliderInput, Timeline};
use crate::bins::{EDGE, LAST_BLOCK, last_blocks};
use crate::collider::Collider;
use crate::shape::{Pose, Shape};
use crate::tool::ToolInput;
use glam::{DMat3, DVec3};

/// The most boxes in a step's input; where there are more, neighbours are merged.
pub(crate) const DISTURBANCES: usize = 32;
/// How far a particle's first node may lie before something that acts on one of its nodes, cells.
const BEFORE: f64 = 2.0;

/// Inputs of the decision about sleep in a step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SleepInput {
    /// Square of the largest displacement at rest.
    pub square: f64,
    /// Microseconds by which this step lengthens a rest, and after which matter sleeps.
    pub lasted: u32,
    pub needed: u32,
    /// Where nothing sleeps.
    pub disturbed: Vec<Disturbance>,
}

/// Blocks in which nothing sleeps: those between two corner blocks, inclusive. Along periodic axes they may go on at the
/// other end; there `lo` lies above `hi`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Disturbance {
    pub lo: [u32; 3],
    pub hi: [u32; 3],
}

impl Disturbance {
    /// Whether it is in the block with these coordinates.
    pub fn holds(&self, at: [u32; 3]) -> bool {
        (0..3).all(|a| {
            let (lo, hi) = (self.lo[a] <= at[a], at[a] <= self.hi[a]);
            if self.hi[a] < self.lo[a] { lo || hi } else { lo && hi }
        })
    }
}

/// The first and the last of these blocks along an axis, of which the last before matter is repeated is `last`; 0 where
/// it is not.
fn between(first: f64, end: f64, last: u32) -> (u32, u32) {
    if last == 0 {
        let [first, end] = [first, end].map(|block| block.clamp(0.0, f64::from(LAST_BLOCK)) as u32);
        return (first, end);
    }
    // The blocks before the first and after the last are those at the other end.
    let [first, end] = [first, end].map(|block| block.clamp(0.0, f64::from(last + 1)) as u32);
    if end - first + 1 >= last {
        return (1, last);
    }
    (if first == 0 { last } else { first }, if end > last { 1 } else { end })
}

/// A box along the axes, in m.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "snapshot", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Bounds {
    lo: DVec3,
    hi: DVec3,
}

impl Bounds {
    /// Whether it is a box at all.
    pub fn is_sound(&self) -> bool {
        self.lo.is_finite() && self.hi.is_finite() && self.lo.cmple(self.hi).all()
    }

    fn middle(self) -> DVec3 {
        0.5 * (self.lo + self.hi)
    }

    /// Everything there is. Not infinite, as that is no number in a file.
    const ALL: Bounds = Bounds { lo: DVec3::splat(-1e12), hi: DVec3::splat(1e12) };

    fn around(centre: DVec3, half: DVec3) -> Self {
        Bounds { lo: centre - half, hi: centre + half }
    }

    fn and(self, other: Bounds) -> Self {
        Bounds { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Around points, each with a margin; `None` without points.
    pub fn of(points: impl Iterator<Item = DVec3>, margin: f64) -> Option<Self> {
        points.map(|p| Bounds::around(p, DVec3::splat(margin))).reduce(Bounds::and)
    }

    /// Of a shape as it is placed; everything where it has no bounds.
    pub fn of_shape(shape: &Shape, inverted: bool, pose: &Pose) -> Self {
        match shape.half_extent_turned(pose.rotation) {
            Some(half) if !inverted => Bounds::around(pose.position, half),
            _ => Bounds::ALL,
        }
    }
}

/// At most `most` boxes that cover all of these. Where there are more, they are split in halves along the axis on which
/// they are spread out most, each with half of that number.
fn gathered(all: &mut [Bounds], most: usize) -> Vec<Bounds> {
    if all.len() <= most {
        return all.to_vec();
    }
    if most == 1 {
        return all.iter().copied().reduce(Bounds::and).into_iter().collect();
    }
    let spread = Bounds::of(all.iter().map(|bounds| bounds.middle()), 0.0).map_or(DVec3::ZERO, |b| b.hi - b.lo);
    let axis = spread.max_position();
    let half = all.len() / 2;
    all.select_nth_unstable_by(half, |a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
    let (lower, upper) = all.split_at_mut(half);
    let mut boxes = gathered(lower, most / 2);
    boxes.extend(gathered(upper, most - most / 2));
    boxes
}

impl Timeline {
    /// The inputs of the decision about sleep in the step that begins, which has these bodies and tools; `None` where
    /// nothing sleeps.
    pub(super) fn sleep(&self, bodies: &[ColliderInput], tools: &[ToolInput]) -> Option<SleepInput> {
        let sleep = self.settings.sleep?;
        // Displacements are those of the step before.
        let last = self.last_dt();
        let fastest = self.units.length_in(sleep.speed) * last;
        Some(SleepInput {
            square: fastest * fastest,
            lasted: (last * 1e6).round() as u32,
            // At least one step: moving matter does not sleep, however short the time.
            needed: (sleep.time * 1e6).ceil().max(1.0) as u32,
            disturbed: self.disturbed(bodies, tools),
        })
    }

    fn disturbed(&self, bodies: &[ColliderInput], tools: &[ToolInput]) -> Vec<Disturbance> {
        let mut all: Vec<Bounds> = Vec::new();
        let (before, end) = (self.now.previous.1, self.now.time + self.dt);
        if before != self.gravity {
            all.push(Bounds::ALL);
        }
        all.extend_from_slice(&self.edits.disturbed);
        for (i, pose) in &self.edits.placed {
            all.push(Bounds::of_shape(&self.colliders[*i].shape, self.colliders[*i].inverted, pose));
        }
        let moves = |body: &ColliderInput| body.shift != DVec3::ZERO || body.turn != DMat3::ZERO;
        let moving = self.colliders.iter().zip(&self.now.poses).zip(bodies).filter(|(_, body)| moves(body));
        moving.for_each(|((collider, pose), _)| all.push(self.swept(collider, pose)));
        self.drains.iter().for_each(|drain| all.push(Bounds::of_shape(&drain.shape, drain.inverted, &drain.pose(end))));
        for (emitter, _) in &self.emitters {
            let emits = emitter.particles_per_second(self.units.cell_size) > 0.0;
            if emits && emitter.start < end && emitter.end.is_none_or(|last| last > self.now.time) {
                let poses =
                    [self.now.time, end].map(|time| Bounds::of_shape(&emitter.shape, false, &emitter.pose(time)));
                // Particles that appeared within the step have flown on.
                let way = DVec3::splat((emitter.velocity.length() + self.gravity.length() * self.dt) * self.dt);
                let both = poses[0].and(poses[1]);
                all.push(Bounds { lo: both.lo - way, hi: both.hi + way });
            }
        }
        for tool in tools {
            let radius = DVec3::splat(self.units.length_out(tool.radius));
            let end = |at: DVec3| Bounds::around(self.units.position_out(at), radius);
            all.push(end(tool.start).and(end(tool.start + tool.way)));
        }
        gathered(&mut all, DISTURBANCES).into_iter().map(|bounds| self.blocks(bounds)).collect()
    }

    /// Where a body that moves gets to in the step that begins.
    fn swept(&self, collider: &Collider, pose: &Pose) -> Bounds {
        let end = self.end_pose(collider, pose);
        let [from, to] = [pose, &end].map(|pose| Bounds::of_shape(&collider.shape, collider.inverted, pose));
        let turning = collider.shape.half_extent().filter(|_| end.rotation != pose.rotation);
        let around = turning.map_or(from, |half| Bounds::around(pose.position, DVec3::splat(half.length())));
        from.and(to).and(around)
    }

    /// The blocks whose particles, or whose neighbours' particles, touch nodes within `bounds`.
    fn blocks(&self, bounds: Bounds) -> Disturbance {
        let block = |x: f64| (x / EDGE as f64).floor();
        let (lo, hi) = (self.units.position_in(bounds.lo) - BEFORE, self.units.position_in(bounds.hi));
        let last = last_blocks(self.period.to_array());
        let along = [0, 1, 2].map(|a| between(block(lo[a]) - 1.0, block(hi[a]) + 1.0, last[a]));
        Disturbance { lo: along.map(|(first, _)| first), hi: along.map(|(_, end)| end) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What reaches across a periodic side is at the other end, too.
    #[test]
    fn blocks_go_on_at_the_other_end() {
        let held = |first, end, last| {
            let (lo, hi) = between(first, end, last);
            let disturbance = Disturbance { lo: [lo, 0, 0], hi: [hi, 0, 0] };
            (1..=12).filter(|x| disturbance.holds([*x, 0, 0])).collect::<Vec<_>>()
        };
        assert_eq!(held(4.0, 6.0, 12), [4, 5, 6]);
        assert_eq!(held(0.0, 2.0, 12), [1, 2, 12]);
        assert_eq!(held(11.0, 13.0, 12), [1, 11, 12]);
        assert_eq!(held(-5.0, 0.0, 12), [12]);
        assert_eq!(held(-1e12, 1e12, 12), (1..=12).collect::<Vec<_>>());
        assert_eq!(held(1.0, 3.0, 3), [1, 2, 3]);
        assert_eq!(held(-3.0, 2.0, 0), [1, 2]);
    }

    /// A row of boxes, unsorted: neighbours are merged, and no box becomes longer than it has to.
    #[test]
    fn neighbours_are_taken_as_one() {
        for count in [5, 32, 33, 40, 64, 1000] {
            let place = |i: usize| DVec3::new(((i * 7) % count) as f64, 3.0, -2.0);
            let mut all: Vec<_> = (0..count).map(|i| Bounds::around(place(i), DVec3::splat(0.1))).collect();
            let boxes = gathered(&mut all, DISTURBANCES);
            assert_eq!(boxes.len(), count.min(DISTURBANCES), "of {count}");
            let holds = |b: &Bounds, p: DVec3| p.cmpge(b.lo).all() && p.cmple(b.hi).all();
            assert!((0..count).all(|i| boxes.iter().any(|b| holds(b, place(i)))), "of {count}");
            let longest = boxes.iter().map(|b| b.hi.x - b.lo.x).fold(0.0, f64::max);
            assert!(longest <= 0.2 + count.div_ceil(DISTURBANCES) as f64, "of {count}: {longest}");
        }
    }
}
