//! Files of meshes and heights: their contents are read, and faults are reported.

use crate::backends::Tests;
use crate::meshes::{Triangles, slab, torus};
use crate::shapes::random;
use crate::worlds::DX;
use base64::Engine;
use pbmpm::{Collider, DVec3, Error, Mesh, Region, Shape, World, scene};
use std::path::PathBuf;

pub fn add(tests: &mut Tests) {
    tests.once("mesh_files", "formats_hold_the_same_mesh", formats_hold_the_same_mesh);
    tests.once("mesh_files", "mirrored_parts_are_not_inside_out", mirrored_parts_are_not_inside_out);
    tests.once("mesh_files", "polygons_end_at_their_edges", polygons_end_at_their_edges);
    tests.once("mesh_files", "files_as_programs_write_them", files_as_programs_write_them);
    tests.once("mesh_files", "broken_files_are_refused", broken_files_are_refused);
    tests.once("mesh_files", "cut_files_do_no_harm", cut_files_do_no_harm);
    tests.once("mesh_files", "pictures_are_heights", pictures_are_heights);
    tests.once("mesh_files", "scenes_name_files_in_their_folder", scenes_name_files_in_their_folder);
    tests.once("mesh_files", "bad_meshes_are_refused", bad_meshes_are_refused);
}

/// A folder of a test, removed with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("pbmpm-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder for the test");
        Folder(path)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, bytes).expect("a file for the test");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // Leftovers of a failed test do no harm.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn obj((vertices, triangles): &Triangles) -> String {
    let vertices = vertices.iter().map(|v| format!("v {} {} {}\n", v.x as f32, v.y as f32, v.z as f32));
    // Indices count from 1, or backwards from the end with −1.
    let count = vertices.len() as i64;
    let faces = triangles.iter().enumerate().map(|(i, t)| {
        let [a, b, c] = t.map(|k| if i % 2 == 0 { i64::from(k) + 1 } else { i64::from(k) - count });
        format!("f {a} {b} {c}\n")
    });
    vertices.chain(faces).collect()
}

fn corners((vertices, triangles): &Triangles) -> Vec<[[f32; 3]; 3]> {
    triangles.iter().map(|t| t.map(|i| vertices[i as usize].as_vec3().to_array())).collect()
}

fn stl(mesh: &Triangles) -> Vec<u8> {
    let mut bytes = vec![b'x'; 80];
    bytes.extend((mesh.1.len() as u32).to_le_bytes());
    for triangle in corners(mesh) {
        bytes.extend([[0.0f32; 3]].iter().chain(&triangle).flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii_stl(mesh: &Triangles) -> String {
    let mut text = "solid thing\n".to_owned();
    for triangle in corners(mesh) {
        text += "facet normal 0 0 0\nouter loop\n";
        triangle.iter().for_each(|[x, y, z]| text += &format!("vertex {x} {y} {z}\n"));
        text += "endloop\nendfacet\n";
    }
    text + "endsolid thing\n"
}

/// The JSON of a glTF and its data. The node doubles the mesh, which is stored at half its size.
fn gltf((vertices, triangles): &Triangles, uri: bool) -> (String, Vec<u8>) {
    let mut data: Vec<u8> =
        vertices.iter().flat_map(|v| (*v * 0.5).as_vec3().to_array()).flat_map(f32::to_le_bytes).collect();
    let positions = data.len();
    data.extend(triangles.iter().flatten().flat_map(|i| (*i as u16).to_le_bytes()));
    data.resize(data.len().next_multiple_of(4), 0);
    let encoded = base64::engine::general_purpose::STANDARD.encode(&data);
    let uri = if uri { format!(r#", "uri": "data:application/octet-stream;base64,{encoded}""#) } else { String::new() };
    let (all, indices) = (data.len(), triangles.len() * 6);
    let (lo, hi) = vertices.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let (lo, hi) = ((lo * 0.5).to_array(), (hi * 0.5).to_array());
    let json = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}],
        "nodes": [{{ "children": [1], "scale": [2, 2, 2] }}, {{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "indices": 1 }}] }}],
        "buffers": [{{ "byteLength": {all}{uri} }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": {positions} }},
            {{ "buffer": 0, "byteOffset": {positions}, "byteLength": {indices} }}],
        "accessors": [
            {{ "bufferView": 0, "componentType": 5126, "count": {}, "type": "VEC3", "min": {lo:?}, "max": {hi:?} }},
            {{ "bufferView": 1, "componentType": 5123, "count": {}, "type": "SCALAR" }}] }}"#,
        vertices.len(),
        triangles.len() * 3
    );
    (json, data)
}

