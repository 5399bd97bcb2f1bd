//! Records how far from bodies the solids at each node are: they touch a body when their surface does, not when it
//! comes near a node that their particles share with it; and before which faces of boxes they lie. Planned only where
//! there are bodies and solids other than sand, or sand and liquids that stick. Twin: `shaders/stages/gap.wgsl`.

use super::Kernel;
use super::collider_cull::touching;
use super::contact::{Near, distance_normal_before};
use super::solid::{LIQUID, SAND, VISCOPLASTIC};
use crate::bins::{NODES, TILE_NODES, origin, row_length, tile_first, tile_index, tile_rows};
use crate::cpu::constants::{ColliderConstants, Constants, MaterialConstants};
use crate::cpu::gradient::{Gradient, mass_of};
use crate::cpu::lanes::materials_of;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel::base;
use crate::math::linear::dot;
use crate::math::real::{Lanes, Real};
use crate::math::sdf;
use std::sync::atomic::{AtomicU32, Ordering};

/// Distance from a body within which particles record a gap, in cells. Matter comes no nearer than that to a body in a
/// step.
pub(crate) const WIDEST: f64 = 1.5;

/// Units per cell in which gaps are stored.
pub(crate) const PARTS: f64 = 65536.0;

/// What liquids record.
pub(crate) const LIQUID_NEAR: u32 = 0;
/// What sand records.
pub(crate) const SAND_NEAR: u32 = 1;
/// What a viscoplastic solid without a gap records, and what an elastic one does. Either records twice the units of its
/// gap more than that, so that of all the matter at a node the nearest counts, and the last bit tells of which kind it
/// is.
pub(crate) const VISCOPLASTIC_NEAR: u32 = 2;
/// See [`VISCOPLASTIC_NEAR`].
pub(crate) const ELASTIC_NEAR: u32 = 3;

/// Recorded where there is no matter near a body.
pub(crate) const NONE_NEAR: u32 = ELASTIC_NEAR + 2 * (WIDEST * PARTS) as u32;

/// What the matter that recorded this would record without a gap.
pub(crate) fn near(noted: u32) -> u32 {
    if noted < VISCOPLASTIC_NEAR { noted } else { VISCOPLASTIC_NEAR + noted % 2 }
}

/// The recorded gap, in parts of a cell.
pub(crate) fn parts(noted: u32) -> u32 {
    noted.saturating_sub(VISCOPLASTIC_NEAR) / 2
}

/// For nodes that are not opposite a particle, its gap is increased by `BESIDE (t² − OPPOSITE)`, with t the distance to
/// the node along the surface, in cells: otherwise the tip of a ball would hold all nodes within 1.5 cells around it.
pub(crate) const BESIDE: f64 = 0.25;
/// See [`BESIDE`]. A particle in the middle of a cell is opposite the cell's corners.
pub(crate) const OPPOSITE: f64 = 0.5;

/// Gap up to which a solid touches a box, in cells, and cosine of the angle between the box's normal there and an axis
/// of the world from which it lies squarely before a face.
pub(crate) const TOUCHING: f64 = 0.25;
/// See [`TOUCHING`].
pub(crate) const FACE_ON: f64 = 0.999;

/// Bits per node that tell along which axes of the world solids that touch boxes lie squarely before their faces.
pub(crate) const FACE_BITS: u32 = 4;
/// How many nodes share a word for these.
pub(crate) const NODES_PER_WORD: usize = (u32::BITS / FACE_BITS) as usize;

/// What is recorded at the nodes of a block.
#[derive(Debug)]
pub(crate) struct Noted {
    /// The distance of the solids from bodies, with their kind.
    pub gaps: [AtomicU32; NODES],
    /// See [`FACE_BITS`].
    pub faces: [AtomicU32; NODES / NODES_PER_WORD],
}

impl Noted {
    fn none() -> Noted {
        Noted {
            gaps: std::array::from_fn(|_| AtomicU32::new(NONE_NEAR)),
            faces: std::array::from_fn(|_| AtomicU32::new(0)),
        }
    }

