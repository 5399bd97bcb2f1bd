//! How passes are cut into workgroups.

use super::layout::GROUP;
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
    /// Blocks, or such parts of their particles, that a workgroup takes one after the other: 1 to 1,024. More than one is for devices on which
    /// a workgroup costs much to start.
    pub share: u32,
}

impl Tuning {
    /// For graphics processors.
    pub const GPU: Tuning = Tuning { tiles: true, lanes: GROUP, share: 1 };

    /// Where a processor does the work (lavapipe, SwiftShader, WARP): no tiles, the narrowest workgroups, each with several shares.
    pub const CPU: Tuning = Tuning { tiles: false, lanes: 8, share: 4 };

    /// For an adapter, by its type.
    pub fn of(adapter: &wgpu::AdapterInfo) -> Tuning {
        match adapter.device_type {
            wgpu::DeviceType::Cpu => Tuning::CPU,
            _ => Tuning::GPU,
        }
    }

    pub(crate) fn check(&self, check: &Check) -> Result<()> {
        let Tuning { lanes, share, .. } = *self;
        check.that(matches!(lanes, 8 | 16 | 32 | 64), "tuning.lanes", lanes, "8, 16, 32 or 64")?;
        check.that((1..=1024).contains(&share), "tuning.share", share, "1 to 1024")
    }
}
