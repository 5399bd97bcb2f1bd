//! Copies on their way back to the host, without waiting.

use super::buffers::Buffers;
use super::layout::{Counters, Sizes};
use super::slots::Slot;
use crate::load::SUMS;
use crate::sensor;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// What has become of a mapping that was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Outcome {
    /// Not submitted yet, or not finished.
    Pending,
    /// The buffer is mapped.
    Here,
    Failed,
    /// Its encoder was dropped, so that it will never be made.
    Dropped,
}

/// A mapping that was recorded.
#[derive(Debug)]
pub struct Mapping(Arc<AtomicU8>);

impl Mapping {
    /// Records that `buffer` is to be mapped for reading once the commands recorded before are done.
    pub fn encode(encoder: &mut wgpu::CommandEncoder, buffer: &wgpu::Buffer) -> Self {
        /// Is dropped with the encoder.
        struct Told(Arc<AtomicU8>);
        impl Told {
            fn tell(&self, outcome: Outcome) {
                let pending = Outcome::Pending as u8;
                // Only the first outcome counts.
                let _ = self.0.compare_exchange(pending, outcome as u8, Ordering::Release, Ordering::Relaxed);
            }
        }
        impl Drop for Told {
            fn drop(&mut self) {
                self.tell(Outcome::Dropped);
            }
        }
        let state = Arc::new(AtomicU8::new(Outcome::Pending as u8));
        let told = Told(state.clone());
        encoder.map_buffer_on_submit(buffer, wgpu::MapMode::Read, .., move |result| {
            told.tell(if result.is_ok() { Outcome::Here } else { Outcome::Failed });
        });
        Mapping(state)
    }

    pub fn outcome(&self) -> Outcome {
        let state = self.0.load(Ordering::Acquire);
        [Outcome::Pending, Outcome::Here, Outcome::Failed, Outcome::Dropped][usize::from(state)]
    }
}

#[derive(Debug)]
struct Ticket {
    buffer: wgpu::Buffer,
    /// Steps recorded before the copy, and its mapping; `None` while the buffer is free.
    taken: Option<(u64, Mapping)>,
    /// The one of [`STAMPS`] that the next copy puts at the buffer's end.
    stamp: usize,
}

/// Tell a copy from the one before in the same buffer. If a host's mistake has made the encoder invalid, nothing is
/// copied, but the buffer is mapped all the same.
const STAMPS: [u32; 2] = [1, 2];
const STAMP_BYTES: u64 = size_of::<u32>() as u64;

/// A few staging buffers that take turns.
#[derive(Debug)]
pub struct CounterReadback {
    tickets: Vec<Ticket>,
    /// [`STAMPS`] on the device.
    stamps: wgpu::Buffer,
    /// Steps recorded before the newest copy that has arrived.
    newest: u64,
    /// Copies of each load behind the counters.
    copies: usize,
    /// The loads of the newest copy, their copies added up.
    loads: Vec<[u64; SUMS]>,
    /// Bytes of the sensors' sums for two steps.
    sensed_bytes: u64,
    /// The sensors' sums of the newest copy.
    sensed: Vec<[i64; sensor::SUMS]>,
}

/// What a copy of the counters says.
#[derive(Debug, Clone, Copy)]
pub struct Arrived {
    /// Steps recorded before the copy: these are finished.
    pub recorded: u64,
    pub counters: Counters,
}

/// Copies that may be on their way at a time: of as many frames, where each asks for one.
const COPIES: u32 = 8;

