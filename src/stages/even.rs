//! How evenly matter lies around a particle: the mass of the emptiest of its 27 nodes over that of the fullest, and the
//! difference between opposite sides. Twin: `shaders/lib/even.wgsl`.
//!
//! The ratio is near 1 deep inside ordered matter, 0.5 to 0.6 in disordered matter and near 0 at a surface. Nodes on
//! walls of the domain, behind which there is no matter, do not count.
//!
//! Foam, which a splash leaves behind, has a ratio of about 0.4, as matter somewhat below a surface has. But there one
//! side is full: where a tenth of the kernel is empty, nodes two cells apart differ by half of a full node.

use crate::bins::{EDGE, TILE_EDGE, TILE_NODES, tile_first, tile_index};
use crate::cpu::constants::Constants;
use crate::material::Model;
use crate::math::real::{Lanes, Real};

/// Share of the fullest node that the emptiest must hold for matter to count as even. Disordered matter that has come
/// apart is hardly more even than that.
const EVEN: f64 = 0.6;

/// The same for sand and viscoplastic matter, which lie in pieces with gaps between them. With this share liquids would
/// take matter near their surface for the interior, and sink; sand and clay carry no load there.
const EVEN_IN_PIECES: f64 = 0.4;

/// Share of the fullest node that the emptiest must hold for matter to count as loose: films and drops have empty nodes
/// about them.
pub(crate) const SOME: f64 = 0.1;

/// Largest difference between opposite sides of loose matter, as a multiple of what is lacking.
pub(crate) const ONE_SIDED: f64 = 0.75;

/// The share from which matter of this model counts as even.
pub(crate) fn share(model: Model) -> f64 {
    match model {
        Model::Sand { .. } | Model::Viscoplastic { .. } => EVEN_IN_PIECES,
        Model::Liquid | Model::Elastic { .. } => EVEN,
    }
}

/// The least and the greatest mass among the 27 nodes of each cell of a block.
pub(super) struct Extremes<R> {
    /// The block's first node.
    origin: [u32; 3],
    /// By axis and cell, the nodes that count.
    counting: [[[usize; 3]; EDGE]; 3],
    /// Rows along x of the cells at [z][y].
    cells: [[[[R; 4]; 2]; EDGE]; EDGE],
}

impl<R: Real> Extremes<R> {
    /// For the block that begins at the node `origin`. `held` returns the mass of a node of its tile.
    pub fn of(origin: [u32; 3], constants: &Constants<R>, held: impl Fn(usize) -> R) -> Self {
        let counting = [0, 1, 2].map(|a| [0, 1, 2, 3].map(|i| inside(a, origin[a] + i, constants, i)));
        let [xs, ys, zs] = counting;
        let mut nodes = [R::of(0.0); TILE_NODES];
        nodes.iter_mut().enumerate().for_each(|(node, to)| *to = held(node));
        // First over rows of nodes, by cells along x, then over planes, then over all.
        let within = xs == [[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]];
        let none = [R::V::all(R::of(0.0)); 2];
        let mut lines = [[none; TILE_EDGE]; TILE_EDGE];
        let rows = nodes.as_chunks::<TILE_EDGE>().0;
        for (line, row) in lines.as_flattened_mut().iter_mut().zip(rows) {
            let of = |n: usize| {
                R::V::from4(if within {
                    [row[n], row[n + 1], row[n + 2], row[n + 3]]
                } else {
                    [row[xs[0][n]], row[xs[1][n]], row[xs[2][n]], row[xs[3][n]]]
                })
            };
            let held = [of(0), of(1), of(2)];
            *line = joined::<R>([[held[0]; 2], [held[1]; 2], [held[2]; 2]]);
        }
        let mut planes = [[none; EDGE]; TILE_EDGE];
        for (plane, lines) in planes.iter_mut().zip(&lines) {
            for (row, [a, b, c]) in plane.iter_mut().zip(ys) {
                *row = joined::<R>([lines[a], lines[b], lines[c]]);
            }
        }
        let mut cells = [[[[R::of(0.0); 4]; 2]; EDGE]; EDGE];
        for (cells, [a, b, c]) in cells.iter_mut().zip(zs) {
            for (y, cells) in cells.iter_mut().enumerate() {
                let [least, most] = joined::<R>([planes[a][y], planes[b][y], planes[c][y]]);
                *cells = [least.to4(), most.to4()];
            }
        }
        Extremes { origin, counting, cells }
    }

    /// The extremes of the cell whose first node is `first`.
    #[inline(always)]
    pub fn at(&self, first: [u32; 3]) -> [R; 2] {
        let [x, y, z] = self.cell(first);
        self.cells[z][y].map(|row| row[x])
    }

