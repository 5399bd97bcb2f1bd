//! The triangles that bound a mesh, without those that lie buried where its parts overlap or abut.
//!
//! Distances to buried ones would be cracks of no width inside the body.

use super::bvh::{Bvh, area_vector};
use crate::cpu::par;
use glam::DVec3;
use std::sync::atomic::{AtomicU64, Ordering};

/// Edges up to so many of the grid's spacings are looked at once. Longer ones are divided.
const LOOKED_AT: f64 = 1.0;
/// Where a part of a triangle is buried and another is not, it is cut to pieces with edges down to so many spacings.
const FINEST: f64 = 0.125;
/// How far before and behind a triangle it is asked what is there, spacings.
const ASIDE: f64 = 1e-3;
/// Corners are asked for this share of the way to the middle away from them: on an edge parts may meet.
const INWARD: f64 = 0.02;
/// Triangles that one task takes.
const AT_ONCE: usize = 16;

type Triangle = [DVec3; 3];

/// What remains of a triangle.
enum Left {
    All,
    Nothing,
    Pieces(Vec<Triangle>),
}

impl Left {
    /// What remains, of this triangle.
    fn of(self, triangle: Triangle) -> Vec<Triangle> {
        match self {
            Left::All => vec![triangle],
            Left::Nothing => Vec::new(),
            Left::Pieces(pieces) => pieces,
        }
    }
}

/// Of these triangles what bounds the body that winds around points more than half a time, for a grid of this spacing. `None`
/// where it takes more work than `most`.
pub fn skin(tree: &Bvh, triangles: &[Triangle], spacing: f64, most: u64) -> Option<Vec<Triangle>> {
    let cutter = Cutter { tree, spacing, most, done: AtomicU64::new(0) };
    let mut left: Vec<Left> = triangles.iter().map(|_| Left::Nothing).collect();
    par::each_chunk(&mut left, AT_ONCE, |chunk, left| {
        for (triangle, left) in triangles[AT_ONCE * chunk..].iter().zip(left) {
            *left = cutter.cut(*triangle);
        }
    });
    if cutter.done.into_inner() > most {
        return None;
    }
    Some(triangles.iter().zip(left).flat_map(|(triangle, left)| left.of(*triangle)).collect())
}

struct Cutter<'a> {
    tree: &'a Bvh,
    spacing: f64,
    most: u64,
    /// Nodes of the tree that have been visited: a sum of integers, which only stops the work where the result is lost anyway.
    done: AtomicU64,
}

impl Cutter<'_> {
    fn cut(&self, t: Triangle) -> Left {
        let (edge, length) = longest_edge(&t);
        let middle = (t[0] + t[1] + t[2]) / 3.0;
        let aside = area_vector(&t).normalize_or_zero() * (ASIDE * self.spacing);
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

/// The first corner of a triangle's longest edge, and its length.
fn longest_edge(t: &Triangle) -> (usize, f64) {
    let lengths = [0, 1, 2].map(|i| t[i].distance(t[(i + 1) % 3]));
    (0..3)
        .map(|i| (i, lengths[i]))
        .fold((0, lengths[0]), |longest, edge| if edge.1 > longest.1 { edge } else { longest })
}
