//! All WGSL in all variants is valid; checked without a device.

use crate::backends::Tests;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use pbmpm::Scheme;
use pbmpm::Tuning;
use pbmpm::plan::Stage;
use pbmpm::shaders::{self, ColliderStore, Features, Shapes, Variant};
use std::collections::BTreeMap;

pub fn add(tests: &mut Tests) {
    tests.once("shaders_valid", "every_variant_parses_and_validates", every_variant_parses_and_validates);
    tests.once("shaders_valid", "every_text_follows_the_grammar", every_text_follows_the_grammar);
    tests.once("shaders_valid", "no_preprocessor_line_is_left", no_preprocessor_line_is_left);
    tests.once("shaders_valid", "storage_buffers_fit_webgpu", storage_buffers_fit_webgpu);
    tests.once("shaders_valid", "other_bindings_are_as_declared", other_bindings_are_as_declared);
    tests.once("shaders_valid", "workgroup_memory_is_as_declared", workgroup_memory_is_as_declared);
    tests.once("shaders_valid", "workgroup_sizes_are_as_dispatched", workgroup_sizes_are_as_dispatched);
    tests.once("shaders_valid", "names_of_libraries_differ", names_of_libraries_differ);
    tests.once("shaders_valid", "variants_hold_only_what_they_need", variants_hold_only_what_they_need);
}

/// A liquid alone, each solid alone, everything.
fn models() -> impl Iterator<Item = Features> {
    let none = Features::default();
    [
        Features { liquid: true, ..none },
        Features { elastic: true, ..none },
        Features { sand: true, ..none },
        Features { viscoplastic: true, ..none },
        Features { liquid: true, sand: true, ..none },
        Features { liquid: true, elastic: true, sand: true, viscoplastic: true, ..none },
    ]
    .into_iter()
}

/// Half-spaces alone, each shape alone, all with containers and meshes.
fn shapes() -> impl Iterator<Item = Shapes> {
    let none = Shapes::default();
    [
        none,
        Shapes { boxes: true, ..none },
        Shapes { spheres: true, ..none },
        Shapes { capsules: true, ..none },
        Shapes { cylinders: true, ..none },
        Shapes { spheres: true, containers: true, ..none },
        Shapes { meshes: 1, ..none },
        Shapes { boxes: true, spheres: true, capsules: true, cylinders: true, containers: true, meshes: 2 },
    ]
    .into_iter()
}

/// Every stage in every kind of variant that the host uses: combinations of the features that the stages depend on, and
/// the others one at a time.
pub fn variants() -> impl Iterator<Item = (Stage, Variant)> {
    let all = models().last().unwrap_or_default();
    let every_shape = shapes().last().unwrap_or_default();
    let stores = [ColliderStore::Absent, ColliderStore::Uniform(15), ColliderStore::Storage];
    let of_models = stores.into_iter().flat_map(|colliders| models().map(move |models| (colliders, models)));
    let of_models = of_models.flat_map(move |(colliders, models)| {
        let shapes = if colliders.any() { every_shape } else { Shapes::default() };
        let schemes = [
            (1, Scheme::Published),
            (1, Scheme::Explicit),
            (2, Scheme::Explicit),
            (3, Scheme::Explicit),
            (256, Scheme::Published),
        ];
        let explicit = move |scheme| scheme != Scheme::Published && colliders.any();
        let sticks = move |(materials, scheme)| explicit(scheme) && materials != 2 && models.liquid;
        schemes.map(|(materials, scheme)| Variant {
            features: Features {
                scheme,
                repeats: materials == 1,
                sticks: sticks((materials, scheme)),
                corrects: sticks((materials, scheme)) || (explicit(scheme) && materials > 1 && models.gaps()),
                volumes: materials > 1,
                sharpens: scheme != Scheme::Published && materials != 2,
                sleep: materials > 1,
                periodic: materials > 1,
                ..models
            },
            colliders,
            shapes,
            materials,
            drains: None,
            sensors: None,
            emission: materials > 1,
            loads: materials > 1 && colliders.any(),
            tools: materials == 2,
            tuning: Tuning { fused: materials == 1, ..if materials == 2 { Tuning::CPU } else { Tuning::GPU } },
            lanes_beside: if materials == 2 { 16 } else { 64 },
            solo_lanes: if materials == 2 { 64 } else { 256 },
        })
    });
    let colliders = ColliderStore::Uniform(40);
    let of_shape = move |shapes| Variant {
        features: Features { scheme: Scheme::Published, ..all },
        colliders,
        shapes,
        materials: 1,
        drains: Some(shapes),
        sensors: Some(shapes),
        emission: true,
        loads: true,
        tools: true,
        tuning: Tuning::GPU,
        lanes_beside: Tuning::GPU.lanes,
        solo_lanes: 256,
    };
    let of_shapes = shapes().map(of_shape);
    let liquids = Features { liquid: true, ..Features::default() };
    // Fused iterations without tiles.
    let fused = Features { scheme: Scheme::Published, repeats: true, ..liquids };
    let fused = Variant { features: fused, tuning: Tuning::CPU, ..of_shape(every_shape) };
    let thick = Features { thick: true, ..liquids };
    let but_sand = Features { elastic: true, viscoplastic: true, ..liquids };
    let [stiff, damped] = [thick, but_sand].map(|models| Features { resumes: true, ..models });
    let implicit = [(1, liquids), (2, liquids), (2, thick), (2, stiff), (3, but_sand), (4, damped)]
        .into_iter()
        .flat_map(|of| [(of, Tuning::GPU), (of, Tuning::CPU)]);
    let implicit = implicit.flat_map(move |((materials, models), tuning)| {
        let sticks = move |colliders: ColliderStore| colliders.any() && tuning == Tuning::GPU;
        stores.map(|colliders| Variant {
            features: Features {
                scheme: Scheme::Implicit,
                sticks: sticks(colliders),
                corrects: sticks(colliders) || (colliders.any() && models.gaps()),
                volumes: materials > 1,
                sharpens: materials != 2,
                shares_pressure: !models.resumes,
                sleep: materials > 1,
                periodic: materials > 1,
                ..models
            },
            colliders,
            shapes: if colliders.any() { every_shape } else { Shapes::default() },
            materials,
            drains: None,
            sensors: None,
            emission: false,
            loads: materials > 1 && colliders.any(),
            tools: materials > 1,
            tuning,
            lanes_beside: tuning.lanes,
            solo_lanes: tuning.lanes,
        })
    });
    let stages = of_models
        .chain(implicit)
        .chain([fused])
        .chain(of_shapes)
        .flat_map(|v| Stage::ALL.into_iter().map(move |stage| (stage, v)));
    // Stages that a world does not need are not built.
    stages.filter(|(stage, variant)| shaders::is_needed(*stage, *variant))
}

