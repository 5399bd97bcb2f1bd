//! All WGSL in all variants is valid without a device.

use crate::backends::Tests;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use pbmpm::plan::Stage;
use pbmpm::shaders::{self, ColliderStore, Models, Variant};

pub fn add(tests: &mut Tests) {
    tests.once("shaders_valid", "every_variant_parses_and_validates", every_variant_parses_and_validates);
    tests.once("shaders_valid", "no_preprocessor_line_is_left", no_preprocessor_line_is_left);
    tests.once("shaders_valid", "storage_buffers_fit_webgpu", storage_buffers_fit_webgpu);
    tests.once("shaders_valid", "workgroup_memory_is_as_declared", workgroup_memory_is_as_declared);
    tests.once("shaders_valid", "workgroup_sizes_are_as_dispatched", workgroup_sizes_are_as_dispatched);
    tests.once(
        "shaders_valid",
        "variants_without_colliders_have_no_contact",
        variants_without_colliders_have_no_contact,
    );
}

/// A liquid alone, each solid alone, everything.
fn models() -> impl Iterator<Item = Models> {
    let none = Models::default();
    [
        Models { liquid: true, ..none },
        Models { elastic: true, ..none },
        Models { sand: true, ..none },
        Models { viscoplastic: true, ..none },
        Models { liquid: true, elastic: true, sand: true, viscoplastic: true },
    ]
    .into_iter()
}

/// Every stage in every kind of variant that the host uses.
pub fn variants() -> impl Iterator<Item = (Stage, Variant)> {
    let variants = [ColliderStore::Absent, ColliderStore::Uniform(15), ColliderStore::Storage]
        .into_iter()
        .flat_map(|colliders| [1, 2, 256].into_iter().map(move |materials| (colliders, materials)))
        .flat_map(|(colliders, materials)| {
            models().map(move |models| Variant { colliders, materials, models, volumes: materials > 1 })
        });
    let all = variants.flat_map(|variant| Stage::ALL.into_iter().map(move |stage| (stage, variant)));
    // Stages that a world does not need are not made.
    all.filter(|(stage, variant)| match stage {
        Stage::ColliderCull => variant.colliders.any(),
        Stage::VolumeP2g | Stage::VolumeG2p => variant.volumes,
        _ => true,
    })
}

/// The parsed stage.
pub fn module(stage: Stage, variant: Variant) -> naga::Module {
    let text = shaders::source(stage, variant);
    naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{stage:?} {variant:?}\n{}", e.emit_to_string(&text)))
}

fn every_variant_parses_and_validates() {
    for (stage, variant) in variants() {
        let module = module(stage, variant);
        // No capability: nothing that WebGPU has only with a feature.
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        if let Err(e) = validator.validate(&module) {
            panic!("{stage:?} {variant:?}\n{}", e.emit_to_string(&shaders::source(stage, variant)));
        }
        assert_eq!(module.entry_points.len(), 1, "{stage:?}");
        assert_eq!(module.entry_points[0].name, "main", "{stage:?}");
        assert_eq!(module.entry_points[0].stage, naga::ShaderStage::Compute, "{stage:?}");
    }
}

fn no_preprocessor_line_is_left() {
    for (stage, variant) in variants() {
        for line in shaders::source(stage, variant).lines() {
            assert!(!line.trim_start().starts_with('#'), "{stage:?} {variant:?}: {line}");
        }
    }
}

fn storage_buffers_fit_webgpu() {
    let mut most = 0;
    for (stage, variant) in variants() {
        let module = module(stage, variant);
        let storage = |v: &naga::GlobalVariable| matches!(v.space, naga::AddressSpace::Storage { .. });
        let count = module.global_variables.iter().filter(|(_, v)| storage(v)).count() as u32;
        // Solids and more colliders than fit a uniform buffer: the one case that asks for a limit above the default.
        if variant.colliders == ColliderStore::Storage && variant.models.solids() {
            assert!(count <= shaders::STORAGE_BUFFERS + 1, "{stage:?}: {count}");
            continue;
        }
        assert!(count <= wgpu::Limits::default().max_storage_buffers_per_shader_stage, "{stage:?}: {count}");
        most = most.max(count);
    }
    assert_eq!(most, 8, "WebGPU's default; nothing is gained below it");
    assert_eq!(most, shaders::STORAGE_BUFFERS);
}

fn workgroup_memory_is_as_declared() {
    let mut most = 0;
    for (stage, variant) in variants() {
        let module = module(stage, variant);
        let mut layouter = naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).expect("a valid module has layouts");
        let shared = module.global_variables.iter().filter(|(_, v)| v.space == naga::AddressSpace::WorkGroup);
        // As WebGPU counts it: each variable rounded up to 16 bytes.
        let bytes: u32 = shared.map(|(_, v)| layouter[v.ty].size.next_multiple_of(16)).sum();
        assert!(bytes <= 16 << 10, "{stage:?}: {bytes}");
        most = most.max(bytes);
    }
    assert_eq!(most, shaders::WORKGROUP_MEMORY);
}

fn workgroup_sizes_are_as_dispatched() {
    for (stage, variant) in variants() {
        let [x, y, z] = module(stage, variant).entry_points[0].workgroup_size;
        assert_eq!([x, y, z], [shaders::workgroup_size(stage), 1, 1], "{stage:?}");
        assert!(x <= wgpu::Limits::default().max_compute_invocations_per_workgroup, "{stage:?}");
    }
}

/// What a scene does not need is not compiled.
fn variants_without_colliders_have_no_contact() {
    for (stage, variant) in variants().filter(|(_, v)| !v.colliders.any()) {
        let text = shaders::source(stage, variant);
        assert!(!text.contains("colliders[") && !text.contains("fn resolve"), "{stage:?}");
    }
    let with =
        Variant { colliders: ColliderStore::Storage, materials: 1, models: models().next().unwrap(), volumes: false };
    assert!(shaders::source(Stage::GridUpdate, with).contains("fn resolve"));
}
