//! How passes are cut into workgroups.

use super::layout::GROUP;
use crate::error::{Check, Result};
use crate::features::Features;
use crate::math::fixed::CHUNK;
use crate::math::{sdf, svd};
use crate::stages::collider_cull;
use crate::stages::contact::SWEEPS;
use crate::stages::swept::{MENDS, PIECES};

/// How the passes of the GPU path are cut into workgroups. It affects how long they take, not their results, which are
/// the same bits.
///
/// Default: [`Tuning::of`] the device's adapter. `docs/performance.md` has the measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Tuning {
    /// Whether a workgroup keeps the grid nodes around a block of particles in workgroup memory, and an invocation
    /// processes one of these particles at a time. Without tiles it processes all particles of a cell and keeps their
    /// sums in private memory. Tiles pay where workgroup memory is faster than buffers and has cheaper atomic
    /// additions, as on GPUs; on a processor both are the same memory, and the copies are wasted.
    pub tiles: bool,
    /// Invocations that process a block, or up to 256 of its particles, together: 8, 16, 32 or 64. A device that also
    /// executes idle invocations needs as many as it runs at a time.
    pub lanes: u32,
    /// With tiles, invocations that together scatter the particles of a block to its tile, one particle each at a time:
    /// 64, 128 or 256.
    pub tile_lanes: u32,
    /// How many blocks or chunks a workgroup processes in turn; in per-particle stages, how many particles an
    /// invocation does: 1 to 16. More than one is for devices on which starting a workgroup is expensive. In worlds
    /// with many bodies the solver uses fewer than asked for, and wider workgroups in stages that look at bodies, as
    /// far as needed to keep every invocation at 60,000 loop iterations or fewer: llvmpipe silently leaves loops after
    /// 65,535.
    pub share: u32,
    /// Whether an iteration takes one pass over the particles (`g2p2g`), which gathers their motion, corrects it and
    /// scatters it, instead of three that store it in between. Only in the published scheme, in worlds with liquids
    /// alone and without sleep; elsewhere it changes nothing.
    pub fused: bool,
}

/// The least that [`Tuning::lanes`] may be.
pub(crate) const FEWEST_LANES: u32 = 8;
/// The most that [`Tuning::tile_lanes`] may be: what every device has.
pub(crate) const MOST_TILE_LANES: u32 = 256;
/// The most invocations of a workgroup that works alone.
pub(crate) const MOST_SOLO_LANES: u32 = 1024;

/// Loop iterations that an invocation may take, over all of its loops (see [`Tuning::share`]).
const MOST_TURNS: usize = 60_000;

impl Tuning {
    /// For graphics processors.
    pub const GPU: Tuning = Tuning { tiles: true, lanes: GROUP, tile_lanes: 128, share: 1, fused: true };

    /// Where a processor does the work (lavapipe, SwiftShader, WARP): no tiles, the narrowest workgroups, each with
    /// several shares.
    pub const CPU: Tuning = Tuning { tiles: false, lanes: FEWEST_LANES, tile_lanes: GROUP, share: 4, fused: true };

    /// For an adapter, by its type.
    pub fn of(adapter: &wgpu::AdapterInfo) -> Tuning {
        match adapter.device_type {
            wgpu::DeviceType::Cpu => Tuning::CPU,
            _ => Tuning::GPU,
        }
    }

    /// Invocations of a workgroup that works alone, on a device with these limits. Metal has lower limits for some
    /// pipelines, which show only when these are made.
    pub(crate) fn solo_lanes(&self, limits: &wgpu::Limits, backend: wgpu::Backend) -> u32 {
        let allowed = limits.max_compute_invocations_per_workgroup.min(limits.max_compute_workgroup_size_x);
        match backend {
            _ if !self.tiles => GROUP,
            wgpu::Backend::Metal => MOST_TILE_LANES,
            _ => allowed.clamp(MOST_TILE_LANES, MOST_SOLO_LANES),
        }
    }

    /// Invocations that look for the blocks of a tile, in turn or each for one: a GPU waits for each look-up.
    pub(crate) fn linkers(&self) -> u32 {
        if self.tiles { 8 } else { 1 }
    }

