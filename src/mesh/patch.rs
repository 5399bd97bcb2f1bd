//! Patches of a closed mesh: sets of triangles that are either all buried or all not.
//!
//! The winding number of a closed mesh is an integer that changes only across triangles. If nothing else comes near a
//! triangle, except neighbours at its corners and edges, each of its sides is therefore the same everywhere, and
//! remains so across an edge at which just two such triangles meet.

use super::bvh::{Bvh, area_vector};
use crate::cpu::par;
use glam::DVec3;

type Triangle = [DVec3; 3];

/// Triangles that one task takes.
const AT_ONCE: usize = 64;
/// Largest number of nodes and triangles visited beside a triangle; beyond it the triangle counts as touching
/// something.
const MOST_BESIDE: u64 = 512;

/// For each triangle a representative that is buried if and only if this one is: the largest triangle of its patch.
/// `None` for a triangle that comes within `margin` of others than its neighbours, and everywhere in a mesh that is not
/// closed.
pub fn patches(tree: &Bvh, triangles: &[Triangle], margin: f64) -> Vec<Option<usize>> {
    let edges = edges(triangles);
    let closed = |at_edge: &[Edge]| at_edge.iter().map(|edge| edge.direction).sum::<i32>() == 0;
    if !edges.chunk_by(Edge::joins).all(closed) {
        return vec![None; triangles.len()];
    }
    let mut lonely = vec![false; triangles.len()];
    par::each_chunk(&mut lonely, AT_ONCE, |chunk, lonely| {
        for (triangle, lonely) in triangles[AT_ONCE * chunk..].iter().zip(lonely) {
            let is_apart = |other: &Triangle| are_apart(triangle, other, margin);
            *lonely = tree.all_near(triangle, margin, MOST_BESIDE, is_apart);
        }
    });
    let mut patch: Vec<usize> = (0..triangles.len()).collect();
    for pair in edges.chunk_by(Edge::joins) {
        if let [a, b] = pair
            && lonely[a.triangle]
            && lonely[b.triangle]
        {
            let (a, b) = (root(&mut patch, a.triangle), root(&mut patch, b.triangle));
            patch[a.max(b)] = a.min(b);
        }
    }
    let size = |i: usize| area_vector(&triangles[i]).length_squared();
    let mut largest: Vec<usize> = (0..triangles.len()).collect();
    for i in 0..triangles.len() {
        let of = root(&mut patch, i);
        if size(i) > size(largest[of]) {
            largest[of] = i;
        }
    }
    (0..triangles.len()).map(|i| lonely[i].then(|| largest[root(&mut patch, i)])).collect()
}

/// The representative of a patch.
fn root(patch: &mut [usize], mut at: usize) -> usize {
    while patch[at] != at {
        patch[at] = patch[patch[at]];
        at = patch[at];
    }
    at
}

/// A triangle's edge between two corners, which are numbered by position.
struct Edge {
    corners: [u32; 2],
    triangle: usize,
    /// 1 from the first to the second corner, −1 back.
    direction: i32,
}

impl Edge {
    fn joins(&self, other: &Edge) -> bool {
        self.corners == other.corners
    }
}