fn glb(mesh: &Triangles) -> Vec<u8> {
    let (json, data) = gltf(mesh, false);
    binary(&json, &data)
}

/// A glTF whose first buffer follows the JSON.
fn binary(json: &str, data: &[u8]) -> Vec<u8> {
    let json = format!("{json:width$}", width = json.len().next_multiple_of(4));
    let mut bytes = b"glTF".to_vec();
    let length = 12 + 8 + json.len() + 8 + data.len();
    bytes.extend([2u32, length as u32, json.len() as u32].iter().flat_map(|n| n.to_le_bytes()));
    bytes.extend(b"JSON");
    bytes.extend(json.as_bytes());
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(data);
    bytes
}

fn files(mesh: &Triangles) -> [(&'static str, Vec<u8>); 5] {
    [
        ("mesh.obj", obj(mesh).into_bytes()),
        ("binary.STL", stl(mesh)),
        ("text.stl", ascii_stl(mesh).into_bytes()),
        ("mesh.glb", glb(mesh)),
        ("mesh.gltf", gltf(mesh, true).0.into_bytes()),
    ]
}

fn formats_hold_the_same_mesh() {
    let folder = Folder::new("formats");
    let triangles = torus(3.0, 1.0);
    let here = Mesh::new(triangles.0.iter().map(|v| *v * 3.0).collect(), triangles.1.clone(), DX).expect("a mesh");
    let here = Shape::Mesh(here);
    for (name, bytes) in files(&triangles) {
        let read = Mesh::from_file(folder.write(name, bytes), 3.0, DX).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(read.triangles().len(), triangles.1.len(), "{name}");
        let (read, mut random) = (Shape::Mesh(read), random(80));
        for _ in 0..2000 {
            let p = DVec3::new(random(), random(), random()) * 13.0 * DX;
            let (there, here) = (read.signed_distance(p), here.signed_distance(p));
            assert!((there - here).abs() < 1e-6, "{name} {p}: {there} {here}");
        }
    }
}

/// A box of which one half is the mirror image of the other.
fn mirrored_parts_are_not_inside_out() {
    let folder = Folder::new("mirrored");
    let (vertices, triangles) = slab([1.0; 3]);
    let middle = |t: &[u32; 3]| t.iter().all(|&i| vertices[i as usize].x < 0.0);
    let open = triangles.iter().copied().filter(|t| !middle(t)).collect();
    let half = (vertices.iter().map(|v| *v + DVec3::X * DX).collect(), open);
    let (json, data) = gltf(&half, false);
    let node = r#"{ "children": [1], "scale": [2, 2, 2] }, { "mesh": 0 }"#;
    assert!(json.contains(node));
    let both = r#"{ "children": [1, 2], "scale": [2, 2, 2] }, { "mesh": 0 }, { "mesh": 0, "scale": [-1, 1, 1] }"#;
    let file = folder.write("both.glb", binary(&json.replace(node, both), &data));
    let read = Shape::Mesh(Mesh::from_file(file, 1.0, 0.25 * DX).unwrap_or_else(|e| panic!("{e}")));
    for (x, distance) in [(-2.5, 0.5), (-1.0, -0.5), (0.0, -0.5), (1.0, -0.5), (2.5, 0.5)] {
        // Points whose nearest face is the lower one, or an end.
        let found = read.signed_distance(DVec3::new(x, -0.5, 0.0) * DX) / DX;
        assert!((found - distance).abs() < 1e-3, "at {x}: {found}");
    }
}

/// The ends of an L are polygons that are not convex, whatever their first corner is: in its notch there is nothing.
fn polygons_end_at_their_edges() {
    let folder = Folder::new("polygons");
    let corners = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
    for turn in 0..6 {
        let mut text = String::new();
        for z in [0.0, 1.0] {
            corners.iter().for_each(|[x, y]| text += &format!("v {x} {y} {z}\n"));
        }
        let at = |i: usize| (i + turn) % 6;
        let [mut front, mut back] = ["f".to_owned(), "f".to_owned()];
        for i in 0..6 {
            back += &format!(" {}", at(5 - i) + 1);
            front += &format!(" {}", at(i) + 7);
            text += &format!("f {} {} {} {}\n", i + 1, (i + 1) % 6 + 1, (i + 1) % 6 + 7, i + 7);
        }
        let path = folder.write("l.obj", format!("{text}{front}\n{back}\n"));
        let mesh = Mesh::from_file(&path, 1.0, 0.1).unwrap();
        assert_eq!(mesh.triangles().len(), 20);
        let body = Collider::new(Shape::Mesh(mesh), DVec3::ZERO);
        for (p, expected) in [([1.4, 1.5, 0.0], 0.4), ([1.4, 1.5, 1.0], 0.4), ([0.5, 0.5, 1.2], 0.2)] {
            let found = body.signed_distance(DVec3::from_array(p));
            assert!((found - expected).abs() < 0.02, "{p:?} from corner {turn}: {found}");
        }
    }
}

/// What other readers accept: names in any encoding or none, marks, lines that go on, binary files called solid.
fn files_as_programs_write_them() {
    let folder = Folder::new("odd");
    let mesh = torus(6.0, 2.0);
    let (text, binary) = (ascii_stl(&mesh), stl(&mesh));
    let body = text.split_once('\n').unwrap().1;
    let mut solid = binary.clone();
    solid[..12].copy_from_slice(b"solid torus\n");
    let object = obj(&mesh);
    let expected = mesh.1.len();
    for (name, bytes) in [
        ("a.stl", format!("solid\n{body}").into_bytes()),
        ("b.stl", format!("\u{feff}\r\n{text}").into_bytes()),
        ("c.stl", [b"solid W\xfcrfel\n", body.as_bytes()].concat()),
        ("d.stl", solid),
        ("two.stl", text.replacen("endfacet\n", "endfacet\nendsolid one\nsolid two\n", 1).into_bytes()),
        ("e.obj", format!("\u{feff}{object}").into_bytes()),
        ("f.obj", [b"o W\xfcrfel\n", object.as_bytes()].concat()),
        ("comment.obj", format!("# C:\\models\\\n{object}").into_bytes()),
        ("g.obj", object.replacen("f ", "f \\\n", 1).into_bytes()),
    ] {
        let read = Mesh::from_file(folder.write(name, bytes), 1.0, 0.5 * DX);
        let count = read.as_ref().map(|mesh| mesh.triangles().len());
        assert_eq!(count.map_err(ToString::to_string), Ok(expected), "{name}");
    }
}

/// Each with the message of its reader.
fn broken_files_are_refused() {
    let folder = Folder::new("broken");
    let mesh = slab([1.0; 3]);
    let (json, _) = gltf(&mesh, true);
    let with = |from: &str, to: &str| {
        assert!(json.contains(from), "{from}");
        json.replace(from, to).into_bytes()
    };
    let open = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (name, bytes, words) in [
        ("empty.obj", Vec::new(), "at least one triangle"),
        ("points.obj", b"v 0 0 0\n".to_vec(), "at least one triangle"),
        ("flat.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n".to_vec(), "at least one triangle"),
        ("far.obj", format!("{open}f 1 2 9\n").into_bytes(), "no OBJ"),
        (
            "before.obj",
            format!("{open}f 1/1/-2 2/1/1 3/1/1\n").into_bytes(),
            "no OBJ: there is nothing with the index -2",
        ),
        (
            "huge.obj",
            format!("{open}f 1//9223372036854775807 2 3\n").into_bytes(),
            "no OBJ: there is nothing with the index 9",
        ),
        ("word.obj", b"v 0 zero 0\n".to_vec(), "no OBJ"),
        ("nan.obj", format!("v nan 0 0\n{open}f 1 2 3\n").into_bytes(), "finite"),
        ("open.obj", format!("{open}f 1 2 3\n").into_bytes(), "enclose a volume"),
        ("short.stl", stl(&mesh)[..200].to_vec(), "no STL"),
        ("empty.stl", Vec::new(), "no STL"),
        ("short.glb", glb(&mesh)[..300].to_vec(), "no GLB"),
        ("empty.gltf", Vec::new(), "no glTF"),
        ("circle.gltf", with(r#"{ "mesh": 0 }"#, r#"{ "mesh": 0, "children": [0] }"#), "circle"),
        (
            "second.glb",
            {
                let (json, data) = gltf(&mesh, false);
                let json = json.replace(r#""buffers": ["#, r#""buffers": [{ "byteLength": 8 }, "#);
                binary(&json.replace(r#""buffer": 0"#, r#""buffer": 1"#), &data)
            },
            "less data",
        ),
        ("lines.gltf", with(r#""indices": 1"#, r#""indices": 1, "mode": 1"#), "separate triangles"),
        ("nowhere.gltf", with(r#""POSITION": 0"#, r#""POSITION": 9"#), "not there"),
        ("more.gltf", with(r#""count": 36"#, r#""count": 4000000000"#), "less data"),
        ("elsewhere.gltf", with("data:application/octet-stream;base64,", "../mesh.bin?"), "another file"),
        ("mesh.ply", b"ply\n".to_vec(), "obj, stl, gltf or glb"),
    ] {
        let path = folder.write(name, bytes);
        let error = Mesh::from_file(&path, 1.0, 0.1).err().unwrap_or_else(|| panic!("{name} was read"));
        assert!(error.to_string().contains(words), "{name}: {error}");
    }
    assert!(matches!(Mesh::from_file(folder.0.join("missing.obj"), 1.0, 0.1), Err(Error::Io { .. })));
    for scale in [0.0, -1.0, f64::NAN, 2e6] {
        let error = Mesh::from_file(folder.0.join("large.stl"), scale, 0.1).expect_err("no scale");
        assert!(error.to_string().starts_with("mesh.scale = "), "{error}");
    }
    let large = std::fs::File::create(folder.0.join("large.stl")).expect("a file");
    large.set_len(65 << 20).expect("a sparse file");
    let error = Mesh::from_file(folder.0.join("large.stl"), 1.0, 0.1).expect_err("too large");
    assert!(error.to_string().contains("64 MiB"), "{error}");
}

/// Files cut anywhere or with changed bytes: a mesh or an error.
fn cut_files_do_no_harm() {
    let folder = Folder::new("cut");
    let mut random = random(81);
    for (name, bytes) in files(&slab([1.0; 3])) {
        for i in 0..200 {
            let mut changed = bytes.clone();
            let at = |x: f64, n: usize| ((x + 1.0) * 0.5 * n as f64) as usize;
            if i % 2 == 0 {
                changed.truncate(at(random(), bytes.len()));
            }
            for _ in 0..i % 4 {
                let n = changed.len();
                if let Some(byte) = changed.get_mut(at(random(), n)) {
                    *byte = at(random(), 256) as u8;
                }
            }
            match Mesh::from_file(folder.write(name, changed), 1.0, 0.5 * DX) {
                Ok(mesh) => assert!(!mesh.triangles().is_empty()),
                Err(e) => assert!(matches!(e, Error::Io { .. } | Error::Invalid { .. }), "{name}: {e}"),
            }
        }
    }
}

fn png(size: [u32; 2], color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().and_then(|mut w| w.write_image_data(data)).expect("a picture");
    bytes
}

fn pictures_are_heights() {
    use png::{BitDepth, ColorType};
    let folder = Folder::new("pictures");
    // A ramp along x, from black to white.
    let eight: Vec<u8> = (0..3).flat_map(|_| (0..6).map(|x| x * 51)).collect();
    let sixteen: Vec<u8> = (0..3).flat_map(|_| (0..6u16).flat_map(|x| (x * 13107).to_be_bytes())).collect();
    folder.write("eight.png", png([6, 3], ColorType::Grayscale, BitDepth::Eight, &eight));
    folder.write("sixteen.png", png([6, 3], ColorType::Grayscale, BitDepth::Sixteen, &sixteen));
    folder.write("color.png", png([1, 1], ColorType::Rgb, BitDepth::Eight, &[0; 3]));
    folder.write("wide.png", png([1 << 17, 3], ColorType::Grayscale, BitDepth::Eight, &vec![0; 3 << 17]));
    folder.write("none.png", b"no picture");
    let read = |file: &str| {
        let shape =
            format!(r#"{{ "heightfield": {{ "file": "{file}", "white": 0.5, "spacing": 0.2, "depth": 0.2 }} }}"#);
        scene::from_json_in(&with_shape(&shape), &folder.0).map(|world| world.colliders[0].shape.clone())
    };
    for file in ["eight.png", "sixteen.png"] {
        let shape = read(file).unwrap_or_else(|e| panic!("{file}: {e}"));
        for i in 0..9 {
            let x = 0.1 * f64::from(i) - 0.4;
            // Half the height in the middle, and the slope of the ramp.
            let above = shape.signed_distance(DVec3::new(x, 0.5, 0.0));
            let exact = (0.5 - (0.25 + 0.5 * x)) / 1.25f64.sqrt();
            assert!((above - exact).abs() < 0.03, "{file} {x}: {above} {exact}");
        }
        assert!(shape.signed_distance(DVec3::new(0.0, -0.1, 0.0)) < 0.0);
        assert!(shape.signed_distance(DVec3::new(0.0, -0.3, 0.0)) > 0.05);
    }
    for (file, words) in [("color.png", "greyscale"), ("wide.png", "2^18"), ("none.png", "no PNG")] {
        let error = read(file).expect_err(file);
        let told = error.to_string();
        assert!(matches!(error, Error::Scene { .. }) && told.contains(words) && told.contains(file), "{told}");
    }
}

/// A scene with a body of this shape.
fn with_shape(shape: &str) -> String {
    format!(
        r#"{{ "domain": {{ "min": [0, 0, 0], "max": [1, 1, 1], "cell_size": 0.1 }}, "materials": [],
        "colliders": [{{ "shape": {shape}, "position": [0.5, 0.5, 0.5] }}] }}"#
    )
}

fn scenes_name_files_in_their_folder() {
    let folder = Folder::new("scene");
    std::fs::create_dir_all(folder.0.join("inner/meshes")).expect("folders");
    let text = obj(&slab([10.0, 5.0, 2.0]));
    folder.write("outside.obj", &text);
    folder.write("inner/beside.obj", &text);
    folder.write("inner/meshes/below.obj", &text);
    let read = |file: &str| -> Result<World, Error> {
        let text = with_shape(&format!(r#"{{ "mesh": {{ "file": "{file}" }} }}"#));
        scene::from_file(folder.write("inner/scene.json", text))
    };
    for file in ["beside.obj", "./beside.obj", "meshes/below.obj", "meshes/../beside.obj"] {
        let world = read(file).unwrap_or_else(|e| panic!("{file}: {e}"));
        let Shape::Mesh(mesh) = &world.colliders[0].shape else { panic!("no mesh") };
        // Half a cell, or a fourth of the thinnest edge, 4 cells of 0.02.
        assert!((mesh.grid_spacing().unwrap() - 0.02).abs() < 1e-6, "{:?}", mesh.grid_spacing());
        let again = scene::from_json_in(&scene::to_json(&world), &folder.0.join("inner"));
        assert_eq!(again.as_ref(), Ok(&world), "{file}");
    }
    #[cfg(unix)]
    std::os::unix::fs::symlink(folder.0.join("outside.obj"), folder.0.join("inner/link.obj")).expect("a link");
    let absolute = folder.0.join("inner/beside.obj").display().to_string();
    for file in ["../outside.obj", "meshes/../../outside.obj", &absolute, ".", "", "link.obj"] {
        if cfg!(not(unix)) && file == "link.obj" {
            continue;
        }
        let error = read(file).expect_err(file);
        assert!(
            matches!(&error, Error::Invalid { field, .. } if field == "colliders[0].shape.mesh.file"),
            "{file}: {error}"
        );
        assert!(error.to_string().contains("does not leave it"), "{error}");
    }
    let missing = read("missing.obj").expect_err("no such file");
    assert!(matches!(&missing, Error::Scene { path, .. } if path == "colliders[0].shape.mesh.file"), "{missing}");
    assert!(missing.to_string().contains("missing.obj"), "{missing}");
    let error = scene::from_json(&with_shape(r#"{ "mesh": { "file": "beside.obj" } }"#)).expect_err("no folder");
    assert!(error.to_string().contains("read from a file"), "{error}");
}

/// Meshes that are spelt out in a scene, or by a program.
fn bad_meshes_are_refused() {
    let triangles = "[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]";
    let vertices = "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]";
    let tetrahedron = vertices;
    let mesh = |vertices: &str, triangles: &str, more: &str| {
        format!(r#"{{ "mesh": {{ "vertices": {vertices}, "triangles": {triangles}{more} }} }}"#)
    };
    let world = scene::from_json(&with_shape(&mesh(vertices, triangles, ""))).expect("a good one");
    assert_eq!(scene::from_json(&scene::to_json(&world)), Ok(world));
    let field = |more: &str| format!(r#"{{ "heightfield": {{ "spacing": 0.1{more} }} }}"#);
    let good = r#", "heights": [[0, 0.1], [0, 0.1]]"#;
    scene::from_json(&with_shape(&field(good))).expect("a good one");
    for (shape, at) in [
        (mesh(vertices, "[]", ""), "mesh.triangles"),
        (mesh(vertices, "[[0, 1, 4]]", ""), "mesh.triangles[0]"),
        (mesh("[[0, 0, 0], [1, 0, 0], [0, 1e7, 0]]", "[[0, 1, 2]]", ""), "mesh.vertices"),
        (mesh(vertices, "[[0, 1, 2]]", ""), "mesh.grid_spacing"),
        (mesh(vertices, triangles, r#", "grid_spacing": 0"#), "mesh.grid_spacing"),
        (mesh(vertices, triangles, r#", "grid_spacing": 1e-4"#), "mesh.grid_spacing"),
        (mesh(vertices, triangles, r#", "grid_spacing": 1e-300"#), "mesh.grid_spacing"),
        (mesh(vertices, triangles, r#", "scale": -1"#), "mesh.scale"),
        (mesh(vertices, triangles, r#", "file": "rock.obj""#), "mesh.file"),
        (r#"{ "mesh": {} }"#.to_owned(), "mesh.triangles"),
        (field(""), "heightfield.heights"),
        (field(r#", "heights": [[0, 1]]"#), "heightfield.heights"),
        (field(r#", "heights": [[0, 1], [0]]"#), "heightfield.heights[1]"),
        (field(r#", "heights": [[0, 1], [0, 1e7]]"#), "heightfield.heights[1][1]"),
        (field(&format!(r#"{good}, "depth": 0"#)), "heightfield.depth"),
        (field(&format!(r#"{good}, "white": -1"#)), "heightfield.white"),
        (field(&format!(r#"{good}, "white": 2"#)), "heightfield.white"),
        (field(&format!(r#"{good}, "grid_spacing": 5"#)), "heightfield.grid_spacing"),
        (field(&format!(r#"{good}, "file": "a.png""#)), "heightfield.file"),
    ] {
        let error = scene::from_json(&with_shape(&shape)).err().unwrap_or_else(|| panic!("{shape} was read"));
        let path = format!("colliders[0].shape.{at}");
        assert!(matches!(&error, Error::Invalid { field, .. } if *field == path), "{shape}: {error}");
    }
    // A tangle of triangles scattered everywhere.
    let mut random = random(82);
    let vertices: Vec<_> = (0..30_000).map(|_| DVec3::new(random(), random(), random())).collect();
    let tangle = (0..10_000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let error = Mesh::new(vertices, tangle, 0.05).expect_err("a tangle");
    assert!(error.to_string().contains("takes too long"), "{error}");
    // Many meshes, each within bounds.
    let bodies: Vec<String> = (0..300)
        .map(|i| {
            let scale = format!(r#", "scale": {}"#, 0.5 + 0.001 * f64::from(i));
            format!(r#"{{ "shape": {}, "position": [0.5, 0.5, 0.5] }}"#, mesh(tetrahedron, triangles, &scale))
        })
        .collect();
    let text =
        with_shape("\"half_space\"").replace(r#""colliders": ["#, &format!(r#""colliders": [{}, "#, bodies.join(", ")));
    let error = scene::from_json(&text).expect_err("too many");
    assert!(error.to_string().contains("256 different meshes"), "{error}");
    // In a program, where sensors and drains may have meshes as well; meshes that are equal but were made separately
    // count separately.
    let shape = || {
        let (vertices, triangles) = slab([1.0; 3]);
        Shape::Mesh(Mesh::new(vertices, triangles, DX).expect("a good one"))
    };
    let mut world = World::new(DVec3::ZERO, DVec3::ONE, 0.05);
    world.colliders.extend((0..200).map(|_| Collider::new(shape(), DVec3::splat(0.5))));
    world.sensors.extend((0..57).map(|_| Region::new(shape(), DVec3::splat(0.5))));
    let error = world.validate().expect_err("too many");
    assert!(matches!(&error, Error::Invalid { field, .. } if field == "sensors[56].shape"), "{error}");
    world.sensors[56] = world.sensors[0].clone();
    assert_eq!(world.validate(), Ok(()));
    for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let (vertices, triangles) = slab([1.0; 3]);
        assert!(matches!(Mesh::new(vertices.clone(), triangles.clone(), bad), Err(Error::Invalid { .. })));
        let mut spoilt = vertices;
        spoilt[3].y = bad * f64::INFINITY;
        assert!(matches!(Mesh::new(spoilt, triangles, 0.1), Err(Error::Invalid { .. })));
    }
}
