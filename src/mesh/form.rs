//! Meshes and heightfields as a scene states them.

use crate::error::{Check, Error, Result};
use crate::shape::MAX_LENGTH;
use glam::DVec3;
use std::path::{Component, Path, PathBuf};

/// Corners, and triples of their indices.
pub(crate) type Triangles = (Vec<DVec3>, Vec<[u32; 3]>);

/// A mesh as stated in a scene file: a file, or vertices and triangles.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct MeshForm {
    /// An OBJ, STL, glTF or GLB file in the scene's folder or below.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub file: Option<String>,
    /// Corners, m, instead of a file.
    #[cfg_attr(feature = "scene", schemars(with = "Vec<[f64; 3]>"), serde(skip_serializing_if = "Vec::is_empty"))]
    pub vertices: Vec<DVec3>,
    /// Triples of corner indices, anticlockwise as seen from outside.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Vec::is_empty"))]
    pub triangles: Vec<[u32; 3]>,
    /// Factor applied to all coordinates. Default 1.
    pub scale: f64,
    /// Spacing of the distance grid, m. Default: half a cell, less for a thin mesh.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub grid_spacing: Option<f64>,
}

impl Default for MeshForm {
    fn default() -> Self {
        MeshForm { file: None, vertices: Vec::new(), triangles: Vec::new(), scale: 1.0, grid_spacing: None }
    }
}

/// Checks the factor by which coordinates are multiplied.
pub(crate) fn check_scale(check: &Check<'_>, scale: f64) -> Result<()> {
    check.range("scale", scale, f64::MIN_POSITIVE, MAX_LENGTH, "above 0, at most 1e6")
}

impl MeshForm {
    pub(crate) fn triangles(&self, check: &Check<'_>, folder: Option<&Path>) -> Result<Triangles> {
        check_scale(check, self.scale)?;
        let either = self.file.is_none() || (self.vertices.is_empty() && self.triangles.is_empty());
        check.that(either, "file", &self.file, "absent where there are `vertices` and `triangles`")?;
        let (vertices, triangles) = match &self.file {
            Some(file) => named(check, file, folder, read_mesh)?,
            None => (self.vertices.clone(), self.triangles.clone()),
        };
        Ok((vertices.into_iter().map(|v| v * self.scale).collect(), triangles))
    }
}

/// A heightfield as stated in a scene file: a picture, or rows of heights.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema))]
#[cfg_attr(feature = "scene", serde(deny_unknown_fields, default))]
pub struct HeightfieldForm {
    /// A greyscale PNG of 8 or 16 bits in the scene's folder or below. Its rows are the rows of heights; black is 0.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub file: Option<String>,
    /// Height of white in the picture, m. Default 1.
    pub white: f64,
    /// Heights, m, instead of a file: one row per z, with one height per x.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Vec::is_empty"))]
    pub heights: Vec<Vec<f64>>,
    /// Distance between neighbouring heights, m. Default 1.
    pub spacing: f64,
    /// How far the ground reaches below the lowest height, m. Default `spacing`.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub depth: Option<f64>,
    /// Spacing of the distance grid, m. Default: half a cell, less for flat ground.
    #[cfg_attr(feature = "scene", serde(skip_serializing_if = "Option::is_none"))]
    pub grid_spacing: Option<f64>,
}

impl Default for HeightfieldForm {
    fn default() -> Self {
        HeightfieldForm { file: None, white: 1.0, heights: Vec::new(), spacing: 1.0, depth: None, grid_spacing: None }
    }
}

impl HeightfieldForm {
    pub(crate) fn triangles(&self, check: &Check<'_>, folder: Option<&Path>) -> Result<Triangles> {
        let length = "above 0, at most 1e6 m";
        check.range("spacing", self.spacing, f64::MIN_POSITIVE, MAX_LENGTH, length)?;
        check.range("depth", self.depth.unwrap_or(self.spacing), f64::MIN_POSITIVE, MAX_LENGTH, length)?;
        check.range("white", self.white, f64::MIN_POSITIVE, MAX_LENGTH, length)?;
        let either = self.file.is_none() || self.heights.is_empty();
        check.that(either, "file", &self.file, "absent where there are `heights`")?;
        let shown = self.file.is_some() || self.white == Self::default().white;
        check.that(shown, "white", self.white, "absent where there are `heights`")?;
        let read;
        let rows = match &self.file {
            Some(file) => {
                read = named(check, file, folder, |path| read_heights(path, self.white))?;
                &read
            }
            None => &self.heights,
        };
        let columns = rows.first().map_or(0, Vec::len);
        check.that(
            rows.len().min(columns) >= 2,
            "heights",
            [rows.len(), columns],
            "at least 2 rows of at least 2 heights",
        )?;
        let odd = rows.iter().position(|row| row.len() != columns);
        if let Some(i) = odd {
            let allowed = format!("{columns} heights, as many as the first row has");
            check.that(false, &format!("heights[{i}]"), [rows[i].len()], &allowed)?;
        }
        let most = super::MAX_TRIANGLES / 4;
        let count = rows.len().saturating_mul(columns);
        check.that(count <= most, "heights", count, "at most 2^18 heights")?;
        let wrong = rows.iter().flatten().position(|h| !(h.is_finite() && h.abs() <= MAX_LENGTH));
        if let Some((row, column)) = wrong.map(|at| (at / columns, at % columns)) {
            let field = format!("heights[{row}][{column}]");
            check.that(false, &field, rows[row][column], "finite, at most 1e6 m")?;
        }
        Ok(ground(rows, self.spacing, self.depth.unwrap_or(self.spacing)))
    }
}