impl CounterReadback {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, sizes: &Sizes) -> Self {
        let stamps = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pbmpm readback stamps"),
            size: size_of_val(&STAMPS) as u64,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&stamps, 0, bytemuck::cast_slice(&STAMPS));
        let buffer = |i| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(&format!("pbmpm counters readback {i}")),
                size: size_of::<Counters>() as u64 + sizes.load_bytes() + 2 * sizes.sensed_bytes() + STAMP_BYTES,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        CounterReadback {
            stamps,
            newest: 0,
            tickets: (0..COPIES).map(|i| Ticket { buffer: buffer(i), taken: None, stamp: 0 }).collect(),
            copies: sizes.load_copies as usize,
            loads: vec![[0; SUMS]; sizes.loads as usize],
            sensed_bytes: 2 * sizes.sensed_bytes(),
            sensed: vec![[0; sensor::SUMS]; sizes.sensors as usize],
        }
    }

    pub fn bytes(&self) -> u64 {
        self.tickets.iter().map(|ticket| ticket.buffer.size()).sum::<u64>() + self.stamps.size()
    }

    /// Records a copy of the counters, and of what was sensed; false if every staging buffer is still on its way.
    pub fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, buffers: &Buffers, recorded: u64) -> bool {
        let Some(ticket) = self.tickets.iter_mut().find(|t| t.taken.is_none()) else {
            return false;
        };
        let sensed = ticket.buffer.size() - STAMP_BYTES;
        let counters = sensed - self.sensed_bytes;
        encoder.copy_buffer_to_buffer(buffers.get(Slot::Counters), 0, &ticket.buffer, 0, counters);
        if self.sensed_bytes > 0 {
            encoder.copy_buffer_to_buffer(buffers.get(Slot::Sensed), 0, &ticket.buffer, counters, self.sensed_bytes);
        }
        let stamp = ticket.stamp as u64 * STAMP_BYTES;
        encoder.copy_buffer_to_buffer(&self.stamps, stamp, &ticket.buffer, sensed, STAMP_BYTES);
        ticket.taken = Some((recorded, Mapping::encode(encoder, &ticket.buffer)));
        true
    }

    /// Whether a copy is on its way.
    pub fn on_its_way(&self) -> bool {
        self.tickets.iter().any(|ticket| ticket.taken.is_some())
    }

    /// The newest copy that has arrived since the last call; an error if one could not be mapped.
    pub fn poll(&mut self) -> Result<Option<Arrived>, String> {
        let mut newest: Option<Arrived> = None;
        for ticket in &mut self.tickets {
            let Some((recorded, mapping)) = &ticket.taken else { continue };
            let recorded = *recorded;
            match mapping.outcome() {
                Outcome::Pending => continue,
                Outcome::Dropped => {}
                Outcome::Here => {
                    let view = ticket.buffer.get_mapped_range(..).map_err(|e| e.to_string())?;
                    let (copied, stamp) = view.split_at(view.len() - STAMP_BYTES as usize);
                    let made = bytemuck::pod_read_unaligned::<u32>(stamp) == STAMPS[ticket.stamp];
                    ticket.stamp ^= usize::from(made);
                    let (counters, loads) = copied.split_at(size_of::<Counters>());
                    let counters: Counters = bytemuck::pod_read_unaligned(counters);
                    // An older copy may arrive after a newer one, as hosts may poll the device at any time.
                    if made && self.newest <= recorded {
                        self.newest = recorded;
                        newest = Some(Arrived { recorded, counters });
                        let (loads, sensed) = loads.split_at(loads.len() - self.sensed_bytes as usize);
                        add_copies(&mut self.loads, loads, self.copies);
                        // The sums of the last step taken.
                        let turn = counters.steps.wrapping_sub(1) as usize & 1;
                        let sums = bytemuck::pod_collect_to_vec(&sensed[turn * sensed.len() / 2..][..sensed.len() / 2]);
                        self.sensed.copy_from_slice(&sums);
                    }
                    drop(view);
                    ticket.buffer.unmap();
                }
                Outcome::Failed => return Err("the counters could not be mapped; the device may be lost".to_owned()),
            }
            ticket.taken = None;
        }
        Ok(newest)
    }

    /// The sums of each sensor in the copy that [`poll`](Self::poll) gave last.
    pub fn sensed(&self) -> &[[i64; sensor::SUMS]] {
        &self.sensed
    }

    /// The sums of each load in the copy that [`poll`](Self::poll) gave last.
    pub fn loads(&self) -> &[[u64; SUMS]] {
        &self.loads
    }
}

pub fn add_copies(loads: &mut [[u64; SUMS]], bytes: &[u8], copies: usize) {
    let each = bytes.chunks_exact(size_of::<[u64; SUMS]>());
    loads.fill([0; SUMS]);
    for (i, copy) in each.enumerate() {
        let copy: [u64; SUMS] = bytemuck::pod_read_unaligned(copy);
        loads[i / copies].iter_mut().zip(copy).for_each(|(sum, part)| *sum = sum.wrapping_add(part));
    }
}
