//! Compiled stages and their bind groups.

use super::buffers::Buffers;
use super::layout::{Dispatch, GROUP, MAX_GROUPS, Sizes};
use super::shader::{ColliderStore, Variant, source};
use super::slots::{Bind, Only, Over, Slot};
use crate::plan::{Needs, Pass, Stage, passes};
use crate::stages::kernel;
use std::mem::offset_of;
use std::ops::Range;

/// A stage that a world needs.
#[derive(Debug)]
struct Compiled {
    layout: wgpu::BindGroupLayout,
    /// For the first pass of a step, and for the others and the last where those differ.
    first: wgpu::ComputePipeline,
    later: Option<wgpu::ComputePipeline>,
    last: Option<wgpu::ComputePipeline>,
}

/// All stages that a world needs.
#[derive(Debug)]
pub struct Pipelines {
    stages: [Option<Compiled>; Stage::ALL.len()],
    groups: [Option<wgpu::BindGroup>; Stage::ALL.len()],
    variant: Variant,
}

/// The bindings of a stage that a variant has, with their numbers.
pub fn binds(stage: Stage, variant: Variant) -> impl Iterator<Item = (u32, Bind)> {
    let all = (0..).zip(kernel(stage).binds.iter().copied());
    all.filter(move |(_, b)| match b.only {
        Only::Always => true,
        Only::WithColliders => variant.colliders.any(),
        Only::WithMaterials => variant.features.tells_materials(),
        Only::WithSolids => variant.features.solids(),
        Only::WithKinds => variant.features.kinds(),
        Only::WithTensors => variant.features.tensors(),
        Only::WithDeformation => variant.features.deforms(),
        Only::WithSticking => variant.features.sticks,
        Only::WithMeshes => variant.shapes_of(stage).meshes > 0,
        Only::WithTools => variant.tools,
        Only::WithSleep => variant.features.sleep,
        Only::WithFused => variant.fused(),
        Only::WithRepeats => variant.repeats(),
        Only::WithImplicit => variant.features.implicit(),
    })
}

/// Whether worlds of this variant compile a stage: whether any of their steps may need it.
pub fn is_needed(stage: Stage, variant: Variant) -> bool {
    let most = Needs {
        features: variant.features,
        iterations: if variant.repeats() { 2 } else { 1 },
        colliders: variant.colliders.any(),
        rescale: true,
        drains: variant.drains.is_some(),
        emission: variant.emission,
        sensors: variant.sensors.is_some(),
        fused: variant.fused(),
    };
    passes(most).any(|pass| pass.stage == stage)
}

impl Pipelines {
    pub fn new(device: &wgpu::Device, variant: Variant) -> Self {
        let stages = Stage::ALL.map(|stage| is_needed(stage, variant).then(|| compile(device, stage, variant)));
        Pipelines { stages, groups: [const { None }; Stage::ALL.len()], variant }
    }

    /// The variant that these are compiled for.
    pub fn variant(&self) -> Variant {
        self.variant
    }

    /// Compiles what `variant`, which has more drains, tools or emission than the present one, needs in addition.
    pub fn extend(&mut self, device: &wgpu::Device, variant: Variant) {
        let (drains, tools) = (variant.drains != self.variant.drains, variant.tools != self.variant.tools);
        for stage in Stage::ALL {
            let other = stage == Stage::Drain && drains || matches!(stage, Stage::GridUpdate | Stage::Predict) && tools;
            let made = self.stages[stage.index()].is_some() && !other;
            if !made && is_needed(stage, variant) {
                self.stages[stage.index()] = Some(compile(device, stage, variant));
            }
        }
        self.variant = variant;
    }