/// The closed surface of a heightfield: its points, the same points at the bottom, and walls around.
fn ground(rows: &[Vec<f64>], spacing: f64, depth: f64) -> Triangles {
    let (nx, nz) = (rows[0].len() as u32, rows.len() as u32);
    let bottom = rows.iter().flatten().fold(f64::INFINITY, |a, b| a.min(*b)) - depth;
    let at = |x: u32, y: f64, z: u32| {
        let from_middle = |i: u32, n: u32| (f64::from(i) - 0.5 * f64::from(n - 1)) * spacing;
        DVec3::new(from_middle(x, nx), y, from_middle(z, nz))
    };
    let each = |f: &dyn Fn(u32, u32) -> DVec3| -> Vec<DVec3> {
        (0..nz).flat_map(|z| (0..nx).map(move |x| (x, z))).map(|(x, z)| f(x, z)).collect()
    };
    let mut vertices = each(&|x, z| at(x, rows[z as usize][x as usize], z));
    vertices.extend(each(&|x, z| at(x, bottom, z)));
    let top = |x: u32, z: u32| z * nx + x;
    let mut triangles = Vec::new();
    let mut quad = |a: u32, b: u32, c: u32, d: u32| triangles.extend([[a, b, c], [a, c, d]]);
    let below = nx * nz;
    for z in 0..nz - 1 {
        for x in 0..nx - 1 {
            let [a, b, c, d] = [top(x, z), top(x, z + 1), top(x + 1, z + 1), top(x + 1, z)];
            quad(a, b, c, d);
            quad(a + below, d + below, c + below, b + below);
        }
    }
    let mut wall = |a: u32, b: u32| quad(a, a + below, b + below, b);
    for x in 0..nx - 1 {
        wall(top(x + 1, 0), top(x, 0));
        wall(top(x, nz - 1), top(x + 1, nz - 1));
    }
    for z in 0..nz - 1 {
        wall(top(0, z), top(0, z + 1));
        wall(top(nx - 1, z + 1), top(nx - 1, z));
    }
    (vertices, triangles)
}

/// What `read` makes of a file that a scene names; what is wrong with the file is said of the field.
fn named<T>(check: &Check<'_>, file: &str, folder: Option<&Path>, read: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    inside(check, file, folder).and_then(|path| read(&path)).map_err(|error| match error {
        Error::Io { message, .. } => {
            let path = folder.unwrap_or(Path::new("")).join(file);
            Error::Scene { path: check.field("file"), message: format!("{}: {message}", path.display()) }
        }
        error => error,
    })
}

/// The path of a file that a scene names, which must not leave the scene's folder.
fn inside(check: &Check<'_>, file: &str, folder: Option<&Path>) -> Result<PathBuf> {
    let allowed = "in a scene that is read from a file, which says in what folder it is";
    let folder = folder.ok_or(()).or_else(|()| check.that(false, "file", file, allowed).map(|()| Path::new("")))?;
    let mut below = 0i32;
    let stays = Path::new(file).components().all(|component| {
        below += match component {
            Component::Normal(_) => 1,
            Component::CurDir => 0,
            Component::ParentDir => -1,
            Component::RootDir | Component::Prefix(_) => return false,
        };
        below >= 0
    });
    let allowed = "a path relative to the scene's folder that does not leave it";
    check.that(stays && below > 0, "file", file, allowed)?;
    let real = |path: &Path| path.canonicalize().map_err(|e| Error::io(path, e));
    // Links may lead out of the folder.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let path = real(&folder.join(file))?;
    check.that(path.starts_with(real(folder)?), "file", file, allowed)?;
    Ok(path)
}

#[cfg(feature = "mesh")]
use super::load::{heights as read_heights, mesh as read_mesh};

#[cfg(not(feature = "mesh"))]
fn read_mesh(path: &Path) -> Result<Triangles> {
    Err(unread(path))
}

#[cfg(not(feature = "mesh"))]
fn read_heights(path: &Path, _white: f64) -> Result<Vec<Vec<f64>>> {
    Err(unread(path))
}

#[cfg(not(feature = "mesh"))]
fn unread(path: &Path) -> Error {
    Error::content(path, "meshes are read with the crate's feature `mesh`")
}
