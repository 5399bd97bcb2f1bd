//! Triangles and heights from files.

use super::form::Triangles;
use crate::error::{Error, Result};
use crate::files::read_at_most;
use base64::Engine;
use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;
use glam::{DMat4, DVec2, DVec3, Mat4};
use gltf::accessor::{DataType, Dimensions};
use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;

/// The largest file that is read, bytes.
const MAX_FILE_BYTES: u64 = 64 << 20;

fn read(path: &Path) -> Result<Vec<u8>> {
    read_at_most(path, MAX_FILE_BYTES, "mesh")
}

/// The triangles of an OBJ, STL, glTF or GLB file, all objects together.
pub(crate) fn mesh(path: &Path) -> Result<Triangles> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let parse: fn(&[u8]) -> Result<Triangles, String> = match ending.as_str() {
        "obj" => obj,
        "stl" => stl,
        "gltf" | "glb" => gltf,
        _ => |_| Err("no mesh by its ending, which has to be obj, stl, gltf or glb".to_owned()),
    };
    parse(&read(path)?).map_err(|message| Error::content(path, message))
}

fn obj(bytes: &[u8]) -> Result<Triangles, String> {
    // Names and comments may be in any encoding, and lines but comments may go on after a backslash.
    let mut text = String::new();
    let mut goes_on = false;
    for line in String::from_utf8_lossy(bytes).trim_start_matches('\u{feff}').lines() {
        let part = line.strip_suffix('\\').filter(|_| goes_on || !line.trim_start().starts_with('#'));
        goes_on = part.is_some();
        text.push_str(part.unwrap_or(line));
        text.push(if goes_on { ' ' } else { '\n' });
    }
    check_obj_indices(&text)?;
    // Materials are ignored.
    let (models, _) =
        tobj::load_obj_buf(&mut Cursor::new(text), &tobj::LoadOptions::default(), |_| Ok(Default::default()))
            .map_err(|e| format!("no OBJ: {e}"))?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for tobj::Model { mesh, .. } in models {
        let first = vertices.len() as u32;
        vertices.extend(mesh.positions.as_chunks::<3>().0.iter().map(|v| DVec3::from_array(v.map(f64::from))));
        let indices: Vec<_> = mesh.indices.iter().map(|i| first.saturating_add(*i)).collect();
        // Without arities all faces are triangles.
        let all_three = if mesh.face_arities.is_empty() { indices.len() / 3 } else { 0 };
        let mut rest = &indices[..];
        for arity in mesh.face_arities.iter().copied().chain(std::iter::repeat_n(3, all_three)) {
            let (polygon, others) = rest.split_at((arity as usize).min(rest.len()));
            cut_up(&vertices, polygon, &mut triangles);
            if triangles.len() > super::MAX_TRIANGLES {
                return Err("the OBJ has more than 2^20 triangles".to_owned());
            }
            rest = others;
        }
    }
    Ok((vertices, triangles))
}

/// Polygons of more corners become fans: no file may occupy its reader for long.
const MOST_CORNERS: usize = 1 << 12;

/// Cuts a polygon into triangles within it. The fan of one that is not convex would reach beyond it, and matter would
/// meet a film there.
fn cut_up(vertices: &[DVec3], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) {
    let fan = (2..polygon.len()).map(|i| [polygon[0], polygon[i - 1], polygon[i]]);
    if !(4..=MOST_CORNERS).contains(&polygon.len()) {
        return triangles.extend(fan);
    }
    let at = |corner: &u32| vertices.get(*corner as usize).copied().unwrap_or(DVec3::NAN).to_array();
    let ring: Vec<_> = polygon.iter().map(at).collect();
    let mut flat = Vec::new();
    if !ring.as_flattened().iter().all(|x| x.is_finite()) || !project3d_to_2d(&ring, ring.len(), &mut flat) {
        return triangles.extend(fan);
    }
    let mut cut: Vec<u32> = Vec::new();
    Earcut::new().earcut_slice(&flat, &[], &mut cut);
    let cut = cut.as_chunks().0;
    // The plane is seen from the polygon's front; the triangles need not be.
    let area = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| DVec2::from_array(flat[i as usize]));
        (b - a).perp_dot(c - a)
    };
    let turned = cut.iter().map(area).sum::<f64>() < 0.0;
    triangles.extend(cut.iter().map(|corners| {
        let [a, b, c] = corners.map(|i| polygon[i as usize]);
        if turned { [a, c, b] } else { [a, b, c] }
    }));
}

