//! Time per stage by timestamps, where the device has them: a pass per dispatch instead of one for the whole step.

use crate::plan::{Pass, Stage};
use std::time::Duration;

/// Most passes that are timed in one step; those beyond it run untimed.
const MAX_PASSES: u32 = 2048;

/// Times one step at a time.
#[derive(Debug)]
pub struct StageTimer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Holds the copy of the timestamps, to be mapped by a caller that waits.
    pub staging: wgpu::Buffer,
    stages: Vec<Stage>,
    nanoseconds_per_tick: f64,
    /// Sum over the steps timed so far.
    pub total: [Duration; Stage::ALL.len()],
    /// Steps timed so far.
    pub steps: u64,
}

impl StageTimer {
    /// `None` if the device has no timestamps.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let count = 2 * MAX_PASSES;
        let buffer = |label, usage| {
            let size = u64::from(count) * 8;
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        use wgpu::BufferUsages as U;
        Some(StageTimer {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pbmpm stage times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: buffer("pbmpm stage times", U::QUERY_RESOLVE | U::COPY_SRC),
            staging: buffer("pbmpm stage times readback", U::COPY_DST | U::MAP_READ),
            stages: Vec::new(),
            nanoseconds_per_tick: f64::from(queue.get_timestamp_period()),
            total: [Duration::ZERO; Stage::ALL.len()],
            steps: 0,
        })
    }

    /// Calls `record` for each pass with the timestamps to write, if any, then records their copy to `staging`.
    pub fn time(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: impl Iterator<Item = Pass>,
        record: impl Fn(&mut wgpu::CommandEncoder, Option<wgpu::ComputePassTimestampWrites<'_>>, Pass),
    ) {
        self.stages.clear();
        for what in passes {
            let timed = self.stages.len() as u32;
            let writes = (timed < MAX_PASSES).then_some(wgpu::ComputePassTimestampWrites {
                query_set: &self.queries,
                beginning_of_pass_write_index: Some(2 * timed),
                end_of_pass_write_index: Some(2 * timed + 1),
            });
            if writes.is_some() {
                self.stages.push(what.stage);
            }
            record(encoder, writes, what);
        }
        let count = 2 * self.stages.len() as u32;
        encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, u64::from(count) * 8);
    }

    /// Adds the ticks of the last timed step.
    pub fn add(&mut self, ticks: &[u64]) {
        for (pair, stage) in ticks.chunks_exact(2).zip(&self.stages) {
            let nanoseconds = pair[1].saturating_sub(pair[0]) as f64 * self.nanoseconds_per_tick;
            self.total[stage.index()] += Duration::from_nanos(nanoseconds as u64);
        }
        self.steps += 1;
    }
}
