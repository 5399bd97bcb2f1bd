//! How passes are cut into workgroups.

use super::layout::{GROUP, MAX_GROUPS};
use crate::error::{Check, Result};

/// How the passes of the GPU path are cut into workgroups. It decides how long they take, not what comes out: results are the same bits.
///
/// Default: [`Tuning::of`] the device's adapter. `docs/performance.md` has the measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Tuning {
    /// Whether a workgroup keeps the grid's nodes around a block of particles in its own memory. Pays where that is faster than buffers
    /// and atomic additions there are cheaper, as on GPUs; on a processor both are the same memory, and copies are lost work.
    pub tiles: bool,
    /// Invocations that take a block, or up to 256 of its particles, together: 8, 16, 32 or 64. A device that goes through the
    /// idle ones too wants as many as it works on at a time.
    pub lanes: u32,
    /// Workgroups of a pass at most, which go on with what is left: 1 to 65,535. Few are for devices on which a workgroup costs much to
    /// start.
    pub groups: u32,
}

impl Tuning {
    /// For graphics processors.
    pub const GPU: Tuning = Tuning { tiles: true, lanes: GROUP, groups: MAX_GROUPS };

    /// For an adapter: [`Tuning::GPU`], or where a processor does the work (lavapipe, SwiftShader, WARP) no tiles, the narrowest workgroups and a
    /// few of them for each core.
    pub fn of(adapter: &wgpu::AdapterInfo) -> Tuning {
        if adapter.device_type != wgpu::DeviceType::Cpu {
            return Tuning::GPU;
        }
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Tuning { tiles: false, lanes: 8, groups: (8 * cores).min(MAX_GROUPS as usize) as u32 }
    }

    pub(crate) fn check(&self, check: &Check) -> Result<()> {
        let Tuning { lanes, groups, .. } = *self;
        check.that(matches!(lanes, 8 | 16 | 32 | 64), "tuning.lanes", lanes, "8, 16, 32 or 64")?;
        check.that((1..=MAX_GROUPS).contains(&groups), "tuning.groups", groups, "1 to 65535")
    }
}