/// Refuses indices that the reader would compute with before it checks that such a vertex exists.
fn check_obj_indices(text: &str) -> Result<(), String> {
    let mut counts = [0i64; 3];
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => counts[0] += 1,
            Some("vt") => counts[1] += 1,
            Some("vn") => counts[2] += 1,
            Some("f" | "l" | "p") => {
                for (index, count) in words.flat_map(|word| word.split('/').zip(counts)) {
                    // Negative indices count backwards; others may refer to later vertices.
                    if index.parse().is_ok_and(|n: i64| n < -count || n > MAX_FILE_BYTES as i64) {
                        return Err(format!("no OBJ: there is nothing with the index {index}"));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}

fn stl(bytes: &[u8]) -> Result<Triangles, String> {
    let mesh = stl_io::read_stl(&mut Cursor::new(recognisable(bytes))).map_err(|e| format!("no STL: {e}"))?;
    let vertices = mesh.vertices.iter().map(|v| DVec3::from_array(v.0.map(f64::from))).collect();
    Ok((vertices, mesh.faces.iter().map(|face| face.vertices.map(|i| i as u32)).collect()))
}

/// An STL that the reader does not take for the other kind: it goes by the first line, but binary files may begin with
/// `solid`, and those in text with a mark or a blank line; their names may be missing or in any encoding. It would read
/// the first of several solids only.
fn recognisable(bytes: &[u8]) -> Cow<'_, [u8]> {
    let count = bytes.get(80..84).map_or(0, |b| u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    if bytes.len() as u64 == 84 + 50 * count {
        return [&[0; 80], &bytes[80..]].concat().into();
    }
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    match text.split_once('\n') {
        Some((first, rest)) if first.starts_with("solid") && !text.contains('\0') => {
            let bounds = |line: &&str| ["solid", "endsolid"].iter().any(|word| line.trim_start().starts_with(word));
            let facets: Vec<_> = rest.lines().filter(|line| !bounds(line)).collect();
            format!("solid of a file\n{}\nendsolid of a file\n", facets.join("\n")).into_bytes().into()
        }
        _ => bytes.into(),
    }
}

/// The triangles of the nodes of the default scene, or of the first scene. The file must contain its data.
fn gltf(bytes: &[u8]) -> Result<Triangles, String> {
    if bytes.starts_with(b"glTF") {
        let length = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
        length.filter(|n| (12..=bytes.len()).contains(n)).ok_or("no GLB: it is shorter than it says")?;
    }
    let read = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| format!("no glTF: {e}"))?;
    let (root, blob) = (read.document.into_json(), read.blob);
    // The reader's own validation uses these numbers as indices before it has checked them.
    let mut used = root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|p| p.attributes.values());
    if used.any(|accessor| accessor.value() >= root.accessors.len()) {
        return Err("no glTF: a mesh uses an accessor that is not there".to_owned());
    }
    let document = gltf::Document::from_json(root).map_err(|e| format!("no glTF: {e}"))?;
    let buffers = document.buffers().map(|buffer| buffer_data(&buffer, blob.as_deref()));
    let buffers = buffers.collect::<Result<Vec<_>, _>>()?;
    let scene = document.default_scene().or_else(|| document.scenes().next()).ok_or("no scene in the glTF")?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let mut open: Vec<_> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    let mut visits = document.nodes().count();
    while let Some((node, parent)) = open.pop() {
        // Nodes form a tree, or the file is broken.
        visits = visits.checked_sub(1).ok_or("the glTF's nodes form a circle")?;
        let to_scene = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        open.extend(node.children().map(|child| (child, to_scene)));
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            if primitive.mode() != gltf::mesh::Mode::Triangles {
                return Err("the glTF has a mesh of something else than separate triangles".to_owned());
            }
            let first = vertices.len() as u32;
            let positions = primitive.get(&gltf::Semantic::Positions).ok_or("the glTF has a mesh without positions")?;
            if (positions.data_type(), positions.dimensions()) != (DataType::F32, Dimensions::Vec3) {
                return Err("the glTF has positions that are not three floats".to_owned());
            }
            elements::<12>(&positions, &buffers, |b| {
                let number = |i: usize| f64::from(f32::from_le_bytes([b[i], b[i + 1], b[i + 2], b[i + 3]]));
                vertices.push(to_scene.transform_point3(DVec3::new(number(0), number(4), number(8))));
            })?;
            let mut indices: Vec<u32> = Vec::new();
            match primitive.indices() {
                None => indices.extend(0..vertices.len() as u32 - first),
                Some(of) if of.dimensions() != Dimensions::Scalar => return Err("the glTF has odd indices".to_owned()),
                Some(of) => match of.data_type() {
                    DataType::U8 => elements::<1>(&of, &buffers, |b| indices.push(b[0].into()))?,
                    DataType::U16 => elements::<2>(&of, &buffers, |b| indices.push(u16::from_le_bytes(*b).into()))?,
                    DataType::U32 => elements::<4>(&of, &buffers, |b| indices.push(u32::from_le_bytes(*b)))?,
                    _ => return Err("the glTF has odd indices".to_owned()),
                },
            }
            // The triangles of a mirrored node have the opposite orientation.
            let order = if to_scene.determinant() < 0.0 { [0, 2, 1] } else { [0, 1, 2] };
            let corners = indices.chunks_exact(3).map(|t| order.map(|i| first.saturating_add(t[i])));
            triangles.extend(corners);
            if triangles.len() > super::MAX_TRIANGLES || vertices.len() > 3 * super::MAX_TRIANGLES {
                return Err("the glTF has more than 2^20 triangles".to_owned());
            }
        }
    }
    Ok((vertices, triangles))
}