/// The stage as a parsed module.
pub fn module(stage: Stage, variant: Variant) -> naga::Module {
    let text = shaders::source(stage, variant);
    naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{stage:?} {variant:?}\n{}", e.emit_to_string(&text)))
}

fn every_variant_parses_and_validates() {
    for (stage, variant) in variants() {
        let module = module(stage, variant);
        // No capabilities: nothing that requires a WebGPU feature.
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        if let Err(e) = validator.validate(&module) {
            panic!("{stage:?} {variant:?}\n{}", e.emit_to_string(&shaders::source(stage, variant)));
        }
        assert_eq!(module.entry_points.len(), 1, "{stage:?}");
        assert_eq!(module.entry_points[0].name, "main", "{stage:?}");
        assert_eq!(module.entry_points[0].stage, naga::ShaderStage::Compute, "{stage:?}");
    }
}

/// WGSL asks for parentheses where shifts and bitwise operators meet, and `&&` and `||`. Naga does not, browsers do.
fn every_text_follows_the_grammar() {
    let texts: BTreeMap<String, (Stage, Variant)> =
        variants().map(|(stage, variant)| (shaders::source(stage, variant), (stage, variant))).collect();
    for (text, (stage, variant)) in texts {
        if let Err(e) = wgsl_parse::parse_str(&text) {
            panic!("{stage:?} {variant:?}: {e}\n{}", text.get(e.span.start..).unwrap_or_default());
        }
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
        // Deformation gradients and more colliders than fit into a uniform buffer: the only case that needs more than a
        // default limit.
        if variant.colliders == ColliderStore::Storage && variant.features.deforms() {
            assert!(count <= shaders::STORAGE_BUFFERS + 1, "{stage:?}: {count}");
            continue;
        }
        assert!(count <= wgpu::Limits::default().max_storage_buffers_per_shader_stage, "{stage:?}: {count}");
        most = most.max(count);
    }
    assert_eq!(most, 8, "WebGPU's default; nothing is gained below it");
    assert_eq!(most, shaders::STORAGE_BUFFERS);
}

