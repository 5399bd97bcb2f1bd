//! The triangles that bound a mesh, without those that are buried where its parts overlap or abut.
//!
//! Distances to buried triangles would be cracks of zero width inside the body.

use super::bvh::{Bvh, area_vector};
use super::patch::patches;
use crate::cpu::par;
use glam::DVec3;
use std::sync::atomic::{AtomicU64, Ordering};

/// Edges up to this many spacings of the grid are tested at once. Longer ones are divided.
const LOOKED_AT: f64 = 1.0;
/// A triangle that is partly buried is cut into pieces with edges down to about this many spacings.
const FINEST: f64 = 0.125;
/// Distance of the query points before and behind a triangle, in spacings.
const ASIDE: f64 = 1e-3;
/// Corners are tested at this share of the way to the middle, since parts may meet on an edge.
const INWARD: f64 = 0.02;
/// Triangles per task.
const AT_ONCE: usize = 16;

type Triangle = [DVec3; 3];

/// What remains of a triangle.
#[derive(Debug, Clone, PartialEq)]
enum Left {
    All,
    Nothing,
    Pieces(Vec<Triangle>),
}

impl Left {
    /// The remaining triangles, of this one.
    fn of(self, triangle: Triangle) -> Vec<Triangle> {
        match self {
            Left::All => vec![triangle],
            Left::Nothing => Vec::new(),
            Left::Pieces(pieces) => pieces,
        }
    }
}

/// The part of these triangles that bounds the body, which is where the winding number exceeds one half, for a grid of
/// this spacing. `None` if it takes more work than `most`.
pub fn skin(tree: &Bvh, triangles: &[Triangle], spacing: f64, most: u64) -> Option<Vec<Triangle>> {
    let cutter = Cutter { tree, spacing, most, done: AtomicU64::new(0) };
    // Query points beside a triangle must be on its side of all others.
    let left = cutter.left(triangles, &patches(tree, triangles, 2.0 * ASIDE * spacing));
    if cutter.done.into_inner() > most {
        return None;
    }
    Some(triangles.iter().zip(left).flat_map(|(triangle, left)| left.of(*triangle)).collect())
}

struct Cutter<'a> {
    tree: &'a Bvh,
    spacing: f64,
    most: u64,
    /// Nodes of the tree visited so far: a sum of integers, which stops the work only where the result is discarded
    /// anyway.
    done: AtomicU64,
}

impl Cutter<'_> {
    /// The remainder of each triangle; that of the largest triangle of a patch applies to all of it.
    fn left(&self, triangles: &[Triangle], patch: &[Option<usize>]) -> Vec<Left> {
        let mut left: Vec<Left> = triangles.iter().map(|_| Left::Nothing).collect();
        par::each_chunk(&mut left, AT_ONCE, |chunk, left| {
            for (i, left) in (AT_ONCE * chunk..).zip(left) {
                match patch[i] {
                    Some(largest) if largest == i => *left = self.whole(&triangles[i]),
                    Some(_) => {}
                    None => *left = self.cut(triangles[i]),
                }
            }
        });
        for (i, largest) in patch.iter().enumerate() {
            if let Some(largest) = *largest {
                left[i] = left[largest].clone();
            }
        }
        left
    }

    /// The remainder of a triangle that is either buried as a whole or not at all.
    fn whole(&self, t: &Triangle) -> Left {
        if self.is_buried(middle(t), self.aside(t)) { Left::Nothing } else { Left::All }
    }

    fn aside(&self, t: &Triangle) -> DVec3 {
        area_vector(t).normalize_or_zero() * (ASIDE * self.spacing)
    }

    fn cut(&self, t: Triangle) -> Left {
        let (edge, length) = longest_edge(&t);
        let (middle, aside) = (middle(&t), self.aside(&t));
        if length <= LOOKED_AT * self.spacing {
            let here = self.is_buried(middle, aside);
            let as_here = |corner: DVec3| self.is_buried(corner + (middle - corner) * INWARD, aside) == here;
            if length <= FINEST * self.spacing || t.into_iter().all(as_here) {
                return if here { Left::Nothing } else { Left::All };
            }
        }
        if self.done.load(Ordering::Relaxed) > self.most {
            return Left::Nothing;
        }
        let [a, b, c] = [edge, (edge + 1) % 3, (edge + 2) % 3].map(|i| t[i]);
        let half = (a + b) * 0.5;
        let parts = [[a, half, c], [half, b, c]];
        match parts.map(|part| self.cut(part)) {
            [Left::All, Left::All] => Left::All,
            [Left::Nothing, Left::Nothing] => Left::Nothing,
            left => Left::Pieces(parts.into_iter().zip(left).flat_map(|(part, left)| left.of(part)).collect()),
        }
    }

    /// Whether the body is on both sides.
    fn is_buried(&self, at: DVec3, aside: DVec3) -> bool {
        let mut work = 0;
        let is_inside = |p: DVec3, work: &mut u64| self.tree.winding_number(p, work).abs() > 0.5;
        let buried = is_inside(at + aside, &mut work) && is_inside(at - aside, &mut work);
        self.done.fetch_add(work, Ordering::Relaxed);
        buried
    }
}

