//! One buffer per slot.

use super::layout::{
    Block, BlockPressure, BlockSums, Candidate, Chunk, Collider, Counters, DISTANCES_WIDTH, Dispatch, DistanceGrid,
    Disturbance, GROUP, Held, Material, Place, Search, Sizes, Solve, StepConstants, StressSearch, TOOLS, TableEntry,
    Tool, coupling,
};
use super::pipelines::UNIFORM;
use super::slots::Slot;
use crate::bins::{NODES, TILE_NODES};
use crate::report::Memory;
use crate::stages::gap::NODES_PER_WORD;
use crate::timeline::disturbance::DISTURBANCES;

/// The buffers of a solver.
#[derive(Debug)]
pub struct Buffers {
    buffers: [wgpu::Buffer; Slot::ALL.len()],
    /// The texture of [`Slot::Distances`], where there is any; the slot's buffer is empty.
    distances: Option<(wgpu::Texture, wgpu::TextureView)>,
    /// Steps that the rings have room for.
    ring: u32,
}

impl Buffers {
    pub fn new(device: &wgpu::Device, sizes: &Sizes) -> Self {
        let limits = device.limits();
        let buffers = Slot::ALL.map(|slot| create(device, slot, bytes(&limits, slot, sizes)));
        Buffers { buffers, distances: distances(device, sizes.distance_rows), ring: sizes.ring }
    }

    /// The texture of [`Slot::Distances`], where there is any.
    pub fn distances(&self) -> Option<&wgpu::Texture> {
        self.distances.as_ref().map(|(texture, _)| texture)
    }

    /// Replaces the buffers whose size has changed.
    pub fn resize(&mut self, device: &wgpu::Device, sizes: &Sizes) {
        let limits = device.limits();
        for slot in Slot::ALL {
            let bytes = bytes(&limits, slot, sizes);
            if self.get(slot).size() != bytes {
                self.buffers[slot as usize] = create(device, slot, bytes);
            }
        }
        if self.distances().map_or(0, wgpu::Texture::height) != sizes.distance_rows {
            self.distances = distances(device, sizes.distance_rows);
        }
    }

    pub fn get(&self, slot: Slot) -> &wgpu::Buffer {
        &self.buffers[slot as usize]
    }

    /// Bytes from one step's part of a ring to the next.
    pub fn stride(&self, slot: Slot) -> u32 {
        (self.get(slot).size() / u64::from(self.ring)) as u32
    }

    /// The buffer as a binding; those in the ring are bound one step at a time.
    pub fn binding(&self, slot: Slot, sizes: &Sizes) -> wgpu::BindingResource<'_> {
        if let (Slot::Distances, Some((_, view))) = (slot, &self.distances) {
            return wgpu::BindingResource::TextureView(view);
        }
        let Some(size) = of_step(slot, sizes) else {
            return self.get(slot).as_entire_binding();
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
                Slot::Position | Slot::Displacement | Slot::Gradient | Slot::Deformation | Slot::Search => {
                    &mut memory.particles
                }
                Slot::Grid
                | Slot::Field
                | Slot::Held
                | Slot::Force
                | Slot::BlockTiles
                | Slot::BlockSums
                | Slot::BlockPressures
                | Slot::Couplings => &mut memory.grid,
                Slot::Bin | Slot::Order | Slot::Table | Slot::Blocks | Slot::Links | Slot::Chunks | Slot::Cull => {
                    &mut memory.bins
                }
                Slot::Constants
                | Slot::Materials
                | Slot::Colliders
                | Slot::DistanceGrids
                | Slot::Distances
                | Slot::Counters
                | Slot::DispatchOccupied
                | Slot::Dispatch
                | Slot::Regions
                | Slot::Candidates
                | Slot::Accepted
                | Slot::Vacancies
                | Slot::Tools
                | Slot::Disturbances
                | Slot::Solve
                | Slot::Sensed => &mut memory.other,
            };
            *part += self.get(slot).size();
        }
        memory.other += self.distances().map_or(0, |t| u64::from(t.width()) * u64::from(t.height()) * 4);
        memory
    }
}

/// Bytes per step of a slot in the ring.
fn of_step(slot: Slot, sizes: &Sizes) -> Option<u64> {
    match slot {
        Slot::Constants => Some(size_of::<StepConstants>() as u64),
        Slot::Colliders => Some(u64::from(sizes.colliders.max(1)) * size_of::<Collider>() as u64),
        Slot::Regions => Some(u64::from(sizes.regions) * size_of::<Collider>() as u64),
        Slot::Tools if sizes.tools => Some((TOOLS * size_of::<Tool>()) as u64),
        Slot::Tools => Some(0),
        Slot::Disturbances if sizes.features.sleep => Some((DISTURBANCES * size_of::<Disturbance>()) as u64),
        Slot::Disturbances => Some(0),
        _ => None,
    }
}

/// Bytes of a slot in the ring, of all steps in flight.
fn of_ring(limits: &wgpu::Limits, slot: Slot, sizes: &Sizes) -> u64 {
    // Bound as a uniform or a storage buffer.
    let alignment = limits.min_storage_buffer_offset_alignment.max(limits.min_uniform_buffer_offset_alignment);
    u64::from(sizes.ring) * of_step(slot, sizes).unwrap_or(0).next_multiple_of(u64::from(alignment))
}

