//! How large a world's buffers are at its start, and what they hold then.

use super::buffers::Buffers;
use super::layout::{self, Dispatch, Sizes};
use super::slots::Slot;
use super::{GpuOptions, inputs};
use crate::bins::{NONE, key_at, last_blocks, neighbour};
use crate::cpu::constants::CandidateConstants;
use crate::cpu::gradient::undeformed;
use crate::cpu::materials;
use crate::error::Result;
use crate::math::distance_grid::DistanceGrid;
use crate::spawn::Seed;
use crate::stages::integrate::largest_square;
use crate::timeline::Timeline;
use crate::timeline::asked::MOST_DUE;
use crate::world::World;
use std::collections::HashSet;
use std::sync::Arc;

/// Sizes for a world at its start: room for one and a half times the blocks that its matter touches, and for matter
/// spread to two particles a cell.
pub(super) fn sizes(world: &World, seeds: &[Seed], timeline: &Timeline, options: &GpuOptions) -> Result<Sizes> {
    let check = crate::error::Check { path: "options" };
    let ring = options.steps_in_flight;
    check.that((4..=MOST_DUE).contains(&ring), "steps_in_flight", ring, "4 to 1024")?;
    if let Some(tuning) = options.tuning {
        tuning.check(&check)?;
    }
    let asked = options.grid_blocks;
    check.that(asked.is_none_or(|b| (8..=1 << 24).contains(&b)), "grid_blocks", asked, "8 to 2^24")?;
    let blocks = asked.unwrap_or_else(|| {
        // A block holds many particles, so neighbours are looked up per block.
        let occupied: HashSet<_> = seeds.iter().map(|seed| key_at(timeline.place(seed.position).to_array())).collect();
        let last = last_blocks(world.domain.period_cells().to_array());
        let touched: HashSet<_> = occupied.iter().flat_map(|key| (0..8).map(|k| neighbour(*key, k, last))).collect();
        let domain = world.domain.extent_cells() / crate::bins::EDGE as f64;
        let everywhere = (domain.x + 3.0) * (domain.y + 3.0) * (domain.z + 3.0);
        let spread = (touched.len() * 3 / 2).max(seeds.len() / 24).max(64);
        spread.min(everywhere as usize).min(NONE as usize / 4) as u32
    });
    let capacity = world.room(seeds.len())? as u32;
    let loads = world.colliders.iter().filter(|c| c.measure).count() as u32;
    let tools = timeline.has_tools();
    let sizes = Sizes::new(capacity, timeline.features, timeline.collider_count() as u32, loads, blocks);
    let (materials, sensors) = (world.materials.len() as u32, world.sensors.len() as u32);
    let regions = world.drains.len() as u32 + sensors;
    let candidates = if world.emitters.is_empty() { 0 } else { inputs::CANDIDATES };
    Ok(Sizes { materials, tools, sensors, regions, candidates, ring, ..sizes }.with_grids(&timeline.grids))
}

/// Writes the particles and what never changes; returns the square of the largest displacement.
pub(super) fn upload(
    queue: &wgpu::Queue,
    buffers: &Buffers,
    sizes: &Sizes,
    world: &World,
    seeds: &[Seed],
    timeline: &Timeline,
) -> f32 {
    let units = timeline.units;
    let mut position = Vec::with_capacity(seeds.len());
    let mut displacement = Vec::with_capacity(seeds.len());
    let mut gradient = Vec::with_capacity(seeds.len());
    for seed in seeds {
        let (x, u, d) = CandidateConstants::<f32>::new(&timeline.particle(seed)).particle();
        position.push(x);
        displacement.push(u);
        gradient.push(d);
    }
    let materials: Vec<layout::Material> = materials::<f32>(world, &units).iter().map(Into::into).collect();
    queue.write_buffer(buffers.get(Slot::Position), 0, bytemuck::cast_slice(&position));
    queue.write_buffer(buffers.get(Slot::Displacement), 0, bytemuck::cast_slice(&displacement));
    queue.write_buffer(buffers.get(Slot::Gradient), 0, bytemuck::cast_slice(&gradient));
    if sizes.features.deforms() {
        let deformation = vec![undeformed::<f32>(); seeds.len()];
        queue.write_buffer(buffers.get(Slot::Deformation), 0, bytemuck::cast_slice(&deformation));
    }
    queue.write_buffer(buffers.get(Slot::Materials), 0, bytemuck::cast_slice(&materials));
    upload_distances(queue, buffers, &timeline.grids);
    nothing_to_do(queue, buffers);
    let last_largest_square = largest_square(&position, &displacement);
    let counters = layout::Counters { last_largest_square, present: 1, ..Default::default() };
    queue.write_buffer(buffers.get(Slot::Counters), 0, bytemuck::bytes_of(&counters));
    last_largest_square
}

/// Writes the distances of all grids one after the other.
pub(super) fn upload_distances(queue: &wgpu::Queue, buffers: &Buffers, grids: &[Arc<DistanceGrid>]) {
    let Some(texture) = buffers.distances() else {
        return;
    };
    let mut headers = Vec::new();
    let mut values = Vec::new();
    for grid in grids {
        headers.push(layout::DistanceGrid::new(grid, values.len() as u32));
        values.extend_from_slice(&grid.values);
    }
    values.resize((texture.width() * texture.height()) as usize, 0.0);
    queue.write_buffer(buffers.get(Slot::DistanceGrids), 0, bytemuck::cast_slice(&headers));
    let rows =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * texture.width()), rows_per_image: None };
    queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&values), rows, texture.size());
}

/// Sets the indirect dispatches to no groups, as every step leaves them.
pub(super) fn nothing_to_do(queue: &wgpu::Queue, buffers: &Buffers) {
    queue.write_buffer(buffers.get(Slot::DispatchOccupied), 0, bytemuck::bytes_of(&Dispatch::NO_GROUPS));
    queue.write_buffer(buffers.get(Slot::Dispatch), 0, bytemuck::bytes_of(&Dispatch::NOTHING));
}