    pub(crate) fn check(&self, check: &Check) -> Result<()> {
        let Tuning { lanes, tile_lanes, share, .. } = *self;
        check.that(matches!(lanes, FEWEST_LANES | 16 | 32 | 64), "tuning.lanes", lanes, "8, 16, 32 or 64")?;
        check.that(matches!(tile_lanes, 64 | 128 | 256), "tuning.tile_lanes", tile_lanes, "64, 128 or 256")?;
        check.that((1..=16).contains(&share), "tuning.share", share, "1 to 16")
    }

    /// This tuning, or the nearest to it in which no invocation takes too many loop iterations beside bodies of these
    /// kinds.
    pub(crate) fn beside(self, kinds: impl ExactSizeIterator<Item = u32>, features: Features) -> Tuning {
        // Each particle is one iteration; bodies are noted in words.
        let words = collider_cull::words(kinds.len());
        // `gap` goes by cells, and all particles may be in one.
        let noting = if features.gaps() { CHUNK as usize * (1 + words + kinds.len()) } else { 1 };
        // That takes two looks at each body, and one at each of 27 nodes by rows.
        let making_up = if features.corrects { 2 * (words + kinds.len()) + 36 } else { 0 };
        let turns = 1 + svd::SWEEPS + (SWEEPS + 3) * words + making_up + kinds.map(turns_beside).sum::<usize>();
        let most = |lanes: u32| MOST_TURNS / (turns * (CHUNK / lanes) as usize);
        let mut lanes = self.lanes;
        while lanes < GROUP && most(lanes) == 0 {
            lanes *= 2;
        }
        let share = most(lanes).min(MOST_TURNS / noting).max(1);
        Tuning { lanes, share: self.share.min(share as u32), ..self }
    }
}

/// The most loop iterations that one particle takes beside a body of this kind. A loop in a branch that is not taken,
/// such as that over a container's walls beside other bodies, counts as one.
fn turns_beside(kind: u32) -> usize {
    let inner = match kind {
        k if sdf::is_grid(k) => PIECES + MENDS,
        k if sdf::is_inverted(k) => sdf::walls(k) + 1,
        _ => 1,
    };
    // The other three: for pushing out what ends inside, for the room, and to spare.
    SWEEPS * (1 + inner) + 3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beside(tuning: Tuning, kind: u32, bodies: usize) -> Tuning {
        tuning.beside(std::iter::repeat_n(kind, bodies), Features::default())
    }

    #[test]
    fn as_asked_for_where_few_bodies_are() {
        assert_eq!(beside(Tuning::CPU, sdf::SPHERE, 0), Tuning::CPU);
        assert_eq!(beside(Tuning::CPU, sdf::SPHERE, 60), Tuning::CPU);
        assert_eq!(beside(Tuning::GPU, sdf::SPHERE, 4096), Tuning::GPU);
    }

    #[test]
    fn less_at_a_time_where_many_bodies_are() {
        let of = |kind, bodies| {
            let Tuning { lanes, share, .. } = beside(Tuning::CPU, kind, bodies);
            (lanes, share)
        };
        assert_eq!([of(sdf::SPHERE, 100), of(sdf::SPHERE, 200), of(sdf::SPHERE, 400)], [(8, 2), (8, 1), (16, 1)]);
        assert_eq!([of(sdf::GRID, 2), of(sdf::GRID, 10), of(sdf::GRID, 100)], [(8, 4), (8, 1), (64, 1)]);
        assert_eq!(of(sdf::BOX | sdf::INVERTED, 4096).0, GROUP);
        let spheres = |bodies| std::iter::repeat_n(sdf::SPHERE, bodies);
        let corrects = Features { corrects: true, ..Features::default() };
        let noting = |bodies| Tuning::CPU.beside(spheres(bodies), Features { elastic: true, ..corrects }).share;
        assert_eq!([noting(10), noting(60), noting(300)], [4, 3, 1]);
        let correcting = |bodies| Tuning::CPU.beside(spheres(bodies), corrects);
        assert!(correcting(220).lanes > 8 && beside(Tuning::CPU, sdf::SPHERE, 220).lanes == 8);
    }
}