    /// The largest difference, along the axes, between what that cell's outer nodes before and behind the middle one
    /// hold. `held` returns what a node of the tile holds.
    #[inline(always)]
    pub fn difference(&self, first: [u32; 3], held: impl Fn(usize) -> R) -> R {
        let cell = self.cell(first);
        let nodes = [0, 1, 2].map(|a| self.counting[a][cell[a]]);
        let along = |a: usize| {
            let outer = |n: usize| {
                let at = |b: usize| nodes[b][if b == a { n } else { 1 }];
                held(tile_index(at(0), at(1), at(2)))
            };
            (outer(2) - outer(0)).abs()
        };
        along(0).max(along(1)).max(along(2))
    }

    #[inline(always)]
    fn cell(&self, first: [u32; 3]) -> [usize; 3] {
        [0, 1, 2].map(|a| (first[a] - self.origin[a]) as usize % EDGE)
    }
}

/// The least and the greatest of three such pairs.
#[inline(always)]
fn joined<R: Real>([a, b, c]: [[R::V; 2]; 3]) -> [R::V; 2] {
    [a[0].min(b[0]).min(c[0]), a[1].max(b[1]).max(c[1])]
}

/// Whether matter with these extremes lies evenly, from this share on.
#[inline(always)]
pub(super) fn is_even<R: Real>([least, most]: [R; 2], share: R) -> bool {
    least >= most * share
}

/// Whether matter with these extremes lies loosely, where `lacking` is the deficit and opposite sides differ by
/// `difference`, both as volume fractions.
#[inline(always)]
pub(super) fn is_loose<R: Real>(extremes: [R; 2], difference: impl FnOnce() -> R, lacking: R) -> bool {
    is_even(extremes, R::of(SOME)) && difference() <= lacking * R::of(ONE_SIDED)
}

/// Whether there are solids at nodes of the cell whose first node is `first`, and matter lies evenly from the `share`
/// on: at all nodes (`even`), or at those without solids. Masses of nodes with solids are negated.
pub(super) fn is_even_beside<R: Real>(
    held: &[R; TILE_NODES],
    origin: [u32; 3],
    first: [u32; 3],
    constants: &Constants<R>,
    share: R,
    even: bool,
) -> bool {
    let zero = R::of(0.0);
    let at = [0, 1, 2].map(|a| first[a] - origin[a]);
    let nodes = &held[tile_first(first, origin)..];
    let (mut open, mut least) = (zero, zero);
    for n in 0..27 {
        let held = nodes[tile_index(n % 3, n / 3 % 3, n / 9)];
        (open, least) = (open.max(held), least.min(held));
    }
    if least >= zero || even {
        return least < zero;
    }
    // Nodes of solids count as the fullest of the others.
    let [xs, ys, zs] = [0, 1, 2].map(|a| inside(a, first[a], constants, at[a]));
    let mut extremes = [open, zero];
    for z in zs {
        for y in ys {
            for x in xs {
                let held = held[tile_index(x, y, z)];
                let counts = if held < zero { open } else { held };
                extremes = [extremes[0].min(counts), extremes[1].max(counts)];
            }
        }
    }
    open > zero && is_even(extremes, share)
}

/// How evenly matter lies, from 0 to 1; −1 where it is sparse.
#[inline(always)]
pub(super) fn evenness<R: Real>([least, most]: [R; 2], constants: &Constants<R>) -> R {
    if most < constants.lightest * R::of(SPARSE) {
        return R::of(-1.0);
    }
    least * (R::of(1.0) / most.max(R::of(NOTHING)))
}

/// Matter of which no node holds as much, in cells, is sparse. In a corner between walls a single node counts, which
/// does not tell a particle by itself from many.
pub(crate) const SPARSE: f64 = 0.5;

/// Less than the mass of any node that a particle has added to.
pub(crate) const NOTHING: f64 = 1e-30;