fn middle(t: &Triangle) -> DVec3 {
    (t[0] + t[1] + t[2]) / 3.0
}

/// The first corner of a triangle's longest edge, and its length.
fn longest_edge(t: &Triangle) -> (usize, f64) {
    let lengths = [0, 1, 2].map(|i| t[i].distance(t[(i + 1) % 3]));
    (0..3)
        .map(|i| (i, lengths[i]))
        .fold((0, lengths[0]), |longest, edge| if edge.1 > longest.1 { edge } else { longest })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spawn::SplitMix;

    /// A box of 12 n² triangles, or a ball of as many in its place.
    fn body(lo: DVec3, hi: DVec3, n: i32, round: bool) -> Vec<Triangle> {
        let at = |axis: usize, i: i32, k: i32| {
            // Corners have the same bits on all faces that share them.
            let [u, v] = [i, k].map(|j| f64::from(2 * j - n) / f64::from(n));
            let mut p = DVec3::ZERO;
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (1.0, u, v);
            let onto = |a: f64, b: f64| (1.0 - (a * a + b * b) / 2.0 + (a * a) * (b * b) / 3.0).sqrt();
            if round { p * DVec3::new(onto(p.y, p.z), onto(p.z, p.x), onto(p.x, p.y)) } else { p }
        };
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for (i, k) in (0..n).flat_map(|i| (0..n).map(move |k| (i, k))) {
                let [a, b, c, d] = [at(axis, i, k), at(axis, i + 1, k), at(axis, i + 1, k + 1), at(axis, i, k + 1)];
                triangles.extend([[a, b, c], [a, c, d], [-a, -c, -b], [-a, -d, -c]]);
            }
        }
        triangles.into_iter().map(|t| t.map(|p| (lo + hi) * 0.5 + (hi - lo) * 0.5 * p)).collect()
    }

    fn random_body(random: &mut SplitMix) -> Vec<Triangle> {
        let mut whole = |most: u64| (random.next() % (2 * most + 1)) as f64 - most as f64;
        // Some boxes have faces on common planes.
        let (middle, half) = (DVec3::new(whole(3), whole(3), whole(3)), DVec3::new(whole(1), whole(1), whole(1)) + 2.0);
        let n = [1, 2, 5, 8][random.next() as usize % 4];
        let round = random.next().is_multiple_of(2);
        body(middle - half, middle + half, if round { 6 + n } else { n }, round)
    }

    #[test]
    fn patches_are_buried_as_their_triangles_are() {
        let mut random = SplitMix(71);
        let (mut cut, mut spared) = (0, 0);
        for bodies in (0..24).map(|i| 1 + i % 4) {
            let mut triangles: Vec<_> = (0..bodies).flat_map(|_| random_body(&mut random)).collect();
            if random.next().is_multiple_of(8) {
                // A mesh with a hole is tested everywhere.
                triangles.pop();
            }
            let tree = Bvh::new(triangles.clone());
            let spacing = 0.7;
            let cutter = Cutter { tree: &tree, spacing, most: u64::MAX, done: AtomicU64::new(0) };
            let patch = patches(&tree, &triangles, 2.0 * ASIDE * spacing);
            let asked = cutter.left(&triangles, &vec![None; triangles.len()]);
            assert!(cutter.left(&triangles, &patch) == asked, "{bodies} bodies");
            cut += asked.iter().filter(|left| **left != Left::All).count();
            spared += patch.iter().enumerate().filter(|(i, of)| of.is_some_and(|of| of != *i)).count();
        }
        assert!(cut > 1000 && spared > 1000, "{cut} are not whole, {spared} are not asked");
    }

    /// A ball, one inside it and one beside it: three patches, however many triangles they have.
    #[test]
    fn bodies_that_touch_nothing_are_asked_once() {
        let of =
            |middle: f64, radius: f64| body(DVec3::splat(middle - radius), DVec3::splat(middle + radius), 16, true);
        let triangles = [of(0.0, 2.0), of(0.1, 1.0), of(5.0, 1.0)].concat();
        let kept = [of(0.0, 2.0), of(5.0, 1.0)].concat();
        let found = skin(&Bvh::new(triangles.clone()), &triangles, 0.5, triangles.len() as u64);
        assert!(found.is_some_and(|found| found == kept));
    }
}
