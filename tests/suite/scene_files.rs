//! The scene files, their schema and their documentation agree with the types.

use crate::backends::{Backend, Tests};
use crate::worlds::{after, assert_sound, depth, report};
use pbmpm::{Quality, Scheme, Settings, scene};
use std::path::{Path, PathBuf};

pub fn add(tests: &mut Tests) {
    tests.once("scene_files", "schema_file_is_up_to_date", schema_file_is_up_to_date);
    tests.once("scene_files", "schema_has_no_links", schema_has_no_links);
    tests.once(
        "scene_files",
        "every_scene_loads_fits_the_schema_and_round_trips",
        every_scene_loads_fits_the_schema_and_round_trips,
    );
    tests.once("scene_files", "schema_refuses_what_the_reader_refuses", schema_refuses_what_the_reader_refuses);
    tests.once("scene_files", "thesis_scenes_have_the_thesis_size", thesis_scenes_have_the_thesis_size);
    tests.once("scene_files", "every_scene_runs", every_scene_runs);
    tests.once("scene_files", "documented_examples_load", documented_examples_load);
    tests.once("scene_files", "what_is_chosen_follows_what_is_stated", what_is_chosen_follows_what_is_stated);
    tests.once("scene_files", "a_byte_order_mark_is_no_part_of_a_file", a_byte_order_mark_is_no_part_of_a_file);
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The scenes that the crate ships.
pub fn scene_files() -> Vec<PathBuf> {
    let folder = std::fs::read_dir(root().join("scenes")).expect("the folder scenes exists");
    let mut files: Vec<_> = folder.map(|entry| entry.expect("a readable folder").path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "json"));
    files.sort();
    assert!(files.len() >= 13, "{files:?}");
    files
}

fn validator() -> jsonschema::Validator {
    let schema = serde_json::from_str(&scene::schema()).expect("the schema is JSON");
    jsonschema::validator_for(&schema).expect("the schema is a schema")
}

fn schema_file_is_up_to_date() {
    let file = root().join("docs/scene.schema.json");
    if std::env::var_os("PBMPM_WRITE_SCHEMA").is_some_and(|v| v == "1") {
        std::fs::write(&file, scene::schema()).expect("docs is writable");
    }
    let kept = std::fs::read_to_string(&file).unwrap_or_default().replace("\r\n", "\n");
    assert!(
        kept == scene::schema(),
        "docs/scene.schema.json is out of date: run `PBMPM_WRITE_SCHEMA=1 cargo test --test suite scene_files` and commit it"
    );
}

/// Editors show its descriptions as they are.
fn schema_has_no_links() {
    let schema = scene::schema();
    let links: Vec<_> =
        schema.lines().filter(|line| ["[`", "`]", "](", "crate::"].iter().any(|s| line.contains(s))).collect();
    assert!(links.is_empty(), "{links:#?}");
}

