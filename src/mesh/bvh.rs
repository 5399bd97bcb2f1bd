//! A bounding volume hierarchy of triangles: the distance to the nearest triangle, and the winding number around a
//! point.
//!
//! The winding number also distinguishes inside from outside for meshes with holes, doubled faces and intersecting
//! parts, for which a sign by normals or by crossings of a ray gives stray points. Far parts count as one dipole
//! (Barill et al. 2018).

use glam::DVec3;
use std::f64::consts::PI;

/// Most triangles of a leaf.
const LEAF: usize = 4;
/// A part of the mesh counts as one dipole from this many times its radius: the second term is then below 2 % of a
/// turn.
const FAR: f64 = 2.0;

#[derive(Debug)]
struct Node {
    lo: DVec3,
    hi: DVec3,
    /// Sum of the triangles' area vectors, the middle of their area, and the farthest corner of the box from there.
    area: DVec3,
    middle: DVec3,
    radius: f64,
    /// The triangles of a leaf. For other nodes `first` is the left child, the right one follows it, and `count` is 0.
    first: usize,
    count: usize,
}

/// Triangles in a tree, for distance queries.
#[derive(Debug)]
pub(crate) struct Bvh {
    triangles: Vec<[DVec3; 3]>,
    nodes: Vec<Node>,
}

impl Bvh {
    /// Takes at least one triangle; all must have an area.
    pub fn new(mut triangles: Vec<[DVec3; 3]>) -> Self {
        let mut nodes = vec![node(&triangles, 0..triangles.len())];
        let mut open = vec![0];
        while let Some(at) = open.pop() {
            let range = nodes[at].first..nodes[at].first + nodes[at].count;
            if range.len() <= LEAF {
                continue;
            }
            let size = nodes[at].hi - nodes[at].lo;
            let axis = (0..3).fold(0, |best, a| if size[a] > size[best] { a } else { best });
            let half = range.len() / 2;
            let along = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
            triangles[range.clone()].select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)));
            let left = nodes.len();
            nodes.push(node(&triangles, range.start..range.start + half));
            nodes.push(node(&triangles, range.start + half..range.end));
            (nodes[at].first, nodes[at].count) = (left, 0);
            open.extend([left, left + 1]);
        }
        Bvh { triangles, nodes }
    }

    /// Lower and upper corner of the box around all triangles.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        (self.nodes[0].lo, self.nodes[0].hi)
    }

    /// Distance from `p` to the nearest triangle, if it is known to be at most `bound`. Adds the number of nodes
    /// visited to `work`.
    pub fn distance(&self, p: DVec3, bound: f64, work: &mut u64) -> f64 {
        let mut best = bound * bound;
        let mut open = Vec::with_capacity(64);
        open.push((0, self.box_distance(0, p)));
        while let Some((at, nearest)) = open.pop() {
            *work += 1;
            if nearest > best {
                continue;
            }
            let node = &self.nodes[at];
            if node.count > 0 {
                let triangles = &self.triangles[node.first..node.first + node.count];
                best = triangles.iter().map(|t| nearest_point(t, p).distance_squared(p)).fold(best, f64::min);
                continue;
            }
            let [left, right] = [node.first, node.first + 1].map(|child| (child, self.box_distance(child, p)));
            open.extend(if left.1 <= right.1 { [right, left] } else { [left, right] });
        }
        best.sqrt()
    }

    /// Squared distance from `p` to a node's box.
    fn box_distance(&self, node: usize, p: DVec3) -> f64 {
        p.distance_squared(p.clamp(self.nodes[node].lo, self.nodes[node].hi))
    }

    /// Whether all triangles whose boxes come within `margin` of this one's box satisfy `asked`. Also `false` if more
    /// than `most` nodes and triangles would have to be visited.
    pub fn all_near(&self, t: &[DVec3; 3], margin: f64, most: u64, asked: impl Fn(&[DVec3; 3]) -> bool) -> bool {
        let (lo, hi) = (t[0].min(t[1]).min(t[2]) - margin, t[0].max(t[1]).max(t[2]) + margin);
        let meets = |from: DVec3, to: DVec3| from.cmple(hi).all() && to.cmpge(lo).all();
        let mut work = 0;
        let mut open = Vec::with_capacity(64);
        open.push(0);
        while let Some(at) = open.pop() {
            let node = &self.nodes[at];
            if !meets(node.lo, node.hi) {
                continue;
            }
            work += 1 + node.count as u64;
            if work > most {
                return false;
            }
            let near = |t: &&[DVec3; 3]| meets(t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
            if node.count == 0 {
                open.extend([node.first, node.first + 1]);
            } else if !self.triangles[node.first..node.first + node.count].iter().filter(near).all(&asked) {
                return false;
            }
        }
        true
    }

    /// How often the triangles wind around `p`: 1 inside a closed mesh whose faces run anticlockwise seen from outside.
    /// Adds the number of nodes visited to `work`.
    pub fn winding_number(&self, p: DVec3, work: &mut u64) -> f64 {
        let mut sum = 0.0;
        let mut open = Vec::with_capacity(64);
        open.push(0);
        while let Some(at) = open.pop() {
            *work += 1;
            let node = &self.nodes[at];
            let to = node.middle - p;
            let distance = to.length();
            if distance > FAR * node.radius {
                sum += node.area.dot(to) / (distance * distance * distance);
            } else if node.count > 0 {
                let triangles = &self.triangles[node.first..node.first + node.count];
                sum += triangles.iter().map(|t| solid_angle(t, p)).sum::<f64>();
            } else {
                open.extend([node.first + 1, node.first]);
            }
        }
        sum / (4.0 * PI)
    }
}

