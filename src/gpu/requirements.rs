//! What the GPU path needs of a device.

use super::buffers::{largest_ring, largest_uniform};
use super::layout::{Candidate, DISTANCES_WIDTH, Held, MAX_GROUPS, Sizes, StressSearch};
use super::shader::ColliderStore;
use super::tuning::MOST_TILE_LANES;
use crate::bins::{NODES, TILE_NODES};
use crate::error::{Error, Result};

/// Storage buffers that the largest stage binds, where the colliders fit a uniform buffer or no particle has a
/// deformation gradient.
pub const STORAGE_BUFFERS: u32 = 8;

/// Uniform buffers that the largest stage binds.
pub const UNIFORM_BUFFERS: u32 = 5;

/// The highest number of a binding, plus 1.
pub const BINDINGS: u32 = 13;

/// Uniform buffers with an offset that differs from step to step in the largest stage.
pub const DYNAMIC_UNIFORM_BUFFERS: u32 = 3;
/// Storage buffers with such an offset.
pub const DYNAMIC_STORAGE_BUFFERS: u32 = 1;

/// Storage buffers that the largest stage binds on a device with these limits.
fn storage_buffers(limits: &wgpu::Limits, sizes: &Sizes) -> u32 {
    let stored =
        ColliderStore::choose(sizes.colliders, limits.max_uniform_buffer_binding_size) == ColliderStore::Storage;
    STORAGE_BUFFERS + u32::from(stored && sizes.features.deforms())
}

/// Bytes of workgroup memory that the largest stage uses: two tiles of 6³ nodes, with room between their rows, and a
/// little more.
pub const WORKGROUP_MEMORY: u32 = 10720;

/// The largest storage binding of a solver with these sizes.
pub fn largest_binding(sizes: &Sizes) -> u64 {
    let node = if sizes.features.implicit() { size_of::<Held>() } else { 16 };
    let tile = if sizes.features.shares_pressure { TILE_NODES * 12 } else { 0 };
    let grid = u64::from(sizes.blocks) * (NODES * node).max(tile) as u64;
    let of_particle = if sizes.features.tensors() { size_of::<StressSearch>() } else { 48 };
    let particles = u64::from(sizes.particles) * of_particle as u64;
    let candidates = u64::from(sizes.candidates) * size_of::<Candidate>() as u64;
    grid.max(particles).max(candidates)
}

/// WebGPU's default limits, raised only where these sizes need it.
pub fn limits(sizes: &Sizes) -> wgpu::Limits {
    let mut limits = wgpu::Limits::default();
    let largest = largest_binding(sizes);
    limits.max_storage_buffer_binding_size = limits.max_storage_buffer_binding_size.max(largest);
    limits.max_buffer_size = limits.max_buffer_size.max(largest).max(largest_ring(&limits, sizes));
    limits.max_texture_dimension_2d = limits.max_texture_dimension_2d.max(sizes.distance_rows);
    limits.max_storage_buffers_per_shader_stage = storage_buffers(&limits, sizes);
    limits
}

/// Fails with the first limit of the device that is too small.
pub fn check(limits: &wgpu::Limits, sizes: &Sizes) -> Result<()> {
    let largest = largest_binding(sizes);
    let remedy_size = "request GpuSolver::required_limits, with a GpuOptions::grid_blocks for all that matter may \
                       spread over, spawn fewer particles, or use larger cells";
    let remedy_meshes = "request GpuSolver::required_limits, or give meshes a larger grid_spacing";
    let remedy_ring = "request GpuSolver::required_limits, or have fewer steps in flight";
    let remedy = "request GpuSolver::required_limits, or use another adapter";
    let meshes = u32::from(sizes.distance_rows > 0);
    let rows = meshes * sizes.distance_rows.max(DISTANCES_WIDTH);
    macro_rules! need {
        ($limit:ident, $needed:expr, $remedy:expr) => {
            (stringify!($limit), u64::from(limits.$limit), u64::from($needed), $remedy)
        };
    }
    let needs = [
        need!(max_storage_buffers_per_shader_stage, storage_buffers(limits, sizes), remedy),
        need!(max_bindings_per_bind_group, BINDINGS, remedy),
        need!(max_uniform_buffers_per_shader_stage, UNIFORM_BUFFERS, remedy),
        need!(max_sampled_textures_per_shader_stage, meshes, remedy),
        need!(max_dynamic_uniform_buffers_per_pipeline_layout, DYNAMIC_UNIFORM_BUFFERS, remedy),
        need!(max_dynamic_storage_buffers_per_pipeline_layout, DYNAMIC_STORAGE_BUFFERS, remedy),
        need!(max_compute_invocations_per_workgroup, MOST_TILE_LANES, remedy),
        need!(max_compute_workgroup_size_x, MOST_TILE_LANES, remedy),
        need!(max_compute_workgroups_per_dimension, MAX_GROUPS, remedy),
        need!(max_compute_workgroup_storage_size, WORKGROUP_MEMORY, remedy),
        need!(max_texture_dimension_2d, rows, remedy_meshes),
        need!(max_uniform_buffer_binding_size, largest_uniform(limits, sizes), remedy),
        need!(max_storage_buffer_binding_size, largest, remedy_size),
        need!(max_buffer_size, largest, remedy_size),
        need!(max_buffer_size, largest_ring(limits, sizes), remedy_ring),
    ];
    match needs.into_iter().find(|(_, available, needed, _)| available < needed) {
        None => Ok(()),
        Some((what, available, needed, remedy)) => Err(Error::Unsupported { what, available, needed, remedy }),
    }
}
