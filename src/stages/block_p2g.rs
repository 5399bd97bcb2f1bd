//! Sums for each block the push at the nodes of its tile of one unit of pressure of all its liquids, and their volume,
//! volume ratio and pressure. Planned only where the liquids of a block share a pressure.

use super::Kernel;
use super::bin_sleep::AWAKE;
use super::compliance::stiffness_beside;
use super::p2g::{Tile, scatter_affine};
use super::solid::LIQUID;
use super::walls::{Walls, factors_beside};
use crate::bins::{TILE_NODES, origin};
use crate::cpu::blocks::BlockPressure;
use crate::cpu::constants::{Constants, MaterialConstants};
use crate::cpu::gradient::{Gradient, beside_of, mass_of, material_of, pressure_of};
use crate::cpu::par;
use crate::cpu::solve::{Search, Shear, inverse};
use crate::cpu::state::{Block, CpuState};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::{Lanes, Real};
use crate::math::wide::{Wide, Work, widely};
use crate::stages::press::{MAX_ERROR, MAX_LOAD};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        read(Slot::Gradient),
        read(Slot::Search),
        read(Slot::Order),
        read(Slot::Chunks),
        write(Slot::BlockTiles),
        write(Slot::BlockSums),
        read(Slot::Solve),
    ],
    over: Over::SolveChunks,
    source: include_str!("../../shaders/stages/block_p2g.wgsl"),
};

/// Mean compression of a block's liquids below which the block has no pressure. The threshold keeps matter in free
/// flight independent of where block borders lie.
pub(crate) const SLACK: f64 = 3e-4;

/// Largest pressure of a block, with that of its particles, as a share of the particles' stiffness: under a larger one
/// particles would not stay in their places. Liquids whose weight comes near it have no pressures of blocks
/// ([`Settings::block_pressure`](crate::Settings::block_pressure)).
pub(crate) const MOST_SHARED: f64 = 0.12;

/// Parts of a unit in sums over a block.
pub(crate) const BLOCK_SCALE: f64 = (1u64 << 24) as f64;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    s.block_tiles.resize_with(s.occupied, || [[R::Sum::default(); 4]; TILE_NODES]);
    s.block_pressures.resize(s.occupied, BlockPressure::default());
    let work = Scatter {
        position: &s.position,
        gradient: &s.gradient,
        search: &s.search,
        shear: &s.shear,
        materials: &s.materials,
        constants: &s.constants,
        walls: Walls::of(s),
        largest: s.solve.pressure,
        scale: s.solve.force_scale_of(&s.constants, R::of(1.0)),
    };
    let blocks = &s.blocks;
    par::each_block((&mut s.block_tiles[..], &mut s.block_pressures[..]), |b, (tile, pressure)| {
        *pressure = BlockPressure::default();
        if blocks[b].sleep == AWAKE {
            *tile = [[R::Sum::default(); 4]; TILE_NODES];
            widely(&work, (&blocks[b], tile, pressure));
        }
    });
}

/// Sums the liquids of a block.
struct Scatter<'a, R: Real> {
    position: &'a [[R; 4]],
    gradient: &'a [Gradient<R>],
    search: &'a [Search<R>],
    /// Empty where only pressures are unknown.
    shear: &'a [Shear<R>],
    materials: &'a [MaterialConstants<R>],
    constants: &'a Constants<R>,
    walls: Walls<R>,
    /// Largest pressure that any particle carries over from the step before.
    largest: R,
    /// Fixed-point units per unit of push.
    scale: R,
}

impl<R: Real> Work<(&Block, &mut Tile<R>, &mut BlockPressure<R>)> for Scatter<'_, R> {
    #[inline(always)]
    fn on(&self, wide: Option<Wide>, (block, tile, pressure): (&Block, &mut Tile<R>, &mut BlockPressure<R>)) {
        let Scatter { constants, largest, scale, .. } = *self;
        let origin = origin(block.key);
        let walls = self.walls.beside(origin);
        let walls = walls.as_ref();
        let zero = R::of(0.0);
        let unit = inverse(largest, LEAST_PRESSURE);
        let mut sums = [R::Whole::default(); 3];
        let (mut softest, mut firmest) = (zero, zero);
        for p in block.start as usize..(block.start + block.count) as usize {
            let (gradient, compliance) = (&self.gradient[p], self.search[p].compliance);
            let material = &self.materials[material_of(gradient)];
            if material.model != LIQUID || compliance <= zero {
                continue;
            }
            let (mass, lightness) = (mass_of(gradient), material.lightness);
            let volume = mass * lightness;
            let raised = (pressure_of(gradient) + largest * lightness).max(zero);
            let parts = [volume, volume * self.position[p][3], mass * (raised * unit)];
            sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += R::whole(part * R::of(BLOCK_SCALE)));
            softest = softest.max(compliance * lightness);
            firmest = firmest.max(stiffness_beside(material, constants) * (R::of(1.0) / lightness));
            let push = volume * scale;
            let walls = walls.filter(|_| self.shear.get(p).is_none_or(|shear| shear.compliance <= zero));
            let [x, y, z] = factors_beside(walls, self.position[p], beside_of(gradient)).map(|factor| push * factor);
            let columns = [[x, zero, zero, zero], [zero, y, zero, zero], [zero, zero, z, zero]];
            scatter_affine::<R>(wide, tile, origin, self.position[p], R::V::all(zero), columns.map(R::V::from4));
        }
        let [volume, ratio, raised] = sums.map(|sum| R::of_whole(sum) * R::of(1.0 / BLOCK_SCALE));
        *pressure = begun([volume, ratio, raised * (R::of(1.0) / unit)], largest, softest, firmest);
    }
}

/// Lower bound of the largest pressure, for scales.
pub(crate) const LEAST_PRESSURE: f64 = 1e-8;

/// The initial state of the solve for a block, without the effect of motion. Its inputs are the sums of volume, of
/// volume times volume ratio and of volume times (pressure + `largest`), the largest compliance of its particles, and
/// the largest stiffness of the block beside that of the particles.
#[inline(always)]
fn begun<R: Real>([volume, ratio, raised]: [R; 3], largest: R, softest: R, firmest: R) -> BlockPressure<R> {
    let (zero, one) = (R::of(0.0), R::of(1.0));
    if volume <= zero || firmest <= zero {
        return BlockPressure::default();
    }
    let compliance = one / firmest;
    let slack = R::of(SLACK);
    // Written with one constant, and a quotient for a product with an inverse, as devices fold them.
    let mean = ratio * (one / volume);
    let excess = R::of(1.0 - SLACK) - mean;
    let excess = excess.max(zero).min(R::of(MAX_ERROR) + R::of(MAX_LOAD) * compliance);
    let pressure = raised * (one / volume) - largest;
    let share = softest * firmest;
    let load = (pressure - slack / softest).max(zero) * (share * (one / (share + one)));
    let most = (mean - R::of(1.0 - MOST_SHARED)).max(zero) * (one / softest);
    let load = load.min(most);
    if excess <= zero && load <= zero {
        return BlockPressure::default();
    }
    let residual = volume * (excess - compliance * load);
    BlockPressure { volume, load, most, residual, compliance: volume * compliance, ..BlockPressure::default() }
}