/// Those that hosts may lower below WebGPU's defaults.
fn other_bindings_are_as_declared() {
    // Of the bindings in a ring, those that differ from step to step.
    let moves = ["constants", "colliders", "regions", "tools", "disturbances"];
    let (mut bindings, mut uniforms, mut moving, mut textures) = (0, 0, [0; 2], 0);
    for (stage, variant) in variants() {
        let module = module(stage, variant);
        let bound = || module.global_variables.iter().map(|(_, v)| v).filter(|v| v.binding.is_some());
        let uniform = |v: &naga::GlobalVariable| v.space == naga::AddressSpace::Uniform;
        let dynamic = |v: &naga::GlobalVariable| v.name.as_deref().is_some_and(|name| moves.contains(&name));
        let count = |of: &dyn Fn(&naga::GlobalVariable) -> bool| bound().filter(|v| of(v)).count() as u32;
        bindings = bindings.max(bound().filter_map(|v| v.binding).map(|b| b.binding + 1).max().unwrap_or(0));
        uniforms = uniforms.max(count(&uniform));
        moving[0] = moving[0].max(count(&|v| uniform(v) && dynamic(v)));
        moving[1] = moving[1].max(count(&|v| matches!(v.space, naga::AddressSpace::Storage { .. }) && dynamic(v)));
        textures = textures.max(count(&|v| v.space == naga::AddressSpace::Handle));
    }
    let declared = [shaders::DYNAMIC_UNIFORM_BUFFERS, shaders::DYNAMIC_STORAGE_BUFFERS];
    assert_eq!((bindings, uniforms, moving), (shaders::BINDINGS, shaders::UNIFORM_BUFFERS, declared));
    assert_eq!(textures, 1, "that of the distances");
}

fn workgroup_memory_is_as_declared() {
    let mut most = 0;
    for (stage, variant) in variants() {
        let module = module(stage, variant);
        let mut layouter = naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).expect("a valid module has layouts");
        let shared = module.global_variables.iter().filter(|(_, v)| v.space == naga::AddressSpace::WorkGroup);
        // As WebGPU counts it, with each variable rounded up to 16 bytes.
        let bytes: u32 = shared.map(|(_, v)| layouter[v.ty].size.next_multiple_of(16)).sum();
        assert!(bytes <= 16 << 10, "{stage:?}: {bytes}");
        most = most.max(bytes);
    }
    assert_eq!(most, shaders::WORKGROUP_MEMORY);
}

fn workgroup_sizes_are_as_dispatched() {
    for (stage, variant) in variants() {
        let [x, y, z] = module(stage, variant).entry_points[0].workgroup_size;
        assert_eq!([x, y, z], [shaders::workgroup_size(stage, variant), 1, 1], "{stage:?}");
        assert!(x <= wgpu::Limits::default().max_compute_invocations_per_workgroup, "{stage:?}");
    }
}

/// Any libraries can be imported together, but for those that do the same with tiles and without.
fn names_of_libraries_differ() {
    let mut owners = BTreeMap::new();
    for file in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/lib")).expect("the libraries") {
        let path = file.expect("a file").path();
        let library = path.file_stem().expect("a name").to_string_lossy().replace("_grid", "_tile");
        let text = std::fs::read_to_string(&path).expect("text");
        for name in text.lines().filter_map(top_level_name) {
            let owner = owners.entry(name.to_owned()).or_insert_with(|| library.clone());
            assert_eq!(*owner, library, "{name}");
        }
    }
    assert!(owners.len() > 200, "{}", owners.len());
}

/// The name that a line of WGSL declares, if it is at top level.
fn top_level_name(line: &str) -> Option<&str> {
    let (kind, rest) = line.split_once(' ')?;
    let declares = ["fn", "const", "struct", "alias"].contains(&kind) || kind.starts_with("var<");
    rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().filter(|_| declares)
}

/// Code that a scene does not need is not compiled.
fn variants_hold_only_what_they_need() {
    for (stage, variant) in variants() {
        let text = shaders::source(stage, variant);
        let absent = [
            (!variant.colliders.any(), "colliders["),
            (!variant.colliders.any(), "fn resolve"),
            (!variant.shapes.boxes, "fn box_surface"),
            (!variant.shapes.spheres, "fn sphere_surface"),
            (!variant.shapes.capsules, "fn capsule_surface"),
            (!variant.shapes.cylinders, "fn cylinder_surface"),
            (!variant.shapes.containers, "fn resolve_inside"),
            (variant.shapes.meshes == 0, "fn grid_surface"),
            (variant.shapes.meshes == 0, "textureLoad"),
            (!variant.loads, "load_weight"),
            (!variant.loads, "loads"),
            (variant.features.scheme == Scheme::Published, " solve:"),
            (stage != Stage::Predict || !variant.colliders.any(), "fn hold("),
            (!variant.tools, "fn wielded"),
            (!variant.tools, "tools["),
            (!variant.features.deforms(), "deformation["),
            (!variant.features.solids(), "fn svd"),
            (!variant.features.yielding(), "fn elastic_part"),
            (!variant.features.liquid, "fn constrain_liquid"),
        ];
        for (unneeded, what) in absent {
            assert!(!(unneeded && text.contains(what)), "{stage:?} {variant:?}: {what}");
        }
    }
    let everything = variants().last().map(|(_, variant)| variant).expect("there are variants");
    let text = shaders::source(Stage::Integrate, everything);
    let parts = [
        "fn resolve_inside",
        "fn box_surface",
        "fn grid_surface",
        "fn svd",
        "fn elastic_part",
        "fn note_load",
        "deformation[",
    ];
    for what in parts {
        assert!(text.contains(what), "{what}");
    }
}
