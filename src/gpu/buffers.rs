//! One buffer per slot.

use super::layout::{Block, Chunk, Collider, Counters, Dispatch, Material, Sizes, StepConstants, TableEntry};
use super::slots::Slot;
use crate::bins::NODES;
use crate::report::Memory;

/// The buffers of a solver. Bindings with a size of their own start at multiples of `stride`.
#[derive(Debug)]
pub struct Buffers {
    buffers: [wgpu::Buffer; Slot::ALL.len()],
    /// Bytes from one step's constants to the next.
    pub constants_stride: u32,
    /// Bytes from one step's colliders to the next.
    pub colliders_stride: u32,
}

impl Buffers {
    pub fn new(device: &wgpu::Device, sizes: &Sizes, materials: usize, ring: u32) -> Self {
        let limits = device.limits();
        let stride = |bytes: u64, alignment: u32| (bytes as u32).next_multiple_of(alignment);
        let constants_stride = stride(size_of::<StepConstants>() as u64, limits.min_uniform_buffer_offset_alignment);
        let colliders = u64::from(sizes.colliders.max(1)) * size_of::<Collider>() as u64;
        // Bound as a uniform or a storage buffer.
        let alignment = limits.min_storage_buffer_offset_alignment.max(limits.min_uniform_buffer_offset_alignment);
        let colliders_stride = stride(colliders, alignment);
        let buffers = Slot::ALL.map(|slot| {
            let bytes = match slot {
                Slot::Constants => u64::from(ring) * u64::from(constants_stride),
                Slot::Colliders => u64::from(ring) * u64::from(colliders_stride),
                slot => bytes(slot, sizes, materials),
            };
            create(device, slot, bytes)
        });
        Buffers { buffers, constants_stride, colliders_stride }
    }

    /// Replaces the buffers whose size depends on the grid's.
    pub fn resize_grid(&mut self, device: &wgpu::Device, sizes: &Sizes, materials: usize) {
        for slot in [Slot::Table, Slot::Blocks, Slot::Links, Slot::Chunks, Slot::Cull, Slot::Grid] {
            self.buffers[slot as usize] = create(device, slot, bytes(slot, sizes, materials));
        }
    }

    pub fn get(&self, slot: Slot) -> &wgpu::Buffer {
        &self.buffers[slot as usize]
    }

    /// The buffer as a binding; those in the ring are bound one step at a time.
    pub fn binding(&self, slot: Slot, sizes: &Sizes) -> wgpu::BindingResource<'_> {
        let size = match slot {
            Slot::Constants => size_of::<StepConstants>() as u64,
            Slot::Colliders => u64::from(sizes.colliders.max(1)) * size_of::<Collider>() as u64,
            _ => return self.get(slot).as_entire_binding(),
        };
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: self.get(slot),
            offset: 0,
            size: std::num::NonZeroU64::new(size),
        })
    }

    pub fn memory(&self) -> Memory {
        let mut memory = Memory::default();
        for slot in Slot::ALL {
            let part = match slot {
                Slot::Position | Slot::Displacement | Slot::Gradient | Slot::Deformation => &mut memory.particles,
                Slot::Grid => &mut memory.grid,
                Slot::Bin | Slot::Order | Slot::Table | Slot::Blocks | Slot::Links | Slot::Chunks | Slot::Cull => {
                    &mut memory.bins
                }
                Slot::Constants
                | Slot::Materials
                | Slot::Colliders
                | Slot::Counters
                | Slot::DispatchOccupied
                | Slot::Dispatch => &mut memory.other,
            };
            *part += self.get(slot).size();
        }
        memory
    }
}

/// Bytes of a slot that is not in the ring. A binding may not be empty.
fn bytes(slot: Slot, sizes: &Sizes, materials: usize) -> u64 {
    let particles = u64::from(sizes.particles.max(1));
    let blocks = u64::from(sizes.blocks);
    match slot {
        Slot::Constants | Slot::Colliders => 0,
        Slot::Materials => (materials.max(1) * size_of::<Material>()) as u64,
        Slot::Position | Slot::Displacement => particles * 16,
        Slot::Gradient => particles * 48,
        Slot::Deformation if sizes.solids => particles * 48,
        Slot::Deformation => 0,
        Slot::Bin => particles * 8,
        Slot::Order => particles * 4,
        Slot::Table => u64::from(sizes.table) * size_of::<TableEntry>() as u64,
        Slot::Blocks => blocks * size_of::<Block>() as u64,
        Slot::Links => blocks * 8 * 4,
        Slot::Chunks => u64::from(sizes.chunks) * size_of::<Chunk>() as u64,
        Slot::Counters => size_of::<Counters>() as u64,
        Slot::DispatchOccupied => size_of_val(&Dispatch::NO_GROUPS) as u64,
        Slot::Dispatch => size_of::<Dispatch>() as u64,
        Slot::Cull => blocks * u64::from(sizes.cull_words.max(1)) * 4,
        Slot::Grid => blocks * NODES as u64 * 16,
    }
}

fn create(device: &wgpu::Device, slot: Slot, size: u64) -> wgpu::Buffer {
    use wgpu::BufferUsages as U;
    let usage = match slot {
        Slot::Constants | Slot::Materials => U::UNIFORM | U::COPY_DST,
        Slot::Colliders => U::UNIFORM | U::STORAGE | U::COPY_DST,
        Slot::DispatchOccupied | Slot::Dispatch => U::STORAGE | U::INDIRECT | U::COPY_DST,
        // A host draws from these.
        Slot::Position | Slot::Displacement | Slot::Gradient | Slot::Deformation => {
            U::STORAGE | U::VERTEX | U::COPY_SRC | U::COPY_DST
        }
        _ => U::STORAGE | U::COPY_SRC | U::COPY_DST,
    };
    let label = format!("pbmpm {}", slot.name());
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(&label), size, usage, mapped_at_creation: false })
}
