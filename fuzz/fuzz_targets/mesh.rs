//! Any file is a mesh or a heightfield, or an error with words, whatever its ending says it is.

#![no_main]

use libfuzzer_sys::fuzz_target;
use pbmpm::{Mesh, scene};
use std::path::PathBuf;
use std::sync::LazyLock;

/// A folder of this process, in memory where there is such a thing.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let root = if memory.is_dir() { memory } else { std::env::temp_dir() };
    let folder = root.join(format!("pbmpm-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
});

/// Ground that a picture gives the heights of.
const GROUND: &str = r#"{ "domain": { "min": [0, 0, 0], "max": [8, 8, 8], "cell_size": 1 }, "materials": [],
    "colliders": [{ "position": [4, 1, 4], "shape": { "heightfield": { "file": "it.png", "grid_spacing": 2 } } }] }"#;

fuzz_target!(|bytes: &[u8]| {
    let write = |ending: &str| {
        let path = FOLDER.join(format!("it.{ending}"));
        std::fs::write(&path, bytes).expect("a file");
        path
    };
    if bytes.starts_with(b"\x89PNG") {
        write("png");
        if let Err(error) = scene::from_json_in(GROUND, &FOLDER) {
            assert!(!error.to_string().is_empty());
        }
        return;
    }
    let endings: &[&str] = match bytes.first() {
        Some(b'{' | b'g') => &["gltf"],
        _ => &["obj", "stl"],
    };
    for ending in endings {
        match Mesh::from_file(write(ending), 1.0, 1.0) {
            Ok(mesh) => {
                let corners = mesh.vertices().len() as u32;
                assert!(mesh.triangles().iter().flatten().all(|i| *i < corners));
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
});
