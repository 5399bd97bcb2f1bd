//! The shaders as text, for tools and tests that need no device.

use crate::gpu::slots::Over;
use crate::gpu::{layout, pipelines, shader};
use crate::plan::Stage;
use crate::settings::Scheme;
use crate::stages::kernel;
use std::mem::offset_of;

pub use crate::collider::Shapes;
pub use crate::features::Features;
pub use crate::gpu::requirements::{
    BINDINGS, DYNAMIC_STORAGE_BUFFERS, DYNAMIC_UNIFORM_BUFFERS, STORAGE_BUFFERS, UNIFORM_BUFFERS, WORKGROUP_MEMORY,
};
pub use crate::gpu::shader::{ColliderStore, Variant};
pub use crate::gpu::tuning::Tuning;

/// The complete WGSL of a stage.
pub fn source(stage: Stage, variant: Variant) -> String {
    shader::source(stage, variant)
}

/// A file of `shaders/lib`, with the lines of every variant except meshes, which need bindings.
///
/// # Panics
/// If there is no such file.
pub fn library(name: &str) -> String {
    let shapes = Shapes { boxes: true, spheres: true, capsules: true, cylinders: true, containers: true, meshes: 0 };
    let features = Features {
        scheme: Scheme::Implicit,
        repeats: true,
        liquid: true,
        elastic: true,
        sand: true,
        viscoplastic: true,
        thick: true,
        sticks: true,
        corrects: true,
        walls: true,
        faces: true,
        resumes: true,
        volumes: true,
        sharpens: true,
        shares_pressure: true,
        sleep: true,
        periodic: true,
    };
    let variant = Variant {
        features,
        colliders: ColliderStore::Storage,
        shapes,
        materials: 2,
        drains: Some(shapes),
        sensors: Some(shapes),
        emission: true,
        loads: true,
        tools: true,
        tuning: Tuning::GPU,
        lanes_beside: Tuning::GPU.lanes,
        solo_lanes: Tuning::GPU.tile_lanes,
    };
    shader::expand(shader::library(name), None, variant, &mut String::new())
}

/// The bindings that the host makes for a stage: number, variable, whether it is written, whether it is uniform.
pub fn bindings(stage: Stage, variant: Variant) -> Vec<(u32, &'static str, bool, bool)> {
    pipelines::binds(stage, variant)
        .map(|(n, b)| (n, b.slot.name(), b.write, pipelines::is_uniform(b.slot, variant)))
        .collect()
}

/// Whether worlds of this variant need a stage.
pub fn is_needed(stage: Stage, variant: Variant) -> bool {
    pipelines::is_needed(stage, variant)
}

/// Invocations in a workgroup of a stage.
pub fn workgroup_size(stage: Stage, variant: Variant) -> u32 {
    match kernel(stage).over {
        Over::Chunks | Over::SolveChunks | Over::Nodes | Over::SolveNodes => variant.of_stage(stage).tuning.lanes,
        Over::One if stage == Stage::BlockSolve => variant.of_stage(stage).tuning.lanes,
        Over::One if stage != Stage::EmitScan => 1,
        _ => layout::GROUP,
    }
}

/// Name, size, and names and offsets of the fields of a structure.
pub type StructLayout = (&'static str, usize, Vec<(&'static str, usize)>);

/// Every structure that the host passes to shaders, as laid out by Rust.
pub fn structures() -> Vec<StructLayout> {
    macro_rules! layout {
        ($name:ident: $($field:ident),*) => {
            (
                stringify!($name),
                size_of::<layout::$name>(),
                vec![$((stringify!($field), offset_of!(layout::$name, $field))),*],
            )
        };
    }
    vec![
        layout!(StepConstants: kick, max_displacement, lo, max_gradient, hi, volume_gain, momentum_scale, mass_scale,
            lightest, tension_limit, push_out, rescale, particle_count, open_sides, collider_count, cull_words,
            table_mask, max_blocks, drain_count, candidate_first, candidate_count, slot_groups, load_scale, load_copies,
            tool_count, seconds, stiffness_limit, block_stiffness, tolerance, pressure_rescale, impulse, release,
            rest_square, rest_lasted, period, rest_needed),
        layout!(Material: model, gain, viscous_relaxation, inverse_density, shape_weight, yield_limit, bulk, viscosity, shear,
            solved_viscosity, even, lightness),
        layout!(Collider: position, kind, size, friction, shift, load, axes, turn_x, faces, turn_y, joints, turn_z),
        layout!(Candidate: position, limit, displacement, mass, turn, material),
        layout!(DistanceGrid: lo, spacing, last, inverse_spacing, middle, first, extent, padding),
        layout!(Tool: start, inverse_way, way, inverse_radius, push, pull, spin, share),
        layout!(TableEntry: key, count, block, unrest),
        layout!(Place: entry, rank, rest),
        layout!(Disturbance: lo, count, hi, padding),
        layout!(Block: key, entry, start, count, tiles),
        layout!(Chunk: block, start, count, key, sleep, links, cell_count, cells, load, found),
        layout!(Counters: halted, occupied, halo, ordered, chunks, largest_square, largest_motion, steps, steps_deferred, saturated_nodes, speed_clamped,
            gradient_clamped, escaped, quarantined, last_occupied, last_active, drained, emitted, withheld, refused,
            last_count, last_change, last_motion, last_largest_square, iterations, capped, worst_change,
            asleep, last_asleep, strain_clamped, present),
        layout!(Dispatch: blocks, nodes, chunks, solve_nodes, solve_chunks),
        layout!(Search: pressure, residual, direction, compliance),
        layout!(Symmetric: diagonal, off),
        layout!(Shear: brought, found, residual, direction, compliance, correction_x, correction_y, correction_z),
        layout!(StressSearch: mean, shear),
        layout!(BlockSums: sums, softest, firmest, links),
        layout!(BlockPressure: residual, inverse, direction, compliance, found, load, most, volume),
        layout!(Held: axis, count_and_body, motion, braked),
        layout!(Solve: largest, sums, motion, first_bound, bound, last_bound, direction_bound, ahead, pressure_bound, last_square, first_square, step, mix, change,
            count, going_on, chunks),
    ]
}