/// Of an axis' three nodes from `first` on, which is number `at` in the tile: those that are not on walls or behind
/// them, repeated in place of the others; all if none is left. Returned as numbers in the tile.
fn inside<R: Real>(axis: usize, first: u32, constants: &Constants<R>, at: u32) -> [usize; 3] {
    let sides = constants.open_sides >> (2 * axis);
    let counts = |i: u32| {
        let node = R::of(f64::from(first + i));
        (sides & 1 != 0 || node - constants.lo[axis] >= R::of(0.5))
            && (sides & 2 != 0 || constants.hi[axis] - node >= R::of(0.5))
    };
    let nodes = match [counts(0), counts(1), counts(2)] {
        [true, _, true] | [false, false, false] => [0, 1, 2],
        [true, middle, false] => [0, u32::from(middle), u32::from(middle)],
        [false, true, last] => [1, 1, 1 + u32::from(last)],
        [false, false, true] => [2, 2, 2],
    };
    nodes.map(|n| (at + n) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A deficit counts as one beside a solid only where there is a solid, and not where the liquid also ends
    /// otherwise.
    #[test]
    fn what_is_beside_solids_is_even_where_they_are_not() {
        let constants = Constants { lo: [-9.0; 3], hi: [30.0; 3], ..Constants::default() };
        let of = |held: [f64; 3], even| {
            let mut nodes = [0.0; TILE_NODES];
            for n in 0..27 {
                nodes[tile_index(n % 3, n / 3 % 3, n / 9)] = held[n % 3];
            }
            is_even_beside(&nodes, [4; 3], [4; 3], &constants, EVEN, even)
        };
        // Liquid before a solid, and before air; a thin film between both; all within a solid.
        assert!(of([1.0, 0.9, -0.3], false) && of([1.0, -0.3, -0.5], false));
        assert!(!of([1.0, 0.9, 0.3], false) && !of([1.0, 0.9, 0.8], true));
        assert!(!of([0.3, 1.0, -0.5], false));
        assert!(!of([-0.3, -0.9, -0.8], false) && of([-0.3, -0.9, -0.8], true));
    }

    /// A uniform foam lies loosely, matter below a surface does not, nor does a film; at a wall the nodes on it do not
    /// count.
    #[test]
    fn what_lacks_alike_on_both_sides_is_loose() {
        let constants = Constants { lo: [5.0; 3], hi: [30.0; 3], ..Constants::default() };
        let of = |first: [u32; 3], lacking: f64, held: fn(usize) -> f64| {
            let nodes: [f64; TILE_NODES] = std::array::from_fn(|n| held(n / TILE_EDGE % TILE_EDGE));
            let extremes = Extremes::of([4; 3], &constants, |n| nodes[n]);
            is_loose(extremes.at(first), || extremes.difference(first, |n| nodes[n]), lacking)
        };
        // By height: fluctuations; a surface between the fourth and the fifth node; a film.
        let foam = |y: usize| [0.3, 0.4, 0.6, 0.4, 0.5, 0.6][y];
        let surface = |y: usize| [1.0, 1.0, 1.0, 0.8, 0.2, 0.0][y];
        let film = |y: usize| [0.0, 0.0, 0.02, 0.6, 0.02, 0.0][y];
        assert!(of([6; 3], 0.5, foam) && !of([6; 3], 0.1, foam));
        assert!(!of([6, 5, 6], 0.1, surface) && !of([6, 6, 6], 0.4, surface));
        assert!(!of([6, 6, 6], 0.6, film));
        // On the wall, node 1, the middle takes the place of the lower node.
        assert!(of([6, 5, 6], 0.3, |y| [0.0, 0.0, 0.6, 0.7, 0.6, 0.6][y]));
    }

    /// The extremes equal those of each cell's 27 nodes one by one, except nodes within half a cell of a wall or behind
    /// it.
    #[test]
    fn extremes_are_those_of_the_nodes_inside() {
        for (lo, hi, open_sides) in
            [(4.2, 6.7, 0), (5.3, 30.0, 0b10), (-9.0, 30.0, 0), (4.2, 6.7, 0b11_1111), (5.0, 5.6, 0)]
        {
            let constants = Constants { lo: [lo; 3], hi: [hi; 3], open_sides, ..Constants::default() };
            let held: Vec<f64> = (0..TILE_NODES).map(|node| (node * 7919 % 1009) as f64).collect();
            let extremes = Extremes::of([4; 3], &constants, |node| held[node]);
            let counts = |axis: usize, n: u32| {
                let sides = open_sides >> (2 * axis);
                (sides & 1 != 0 || f64::from(n) - lo >= 0.5) && (sides & 2 != 0 || hi - f64::from(n) >= 0.5)
            };
            let nodes = |axis: usize, first: u32| {
                let all: Vec<u32> = (first..first + 3).collect();
                let some: Vec<u32> = all.iter().copied().filter(|&n| counts(axis, n)).collect();
                if some.is_empty() { all } else { some }
            };
            for cell in 0..64 {
                let first = [4 + cell % 4, 4 + cell / 4 % 4, 4 + cell / 16];
                let mut expected = [f64::INFINITY, 0.0];
                for z in nodes(2, first[2]) {
                    for y in nodes(1, first[1]) {
                        for x in nodes(0, first[0]) {
                            let held = held[tile_index(x as usize - 4, y as usize - 4, z as usize - 4)];
                            expected = [held.min(expected[0]), held.max(expected[1])];
                        }
                    }
                }
                assert_eq!(extremes.at(first), expected, "{first:?} within {lo} … {hi}");
            }
        }
    }
}