    /// Binds `buffers` to every stage.
    pub fn bind(&mut self, device: &wgpu::Device, buffers: &Buffers, sizes: &Sizes) {
        self.groups = Stage::ALL.map(|stage| {
            let compiled = self.stages[stage.index()].as_ref()?;
            let entries: Vec<_> = binds(stage, self.variant)
                .map(|(binding, bind)| wgpu::BindGroupEntry { binding, resource: buffers.binding(bind.slot, sizes) })
                .collect();
            Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(&format!("pbmpm {}", stage.name())),
                layout: &compiled.layout,
                entries: &entries,
            }))
        });
    }

    /// Records one pass of a plan for the step whose `inputs` are given.
    pub fn record(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        what: Pass,
        buffers: &Buffers,
        sizes: &Sizes,
        inputs: &Inputs,
    ) {
        let index = what.stage.index();
        let (Some(compiled), Some(group)) = (&self.stages[index], &self.groups[index]) else {
            debug_assert!(false, "{} is planned and not compiled", what.stage.name());
            return;
        };
        let mut used = [0; RINGS];
        let mut count = 0;
        for (_, bind) in binds(what.stage, self.variant) {
            if let Some(ring) = ring(bind.slot) {
                used[count] = inputs.offsets[ring];
                count += 1;
            }
        }
        let other = if what.first {
            None
        } else if what.last {
            compiled.last.as_ref()
        } else {
            compiled.later.as_ref()
        };
        pass.set_pipeline(other.unwrap_or(&compiled.first));
        pass.set_bind_group(0, group, &used[..count]);
        let indirect = match kernel(what.stage).over {
            Over::Particles => {
                let groups = sizes.particles.div_ceil(GROUP * self.variant.tuning.share);
                return pass.dispatch_workgroups(groups.min(MAX_GROUPS), 1, 1);
            }
            Over::Candidates => {
                let count = inputs.candidates.end - inputs.candidates.start;
                return pass.dispatch_workgroups(count.div_ceil(GROUP).min(MAX_GROUPS), 1, 1);
            }
            Over::SlotGroups => return pass.dispatch_workgroups(sizes.slot_groups().min(MAX_GROUPS), 1, 1),
            Over::One => return pass.dispatch_workgroups(1, 1, 1),
            Over::Occupied => return pass.dispatch_workgroups_indirect(buffers.get(Slot::DispatchOccupied), 0),
            Over::Blocks => offset_of!(Dispatch, blocks),
            Over::Nodes => offset_of!(Dispatch, nodes),
            Over::SolveNodes => offset_of!(Dispatch, solve_nodes),
            Over::SolveChunks if !what.last => offset_of!(Dispatch, solve_chunks),
            Over::Chunks | Over::SolveChunks => offset_of!(Dispatch, chunks),
        };
        pass.dispatch_workgroups_indirect(buffers.get(Slot::Dispatch), indirect as u64);
    }
}

/// Slots that are always bound as uniform buffers.
pub const UNIFORM: [Slot; 5] = [Slot::Constants, Slot::Materials, Slot::DistanceGrids, Slot::Tools, Slot::Disturbances];

/// Whether a variant binds a slot as a uniform buffer.
pub fn is_uniform(slot: Slot, variant: Variant) -> bool {
    match slot {
        Slot::Colliders => matches!(variant.colliders, ColliderStore::Uniform(_)),
        slot => UNIFORM.contains(&slot),
    }
}

/// Slots with an entry for each step in flight.
pub const RINGS: usize = 5;

/// Where the inputs of a step lie.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// Bytes from the beginning of each ring.
    pub offsets: [u32; RINGS],
    /// In the buffer of the candidates.
    pub candidates: Range<u32>,
}

/// Which ring a slot is in.
fn ring(slot: Slot) -> Option<usize> {
    match slot {
        Slot::Constants => Some(0),
        Slot::Colliders => Some(1),
        Slot::Regions => Some(2),
        Slot::Tools => Some(3),
        Slot::Disturbances => Some(4),
        _ => None,
    }
}

fn compile(device: &wgpu::Device, stage: Stage, variant: Variant) -> Compiled {
    let label = format!("pbmpm {}", stage.name());
    let entries: Vec<_> = binds(stage, variant).map(|(binding, bind)| layout_entry(binding, bind, variant)).collect();
    let layout =
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(&label), entries: &entries });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(&label),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(&label),
        source: wgpu::ShaderSource::Wgsl(source(stage, variant).into()),
    });
    let pipeline = |constants: &[(&str, f64)]| {
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&label),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("main"),
            // The shaders fill their tiles themselves.
            compilation_options: wgpu::PipelineCompilationOptions {
                constants,
                zero_initialize_workgroup_memory: false,
            },
            cache: None,
        })
    };
    let (first, later, last) = match stage {
        // Later iterations of the published scheme add no gravity.
        Stage::GridUpdate => {
            let later = variant.published().then(|| pipeline(&[]));
            (pipeline(&[("FIRST", 1.0)]), later, None)
        }
        Stage::Line => (pipeline(&[("FIRST", 1.0)]), Some(pipeline(&[])), None),
        Stage::Seek => (pipeline(&[("FIRST", 1.0)]), Some(pipeline(&[])), Some(pipeline(&[("LAST", 1.0)]))),
        _ => (pipeline(&[]), None, None),
    };
    Compiled { layout, first, later, last }
}

fn layout_entry(binding: u32, bind: Bind, variant: Variant) -> wgpu::BindGroupLayoutEntry {
    let buffer =
        |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: ring(bind.slot).is_some(), min_binding_size: None };
    let ty = match bind.slot {
        Slot::Distances => wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        slot if is_uniform(slot, variant) => buffer(wgpu::BufferBindingType::Uniform),
        _ => buffer(wgpu::BufferBindingType::Storage { read_only: !bind.write }),
    };
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None }
}