/// The node of some triangles, at first a leaf.
fn node(triangles: &[[DVec3; 3]], range: std::ops::Range<usize>) -> Node {
    let mut lo = DVec3::INFINITY;
    let mut hi = DVec3::NEG_INFINITY;
    let (mut area, mut moment, mut size) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for t in &triangles[range.clone()] {
        let vector = area_vector(t);
        let length = vector.length();
        area += vector;
        size += length;
        moment += (t[0] + t[1] + t[2]) * (length / 3.0);
        for corner in t {
            (lo, hi) = (lo.min(*corner), hi.max(*corner));
        }
    }
    let middle = if size > 0.0 { moment / size } else { (lo + hi) * 0.5 };
    let radius = (hi - middle).max(middle - lo).length();
    Node { lo, hi, area, middle, radius, first: range.start, count: range.len() }
}

/// Normal whose length is the area.
pub(crate) fn area_vector([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (*b - *a).cross(*c - *a) * 0.5
}

/// The point of a triangle nearest to `p`, by the region of the triangle's plane that `p` projects to (Ericson 2005,
/// 5.1.5).
fn nearest_point([a, b, c]: &[DVec3; 3], p: DVec3) -> DVec3 {
    let (ab, ac) = (*b - *a, *c - *a);
    let from = |corner: DVec3| (ab.dot(p - corner), ac.dot(p - corner));
    let ((a1, a2), (b1, b2), (c1, c2)) = (from(*a), from(*b), from(*c));
    if a1 <= 0.0 && a2 <= 0.0 {
        return *a;
    }
    if b1 >= 0.0 && b2 <= b1 {
        return *b;
    }
    let over_c = a1 * b2 - b1 * a2;
    if over_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        return *a + ab * (a1 / (a1 - b1));
    }
    if c2 >= 0.0 && c1 <= c2 {
        return *c;
    }
    let over_b = c1 * a2 - a1 * c2;
    if over_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        return *a + ac * (a2 / (a2 - c2));
    }
    let over_a = b1 * c2 - c1 * b2;
    if over_a <= 0.0 && b2 >= b1 && c1 >= c2 {
        return *b + (*c - *b) * ((b2 - b1) / ((b2 - b1) + (c1 - c2)));
    }
    let inverse = 1.0 / (over_a + over_b + over_c);
    *a + ab * (over_b * inverse) + ac * (over_c * inverse)
}

/// Signed solid angle of a triangle seen from `p` (Van Oosterom and Strackee 1983).
fn solid_angle(triangle: &[DVec3; 3], p: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let above = a.dot(b.cross(c));
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * above.atan2(below)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evenly distributed in −1 … 1.
    fn point(i: u32) -> DVec3 {
        let h = |k: u32| f64::from((i * 7919 + k * 104_729) % 1009) / 504.5 - 1.0;
        DVec3::new(h(1), h(2), h(3))
    }

    fn random_triangles(count: u32) -> Vec<[DVec3; 3]> {
        (0..count).map(|i| [point(i), point(i) + 0.3 * point(i + 77), point(i) + 0.3 * point(i + 191)]).collect()
    }

    #[test]
    fn the_tree_gives_the_distance_that_all_triangles_give() {
        let triangles = random_triangles(300);
        let tree = Bvh::new(triangles.clone());
        for i in 0..500 {
            let p = 1.5 * point(i + 5);
            // Compared with samples of every triangle: none is nearer, and the nearest is about as near.
            let sampled = triangles.iter().flat_map(|[a, b, c]| {
                (0..=20).flat_map(move |u| {
                    (0..=20 - u)
                        .map(move |v| *a + (*b - *a) * (f64::from(u) / 20.0) + (*c - *a) * (f64::from(v) / 20.0))
                })
            });
            let near = sampled.map(|s| s.distance(p)).fold(f64::INFINITY, f64::min);
            let found = tree.distance(p, f64::INFINITY, &mut 0);
            assert!(found <= near + 1e-12 && found > near - 0.02, "{p}: {found} {near}");
            assert!((tree.distance(p, found * 1.001, &mut 0) - found).abs() < 1e-12);
        }
    }

    #[test]
    fn dipoles_give_the_winding_number_that_all_triangles_give() {
        let triangles = random_triangles(300);
        let tree = Bvh::new(triangles.clone());
        for i in 0..500 {
            let p = 2.0 * point(i + 5);
            let exact = triangles.iter().map(|t| solid_angle(t, p)).sum::<f64>() / (4.0 * PI);
            let found = tree.winding_number(p, &mut 0);
            assert!((found - exact).abs() < 0.05, "{p}: {found} {exact}");
        }
    }
}