/// Bytes of the largest ring.
pub fn largest_ring(limits: &wgpu::Limits, sizes: &Sizes) -> u64 {
    Slot::ALL.into_iter().map(|slot| of_ring(limits, slot, sizes)).fold(0, u64::max)
}

/// Bytes of the largest uniform binding, but for colliders, which are bound as one only where they fit.
pub fn largest_uniform(limits: &wgpu::Limits, sizes: &Sizes) -> u64 {
    let of = |slot| of_step(slot, sizes).unwrap_or_else(|| bytes(limits, slot, sizes));
    UNIFORM.map(of).into_iter().fold(0, u64::max)
}

/// Bytes of a slot. Buffers that every world binds may not be empty.
fn bytes(limits: &wgpu::Limits, slot: Slot, sizes: &Sizes) -> u64 {
    let particles = u64::from(sizes.particles.max(1));
    let blocks = u64::from(sizes.blocks);
    match slot {
        Slot::Constants | Slot::Colliders | Slot::Regions | Slot::Tools | Slot::Disturbances => {
            of_ring(limits, slot, sizes)
        }
        Slot::Distances => 0,
        Slot::Sensed => 2 * sizes.sensed_bytes(),
        Slot::DistanceGrids => u64::from(sizes.grids) * size_of::<DistanceGrid>() as u64,
        Slot::Materials => u64::from(sizes.materials.max(1)) * size_of::<Material>() as u64,
        Slot::Position | Slot::Displacement => particles * 16,
        Slot::Gradient => particles * 48,
        Slot::Deformation if sizes.features.deforms() => particles * 48,
        Slot::Deformation => 0,
        // Without the field `rest` where nothing sleeps.
        Slot::Bin => particles * (size_of::<Place>() as u64 - if sizes.features.sleep { 0 } else { 4 }),
        Slot::Order => particles * 4,
        Slot::Table => u64::from(sizes.table) * size_of::<TableEntry>() as u64,
        Slot::Blocks => blocks * size_of::<Block>() as u64,
        Slot::Links => blocks * 8 * 4,
        Slot::Chunks => u64::from(sizes.chunks) * Chunk::stride(sizes.features.shares_pressure) as u64,
        Slot::Counters => size_of::<Counters>() as u64 + sizes.load_bytes(),
        Slot::DispatchOccupied => size_of_val(&Dispatch::NO_GROUPS) as u64,
        Slot::Dispatch => size_of::<Dispatch>() as u64,
        Slot::Cull => {
            let noted = if sizes.features.gaps() && sizes.colliders > 0 { NODES + NODES / NODES_PER_WORD } else { 0 };
            blocks * (u64::from(sizes.cull_words.max(1)) + noted as u64) * 4
        }
        Slot::Grid => blocks * NODES as u64 * 16,
        Slot::Candidates => u64::from(sizes.candidates) * size_of::<Candidate>() as u64,
        Slot::Accepted => u64::from(sizes.candidates) * 4,
        Slot::Vacancies if sizes.candidates > 0 => {
            u64::from(sizes.slot_groups() + sizes.candidates.div_ceil(GROUP)) * 4
        }
        Slot::Vacancies => 0,
        Slot::Force if sizes.features.fuses() && sizes.features.repeats => blocks * NODES as u64 * 16,
        Slot::Search | Slot::Field | Slot::Held | Slot::Force | Slot::Solve if !sizes.features.implicit() => 0,
        Slot::Search if sizes.features.tensors() => particles * size_of::<StressSearch>() as u64,
        Slot::Search => particles * size_of::<Search>() as u64,
        Slot::Field | Slot::Force => blocks * NODES as u64 * 16,
        Slot::Held => blocks * (NODES * size_of::<Held>()) as u64,
        Slot::Solve => size_of::<Solve>() as u64,
        Slot::BlockTiles | Slot::BlockSums | Slot::BlockPressures | Slot::Couplings
            if !sizes.features.shares_pressure =>
        {
            0
        }
        Slot::BlockTiles => blocks * TILE_NODES as u64 * 12,
        Slot::BlockSums => blocks * size_of::<BlockSums>() as u64,
        Slot::BlockPressures => blocks * size_of::<BlockPressure>() as u64,
        Slot::Couplings => blocks * 16 * coupling::VECTORS as u64,
    }
}

fn distances(device: &wgpu::Device, rows: u32) -> Option<(wgpu::Texture, wgpu::TextureView)> {
    if rows == 0 {
        return None;
    }
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("pbmpm distances"),
        size: wgpu::Extent3d { width: DISTANCES_WIDTH, height: rows, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    Some((texture, view))
}

fn create(device: &wgpu::Device, slot: Slot, size: u64) -> wgpu::Buffer {
    use wgpu::BufferUsages as U;
    let usage = match slot {
        Slot::Constants | Slot::Materials | Slot::Tools | Slot::Disturbances | Slot::DistanceGrids => {
            U::UNIFORM | U::COPY_DST
        }
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
