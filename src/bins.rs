//! Blocks of the sparse grid, as both solvers use them: a block, its key, its neighbours and its tile. Twin:
//! `shaders/lib/bins.wgsl`.
//!
//! A block is 4³ nodes. A particle belongs to the block of the first of its 27 nodes, so that it touches nodes of that
//! block and of the seven blocks above it: together a tile of 6³ nodes.

use crate::math::real::{Lanes, Real};

/// Nodes along a block's edge.
pub const EDGE: usize = 4;
/// Nodes in a block.
pub const NODES: usize = EDGE * EDGE * EDGE;
/// Nodes along a tile's edge.
pub const TILE_EDGE: usize = EDGE + 2;
/// Nodes in a tile.
pub const TILE_NODES: usize = TILE_EDGE * TILE_EDGE * TILE_EDGE;
/// No block.
pub const NONE: u32 = u32::MAX;
/// Bits of a block's coordinate in its key.
pub(crate) const KEY_BITS: u32 = 10;

/// The largest coordinate of a block.
pub(crate) const LAST_BLOCK: u32 = (1 << KEY_BITS) - 1;

/// Key of the block with these coordinates.
#[inline(always)]
pub fn key(block: [u32; 3]) -> u32 {
    block[0] | block[1] << KEY_BITS | block[2] << (2 * KEY_BITS)
}

/// Coordinates of the block with this key.
#[inline(always)]
pub fn coordinates(key: u32) -> [u32; 3] {
    let mask = (1 << KEY_BITS) - 1;
    [key & mask, key >> KEY_BITS & mask, key >> (2 * KEY_BITS) & mask]
}

/// First cell of the block with this key.
#[inline(always)]
pub fn origin(key: u32) -> [u32; 3] {
    coordinates(key).map(|c| c * EDGE as u32)
}

/// The last blocks along the axes before matter is repeated, which begins with block 1; 0 where it is not.
#[inline(always)]
pub fn last_blocks<R: Real>(period: [R; 3]) -> [u32; 3] {
    period.map(|length| length.floor_index() / EDGE as u32)
}

/// The block with these coordinates, where one beyond an end of the repeated ones is the one at the other end.
#[inline(always)]
pub fn wrapped(block: [u32; 3], last: [u32; 3]) -> [u32; 3] {
    [0, 1, 2].map(|a| match block[a] {
        _ if last[a] == 0 => block[a],
        0 => last[a],
        c if c > last[a] => 1,
        c => c,
    })
}

/// Key of the `k`-th of the eight blocks of a tile: bit 0 of `k` is one up in x, bit 1 in y, bit 2 in z.
#[inline(always)]
pub fn neighbour(block: u32, k: u32, last: [u32; 3]) -> u32 {
    let at = coordinates(block);
    key(wrapped([0, 1, 2].map(|axis| at[axis] + (k >> axis & 1)), last))
}

/// Key of the block that a particle at `x` belongs to.
#[inline(always)]
pub fn key_at<R: Real>([x, y, z]: [R; 3]) -> u32 {
    let half = R::of(0.5);
    let ([x, y, z, _], _) = R::truncated(R::V::from4([x, y, z, half]) - R::V::all(half));
    key([x, y, z].map(|x| x >> 2))
}

/// Multiplicative hash of a key, before masking.
#[inline(always)]
pub fn hash(key: u32) -> u32 {
    let h = key.wrapping_mul(0x9E37_79B1);
    h ^ h >> 15
}

/// Index in a tile of the node at these tile coordinates.
#[inline(always)]
pub fn tile_index(x: usize, y: usize, z: usize) -> usize {
    (z * TILE_EDGE + y) * TILE_EDGE + x
}

/// Index of the first of 27 nodes in a tile that begins at the node `origin`. Each other node follows at the
/// [`tile_index`] of its offset from the first.
#[inline(always)]
pub fn tile_first(first: [u32; 3], origin: [u32; 3]) -> usize {
    tile_index((first[0] - origin[0]) as usize, (first[1] - origin[1]) as usize, (first[2] - origin[2]) as usize)
}

/// Index in a block of the node at these block coordinates.
#[inline(always)]
pub fn node_index(x: usize, y: usize, z: usize) -> usize {
    (z * EDGE + y) * EDGE + x
}

/// The rows of nodes that a tile has in its `k`-th block: `(first tile index, first node index)`. Each is
/// [`row_length`]`(k)` nodes long. Both the scatter's merge and the gather's load iterate over these.
#[inline(always)]
pub fn tile_rows(k: usize) -> impl Iterator<Item = (usize, usize)> {
    let [x, y, z] = [0, 1, 2].map(|axis| (k >> axis & 1) * EDGE);
    let across = move |first: usize| 0..(TILE_EDGE - first).min(EDGE);
    across(z).flat_map(move |dz| across(y).map(move |dy| (tile_index(x, y + dy, z + dz), node_index(0, dy, dz))))
}

/// Nodes in a row that a tile has in its `k`-th block.
#[inline(always)]
pub fn row_length(k: usize) -> usize {
    if k & 1 == 0 { EDGE } else { TILE_EDGE - EDGE }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_blocks_and_of_neighbours() {
        for at in [[0, 0, 0], [1, 2, 3], [1022, 7, 1022], [5, 1022, 0]] {
            let k = key(at);
            assert_eq!(coordinates(k), at);
            for n in 0..8 {
                let up = [0, 1, 2].map(|axis| at[axis] + (n >> axis & 1));
                assert_eq!(coordinates(neighbour(k, n, [0; 3])), up);
            }
        }
    }

    /// Between periodic sides 12 cells apart along x, and 20 along z.
    #[test]
    fn the_last_block_is_beside_the_first() {
        let last = last_blocks([12.0f32, 0.0, 20.0]);
        assert_eq!(last, [3, 0, 5]);
        assert_eq!(coordinates(neighbour(key([3, 7, 5]), 0b111, last)), [1, 8, 1]);
        assert_eq!(coordinates(neighbour(key([2, 7, 4]), 0b101, last)), [3, 7, 5]);
        assert_eq!(wrapped([0, 0, 3], last), [3, 0, 3]);
    }

    #[test]
    fn tile_rows_cover_the_tile_once() {
        let mut seen = [0u32; TILE_NODES];
        for k in 0..8 {
            for (tile, node) in tile_rows(k) {
                for i in 0..row_length(k) {
                    seen[tile + i] += 1;
                    let at = [
                        (tile + i) % TILE_EDGE,
                        (tile + i) / TILE_EDGE % TILE_EDGE,
                        (tile + i) / TILE_EDGE / TILE_EDGE,
                    ];
                    assert_eq!(k, (0..3).map(|axis| (at[axis] / EDGE) << axis).sum::<usize>());
                    assert_eq!(node + i, node_index(at[0] % EDGE, at[1] % EDGE, at[2] % EDGE));
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
    }
}