    /// The axis along which the solids at a node lie before a box; 3 if there is none, or more than one.
    pub fn axis(&self, node: usize) -> u32 {
        if self.gaps[node].load(Ordering::Relaxed) < VISCOPLASTIC_NEAR {
            return 3;
        }
        let word = self.faces[node / NODES_PER_WORD].load(Ordering::Relaxed);
        match word >> (node % NODES_PER_WORD * FACE_BITS as usize) & 7 {
            faces if faces.count_ones() == 1 => faces.trailing_zeros(),
            _ => 3,
        }
    }
}

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        read(Slot::Gradient),
        read(Slot::Colliders),
        read(Slot::Order),
        read(Slot::Chunks),
        write(Slot::Cull),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/gap.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.gaps.resize_with(s.blocks.len(), Noted::none);
    par::each_block(&mut s.gaps[..], |_, noted| *noted = Noted::none());
    let (constants, colliders, cull, words) = (&s.constants, &s.colliders, &s.cull, s.cull_words);
    let (gradient, materials, links, noted) = (&s.gradient, &s.materials, &s.links, &s.gaps);
    par::block_particles(&s.blocks[..s.occupied], &mut s.position[..], &|b, block, position| {
        let masks = &cull[b * words..(b + 1) * words];
        if masks.iter().all(|mask| *mask == 0) {
            return;
        }
        let near = touching::<R>(colliders, masks, block.key, R::of(WIDEST));
        let gradient = &gradient[block.start as usize..(block.start + block.count) as usize];
        let origin = origin(block.key);
        let mut tile = Tile { gaps: [NONE_NEAR; TILE_NODES], faces: [0; TILE_NODES], touching: false };
        for (position, gradient) in position.chunks(LANES).zip(gradient.chunks(LANES)) {
            let gaps = gaps_of(position, gradient, colliders, &near, materials);
            position.iter().zip(gaps).for_each(|(x, gap)| note(&mut tile, origin, *x, gap, constants));
        }
        for (k, &link) in links[b].iter().enumerate() {
            for (t, n) in tile_rows(k) {
                let length = row_length(k);
                let Noted { gaps, faces } = &noted[link as usize];
                for (noted, &gap) in gaps[n..n + length].iter().zip(&tile.gaps[t..t + length]) {
                    if gap < NONE_NEAR {
                        noted.fetch_min(gap, Ordering::Relaxed);
                    }
                }
                if tile.touching {
                    for (n, &axes) in (n..n + length).zip(&tile.faces[t..t + length]) {
                        let bits = axes << (n % NODES_PER_WORD * FACE_BITS as usize);
                        faces[n / NODES_PER_WORD].fetch_or(bits, Ordering::Relaxed);
                    }
                }
            }
        }
    });
}

/// What a block's particles record at the nodes of its tile.
struct Tile {
    gaps: [u32; TILE_NODES],
    faces: [u32; TILE_NODES],
    /// Whether any of `faces` is set.
    touching: bool,
}

const LANES: usize = 4;

/// Farther than any body in reach.
pub(super) const FAR: f64 = 3e38;

/// The gap between a particle's matter and the nearest body.
#[derive(Debug, Clone, Copy)]
enum Gap<R> {
    /// Wider than is recorded.
    Wide,
    /// This wide, along the body's normal there, before a solid that without a gap would record `least`, squarely before
    /// these faces.
    Left { gap: R, normal: [R; 3], least: u32, faces: u32 },
    /// None: nodes hold sand, whose single grains would slip between them.
    Closed,
    /// None: nodes hold liquids.
    OfLiquid,
}