fn buffer_data<'a>(buffer: &gltf::Buffer<'_>, blob: Option<&'a [u8]>) -> Result<Cow<'a, [u8]>, String> {
    match buffer.source() {
        // The binary part belongs to the first buffer; other buffers without a source are empty.
        gltf::buffer::Source::Bin if buffer.index() > 0 => Ok(Cow::default()),
        gltf::buffer::Source::Bin => Ok(blob.ok_or("the glTF has no binary part")?.into()),
        gltf::buffer::Source::Uri(uri) => {
            let data = uri.strip_prefix("data:").and_then(|rest| rest.split_once(";base64,"));
            let (_, data) = data.ok_or("the glTF has its data in another file: save it as GLB, or embedded")?;
            base64::engine::general_purpose::STANDARD
                .decode(data)
                .map(Cow::Owned)
                .map_err(|e| format!("data of the glTF: {e}"))
        }
    }
}

/// Calls `f` with the bytes of each element of an accessor, of `N` bytes.
fn elements<const N: usize>(
    accessor: &gltf::Accessor<'_>,
    buffers: &[Cow<'_, [u8]>],
    mut f: impl FnMut(&[u8; N]),
) -> Result<(), String> {
    let view = accessor.view().filter(|_| accessor.sparse().is_none()).ok_or("the glTF has sparse data")?;
    let buffer = buffers.get(view.buffer().index()).ok_or("the glTF's data is not there")?;
    let stride = view.stride().unwrap_or(N).max(N);
    for i in 0..accessor.count() {
        let element = i.checked_mul(stride).and_then(|at| at.checked_add(accessor.offset()));
        let inside = element.filter(|at| at.checked_add(N).is_some_and(|end| end <= view.length()));
        let start = inside.and_then(|at| at.checked_add(view.offset()));
        let bytes = start.and_then(|start| buffer.get(start..)).and_then(<[u8]>::first_chunk::<N>);
        f(bytes.ok_or("the glTF has less data than it says")?);
    }
    Ok(())
}

/// The heights of a greyscale PNG, row by row.
pub(crate) fn heights(path: &Path, white: f64) -> Result<Vec<Vec<f64>>> {
    let fail = |message: String| Error::content(path, message);
    let bytes = read(path)?;
    let limits = png::Limits { bytes: 16 << 20 };
    let decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    let mut reader = decoder.read_info().map_err(|e| fail(format!("no PNG: {e}")))?;
    let info = reader.info();
    let (width, height) = (info.width as usize, info.height as usize);
    if width.saturating_mul(height) > super::MAX_TRIANGLES / 4 {
        return Err(fail(format!("{width} x {height} heights, at most 2^18 are allowed")));
    }
    let bytes = match (info.color_type, info.bit_depth) {
        (png::ColorType::Grayscale, png::BitDepth::Eight) => 1,
        (png::ColorType::Grayscale, png::BitDepth::Sixteen) => 2,
        other => return Err(fail(format!("{other:?}, only greyscale of 8 or 16 bits has heights"))),
    };
    let mut pixels = vec![0; width * height * bytes];
    reader.next_frame(&mut pixels).map_err(|e| fail(format!("no PNG: {e}")))?;
    let whole = if bytes == 1 { 255.0 } else { 65535.0 };
    let height = |b: &[u8]| b.iter().fold(0.0, |value, byte| value * 256.0 + f64::from(*byte)) / whole * white;
    Ok(pixels.chunks_exact(width * bytes).map(|row| row.chunks_exact(bytes).map(height).collect()).collect())
}