/// The edges of all triangles; those between the same corners are adjacent.
fn edges(triangles: &[Triangle]) -> Vec<Edge> {
    // −0 is the same position as 0.
    let bits = |i: usize| (triangles[i / 3][i % 3] + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut order: Vec<usize> = (0..3 * triangles.len()).collect();
    order.sort_unstable_by_key(|i| bits(*i));
    let mut number = vec![0; order.len()];
    for (n, same) in (0..).zip(order.chunk_by(|a, b| bits(*a) == bits(*b))) {
        for corner in same {
            number[*corner] = n;
        }
    }
    let edge = |corner: usize| {
        let (a, b) = (number[corner], number[corner / 3 * 3 + (corner + 1) % 3]);
        let direction = if a < b { 1 } else { -1 };
        Edge { corners: [a.min(b), a.max(b)], triangle: corner / 3, direction }
    };
    let mut edges: Vec<Edge> = (0..number.len()).map(edge).collect();
    edges.sort_unstable_by_key(|edge| (edge.corners, edge.triangle));
    edges
}

/// Whether two triangles have at most corners and an edge in common: apart from these, each is more than `margin` away
/// from the other. Coinciding triangles count as one.
fn are_apart(a: &Triangle, b: &Triangle, margin: f64) -> bool {
    let shared = |p: &DVec3, other: &Triangle| other.contains(p);
    let own = |t: &Triangle, other: &Triangle| [0, 1, 2].into_iter().find(|i| !shared(&t[*i], other));
    match a.iter().filter(|p| shared(p, b)).count() {
        0 => are_separate(a, b, margin),
        1 => {
            // If they meet beyond a corner, the side opposite that corner of one of them does.
            let across = |t: &Triangle, other: &Triangle| {
                let corner = (0..3).find(|i| shared(&t[*i], other)).unwrap_or(0);
                let (p, q) = (t[(corner + 1) % 3], t[(corner + 2) % 3]);
                [p, q, q]
            };
            are_separate(&across(a, b), b, margin) && are_separate(a, &across(b, a), margin)
        }
        2 => {
            // They are not folded onto each other.
            let (Some(i), Some(k)) = (own(a, b), own(b, a)) else { return false };
            let (from, along) = (a[(i + 1) % 3], a[(i + 2) % 3] - a[(i + 1) % 3]);
            let normal = along.cross(b[k] - from);
            let inward = normal.cross(along);
            let up = normal.dot(a[i] - from).abs();
            inward.dot(a[i] - from) < 0.0 || up > margin * normal.length()
        }
        _ => true,
    }
}

/// Whether a plane with a gap of more than `margin` on it separates two triangles. If they are that far apart it always
/// does, except for tiny ones. Triangles may be degenerate, shrunk to an edge.
fn are_separate(a: &Triangle, b: &Triangle, margin: f64) -> bool {
    let [p, q] = [a, b].map(|t| t.map(|corner| corner - a[0]));
    let sides = |t: &Triangle| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let (u, v) = (sides(&p), sides(&q));
    let normals = [u[0].cross(u[1]), v[0].cross(v[1])];
    let in_planes = normals.into_iter().flat_map(|n| u.into_iter().chain(v).map(move |side| n.cross(side)));
    let across = u.into_iter().flat_map(|side| v.into_iter().map(move |other| side.cross(other)));
    let range = |t: &Triangle, axis: DVec3| {
        let [x, y, z] = t.map(|corner| corner.dot(axis));
        (x.min(y).min(z), x.max(y).max(z))
    };
    normals.into_iter().chain(in_planes).chain(across).any(|axis| {
        let (p, q) = (range(&p, axis), range(&q, axis));
        let gap = (q.0 - p.1).max(p.0 - q.1);
        gap > 0.0 && gap * gap > margin * margin * axis.length_squared()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of triangles in the plane z = 0, in tenths, the last corner at some height.
    fn triangle(corners: [[i32; 2]; 3], height: f64) -> Triangle {
        let [a, b, c] = corners.map(|[x, y]| DVec3::new(f64::from(x), f64::from(y), 0.0));
        [a, b, c + DVec3::Z * height]
    }

    #[test]
    fn neighbours_are_apart_and_folds_are_not() {
        let t = triangle([[0, 0], [10, 0], [0, 10]], 0.0);
        for (name, other, apart) in [
            ("beside it in its plane", triangle([[10, 10], [20, 10], [10, 20]], 0.0), true),
            ("through it", [DVec3::new(2.0, 2.0, -1.0), DVec3::new(2.0, 3.0, 1.0), DVec3::new(9.0, 9.0, 1.0)], false),
            ("just above it", t.map(|p| p + DVec3::Z * 0.01), false),
            ("well above it", t.map(|p| p + DVec3::Z), true),
            ("at a corner in its plane", triangle([[0, 0], [-10, 0], [0, -10]], 0.0), true),
            ("at a corner along its edge", triangle([[0, 0], [-10, 0], [-10, 5]], 0.0), true),
            ("at a corner and over it", triangle([[0, 0], [2, 8], [8, 2]], 0.0), false),
            ("at a corner and through it", [t[0], DVec3::new(4.0, 1.0, -1.0), DVec3::new(1.0, 4.0, 1.0)], false),
            ("at a corner and above it", [t[0], DVec3::new(4.0, 1.0, 1.0), DVec3::new(1.0, 4.0, 1.0)], true),
            ("at an edge in its plane", triangle([[0, 0], [10, 0], [0, -10]], 0.0), true),
            ("at an edge and folded onto it", triangle([[0, 0], [10, 0], [3, 5]], 0.0), false),
            ("at an edge and nearly folded", triangle([[0, 0], [10, 0], [3, 5]], 0.01), false),
            ("at an edge and upright", triangle([[0, 0], [10, 0], [3, 0]], 5.0), true),
            ("the same", [t[1], t[0], t[2]], true),
        ] {
            assert_eq!(are_apart(&t, &other, 0.1), apart, "{name}");
            assert_eq!(are_apart(&other, &t, 0.1), apart, "{name}, the other way round");
        }
    }
}