/// The gaps of up to four particles.
#[inline(always)]
fn gaps_of<R: Real>(
    position: &[[R; 4]],
    gradient: &[Gradient<R>],
    colliders: &[ColliderConstants<R::V>],
    near: &[Near<R>],
    materials: &[MaterialConstants<R>],
) -> [Gap<R>; LANES] {
    let lanes = [0, 1, 2, 3].map(|n: usize| n.min(position.len() - 1));
    let of_lane = materials_of(gradient, materials);
    let known = of_lane.map(|material| match material.model {
        LIQUID => Some(Gap::OfLiquid),
        SAND => Some(Gap::Closed),
        _ => None,
    });
    // For liquids and sand no distances are needed.
    if let [Some(a), Some(b), Some(c), Some(d)] = known {
        return [a, b, c, d];
    }
    let [x, y, z, _] = R::V::transposed(lanes.map(|n| R::V::from4(position[n])));
    let zero = R::V::all(R::of(0.0));
    let reach = R::V::all(R::of(WIDEST));
    let volume = [0, 1, 2, 3].map(|n| mass_of(&gradient[lanes[n]]) * of_lane[n].inverse_density);
    let half = half_edge::<R>(R::V::from4(volume));
    let [touching, face_on] = [half + R::V::all(R::of(TOUCHING)), R::V::all(R::of(FACE_ON))];
    let (mut distance, mut normal) = (R::V::all(R::of(FAR)), [zero; 3]);
    let mut faces = [0; LANES];
    for near in near.iter().filter(|near| near.within([x, y, z], reach)) {
        let collider = &colliders[near.collider];
        let (to, away) = distance_normal_before::<R>(collider, [x, y, z]);
        let nearer = to.below(distance);
        distance = nearer.pick(to, distance);
        normal = [0, 1, 2].map(|a| nearer.pick(away[a], normal[a]));
        if collider.kind == sdf::BOX {
            let before = away.map(|c| to.below(touching).and(face_on.at_most(c.abs())).lanes());
            faces = [0, 1, 2, 3].map(|n| faces[n] | (0..3).map(|a| u32::from(before[a][n]) << a).sum::<u32>());
        }
    }
    let within = distance.below(reach).lanes();
    let gap = distance - half;
    let gap = zero.below(gap).pick(gap, zero).to4();
    let normal = normal.map(Lanes::to4);
    [0, 1, 2, 3].map(|n| {
        let least = if of_lane[n].model == VISCOPLASTIC { VISCOPLASTIC_NEAR } else { ELASTIC_NEAR };
        let left = Gap::Left { gap: gap[n], normal: normal.map(|lanes| lanes[n]), least, faces: faces[n] };
        known[n].unwrap_or(if within[n] { left } else { Gap::Wide })
    })
}

/// Half the edge of cubes of these volumes: how far the matter of a particle extends.
#[inline(always)]
fn half_edge<R: Real>(volume: R::V) -> R::V {
    R::V::all(R::of(0.5)) * (volume.ln() * R::V::all(R::of(1.0 / 3.0))).exp()
}

/// Records on the 27 nodes of a particle at `x` how much nearer to the body each may come. Nodes behind the domain's
/// sides count as if they were on them, so that matter in corners has nodes opposite it.
#[inline(always)]
fn note<R: Real>(tile: &mut Tile, origin: [u32; 3], x: [R; 4], gap: Gap<R>, constants: &Constants<R>) {
    let [zero, widest] = [0.0, WIDEST].map(R::of);
    let corner = [0, 1, 2].map(|a| base(x[a]));
    let first = tile_first(corner, origin);
    let reached = first..=first + tile_index(2, 2, 2);
    let nodes = &mut tile.gaps[reached.clone()];
    let (gap, normal, least, faces) = match gap {
        Gap::Wide => return,
        Gap::Left { gap, normal, least, faces } => (gap, normal, least, faces),
        Gap::Closed => return note_alike(nodes, |noted| SAND_NEAR.min(noted)),
        Gap::OfLiquid => return note_alike(nodes, |_| LIQUID_NEAR),
    };
    if faces > 0 {
        tile.touching = true;
        note_alike(&mut tile.faces[reached], |noted| noted | faces);
    }
    let ways = [0, 1, 2].map(|a| {
        let within = |n| R::of(f64::from(corner[a] + n)).max(constants.lo[a]).min(constants.hi[a]);
        [0, 1, 2].map(|n| within(n) - x[a])
    });
    for (k, z) in ways[2].into_iter().enumerate() {
        for (j, y) in ways[1].into_iter().enumerate() {
            for (i, x) in ways[0].into_iter().enumerate() {
                let way = [x, y, z];
                let along = dot(way, normal);
                let beside = dot(way, way) - along * along - R::of(OPPOSITE);
                let gap = gap + if zero < beside { beside * R::of(BESIDE) } else { zero };
                let noted = &mut nodes[tile_index(i, j, k)];
                *noted = (2 * (gap.min(widest) * R::of(PARTS)).floor_index() + least).min(*noted);
            }
        }
    }
}

/// Records the same on all 27 nodes.
#[inline(always)]
fn note_alike(nodes: &mut [u32], note: impl Fn(u32) -> u32) {
    for (j, k) in (0..9).map(|row| (row % 3, row / 3)) {
        let row = &mut nodes[tile_index(0, j, k)..=tile_index(2, j, k)];
        row.iter_mut().for_each(|noted| *noted = note(*noted));
    }
}