fn every_scene_loads_fits_the_schema_and_round_trips() {
    let validator = validator();
    for file in scene_files() {
        let world = scene::from_file(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        assert!(!world.name.is_empty() && world.camera.is_some(), "{}", file.display());
        assert!(world.capacity().is_ok_and(|n| n > 0), "{}", file.display());
        let text = std::fs::read_to_string(&file).expect("it was just read");
        for text in [text, scene::to_json(&world)] {
            let document = serde_json::from_str(&text).expect("it was just read");
            let errors: Vec<_> =
                validator.iter_errors(&document).map(|e| format!("{}: {e}", e.instance_path())).collect();
            assert!(errors.is_empty(), "{}: {errors:?}", file.display());
        }
        let folder = scene::folder_of(&file);
        assert_eq!(scene::from_json_in(&scene::to_json(&world), folder).as_ref(), Ok(&world), "{}", file.display());
    }
}

/// A stated capacity lets a host add any of the materials, and bodies may not outrun `max_displacement`.
fn what_is_chosen_follows_what_is_stated() {
    let scene = |settings: &str| {
        let text = format!(
            r#"{{
                "domain": {{ "min": [0, 0, 0], "max": [1, 1, 1], "cell_size": 0.05 }},
                "materials": [
                    {{ "name": "water", "model": "liquid", "rest_density": 1000 }},
                    {{ "name": "sand", "model": {{ "sand": {{ "friction_angle": 30 }} }}, "rest_density": 1600 }}
                ],
                "spawns": [{{ "material": "water", "shape": {{ "box": {{ "half_size": [0.2, 0.2, 0.2] }} }}, "position": [0.5, 0.3, 0.5], "fill": {{ "per_cell": 8 }} }}],
                "colliders": [{{ "shape": {{ "sphere": {{ "radius": 0.1 }} }}, "position": [0.5, 0.8, 0.5], "linear_velocity": [0, -20, 0] }}],
                "settings": {{ {settings} }}
            }}"#
        );
        scene::from_json(&text).unwrap_or_else(|e| panic!("{settings}: {e}"))
    };
    assert_eq!(scene("").settings.scheme, Scheme::Implicit);
    for settings in [r#""capacity": 20000"#, r#""max_displacement": 1"#] {
        let mut world = scene(settings);
        let found = world.settings.clone();
        world.settings =
            Settings { capacity: found.capacity, max_displacement: found.max_displacement, ..Settings::default() };
        assert_eq!(found, Quality::Realtime.settings(&world), "{settings}");
        assert_ne!(found.dt, scene("").settings.dt, "{settings}");
    }
}

fn a_byte_order_mark_is_no_part_of_a_file() {
    let file = &scene_files()[0];
    let marked = std::env::temp_dir().join(format!("pbmpm-marked-{}.json", std::process::id()));
    let text = std::fs::read_to_string(file).expect("it is a scene");
    std::fs::write(&marked, format!("\u{feff}{text}")).expect("a writable folder");
    let read = scene::read_text(&marked);
    std::fs::remove_file(&marked).expect("it was just written");
    assert_eq!(read, Ok(text));
}

/// 40 steps on the CPU path: nothing is lost, all numbers are finite, and nothing is inside a body.
fn every_scene_runs() {
    for file in scene_files() {
        let world = scene::from_file(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let mut solver = Backend::Cpu.solver(&world);
        assert_sound(&after(&mut *solver, 40));
        let deepest = depth(&world, &mut *solver) / world.domain.cell_size;
        assert!(deepest < 0.1, "{}: {deepest} cells deep", file.display());
        assert_eq!(report(&mut *solver).faults.saturated_nodes, 0, "{}", file.display());
    }
}

fn schema_refuses_what_the_reader_refuses() {
    let text = std::fs::read_to_string(root().join("scenes/thesis_basin.json")).expect("the file exists");
    for assignment in [
        "setings.dt=0.01",
        "settings.iterations=1.5",
        "colliders[0].shape.box.half_size=[1,1]",
        "colliders[0].boundary=sticky",
        "spawns[0].fill={\"per_cell\":8,\"spacing\":1}",
        "domain.cell_size=wide",
    ] {
        let mut document = serde_json::from_str(&text).expect("JSON");
        scene::apply_override(&mut document, assignment).expect("the path exists");
        assert!(!validator().is_valid(&document), "{assignment}");
        assert!(scene::from_value(document).is_err(), "{assignment}");
    }
}

fn thesis_scenes_have_the_thesis_size() {
    for (name, particles, cells) in [
        ("thesis_basin", 31_250, [50, 54, 51]),
        ("thesis_pipe", 42_875, [167, 160, 99]),
        ("thesis_free_camera", 27_000, [144, 72, 132]),
    ] {
        let world = scene::from_file(root().join(format!("scenes/{name}.json"))).expect(name);
        assert_eq!(world.particle_count(), Ok(particles), "{name}");
        assert_eq!(world.domain.cells().to_array(), cells, "{name}");
    }
}

/// Complete scenes in the documentation are the code blocks marked `json`.
fn documented_examples_load() {
    let text = std::fs::read_to_string(root().join("docs/scene-format.md")).expect("the file exists");
    let examples: Vec<_> = text.split("```json\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(!examples.is_empty());
    for example in examples {
        scene::from_json(example).and_then(|world| world.particle_count()).unwrap_or_else(|e| panic!("{e}\n{example}"));
    }
}
