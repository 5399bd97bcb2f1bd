//! Counters on their way back to the host, without anyone waiting.

use super::layout::Counters;
use super::pipelines::COUNTERS_BYTES;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

const PENDING: u8 = 0;
const READY: u8 = 1;
const FAILED: u8 = 2;

#[derive(Debug)]
struct Ticket {
    buffer: wgpu::Buffer,
    /// Steps recorded before the copy, and what became of the mapping; `None` while the buffer is free.
    taken: Option<(u64, Arc<AtomicU8>)>,
}

/// A few staging buffers that take turns.
#[derive(Debug)]
pub struct CounterReadback {
    tickets: Vec<Ticket>,
}

/// What a copy of the counters says.
#[derive(Debug, Clone, Copy)]
pub struct Arrived {
    /// Steps recorded before the copy: these are finished.
    pub recorded: u64,
    pub counters: Counters,
}

impl CounterReadback {
    pub fn new(device: &wgpu::Device, count: u32) -> Self {
        let buffer = |i| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(&format!("pbmpm counters readback {i}")),
                size: COUNTERS_BYTES,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        CounterReadback { tickets: (0..count).map(|i| Ticket { buffer: buffer(i), taken: None }).collect() }
    }

    pub fn bytes(&self) -> u64 {
        self.tickets.len() as u64 * COUNTERS_BYTES
    }

    /// Records a copy of the counters; false if every staging buffer is still on its way.
    pub fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, counters: &wgpu::Buffer, recorded: u64) -> bool {
        let Some(ticket) = self.tickets.iter_mut().find(|t| t.taken.is_none()) else {
            return false;
        };
        encoder.copy_buffer_to_buffer(counters, 0, &ticket.buffer, 0, COUNTERS_BYTES);
        let state = Arc::new(AtomicU8::new(PENDING));
        let seen = state.clone();
        encoder.map_buffer_on_submit(&ticket.buffer, wgpu::MapMode::Read, .., move |result| {
            seen.store(if result.is_ok() { READY } else { FAILED }, Ordering::Release);
        });
        ticket.taken = Some((recorded, state));
        true
    }

    /// The newest copy that has arrived since the last call; an error if the device failed to bring one.
    pub fn poll(&mut self) -> Result<Option<Arrived>, String> {
        let mut newest: Option<Arrived> = None;
        for ticket in &mut self.tickets {
            let Some((recorded, state)) = &ticket.taken else { continue };
            let recorded = *recorded;
            match state.load(Ordering::Acquire) {
                PENDING => continue,
                READY => {
                    let view = ticket.buffer.get_mapped_range(..).map_err(|e| e.to_string())?;
                    let counters: Counters = bytemuck::pod_read_unaligned(&view);
                    drop(view);
                    ticket.buffer.unmap();
                    if newest.is_none_or(|n| n.recorded <= recorded) {
                        newest = Some(Arrived { recorded, counters });
                    }
                }
                _ => return Err("the counters could not be mapped; the device may be lost".to_owned()),
            }
            ticket.taken = None;
        }
        Ok(newest)
    }
}
