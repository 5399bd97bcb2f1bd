//! Shapes made of triangles: meshes and heightfields.

mod bvh;
mod form;
#[cfg(feature = "mesh")]
mod load;
mod patch;
mod skin;
mod solid;

pub use form::{HeightfieldForm, MeshForm};
pub use solid::{MAX_GRID_POINTS, MAX_TRIANGLES};

use crate::error::{Check, Result};
use crate::math::distance_grid::DistanceGrid;
use glam::DVec3;
use solid::{Solid, fitting_spacing};
use std::path::Path;
use std::sync::Arc;

/// A solid bounded by triangles, which need be neither convex nor quite closed.
///
/// A point is inside where the winding number of the triangles exceeds one half, so that small holes and doubled faces
/// do no harm, and parts may overlap: faces buried in other parts bound nothing. Solvers represent it by a grid of
/// distances from the triangles, exact at the grid's points and interpolated between them: edges are rounded by about
/// the grid's spacing, and parts thinner than two spacings may be missed. Copies share triangles and grid.
#[derive(Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(from = "MeshForm", into = "MeshForm"))]
pub struct Mesh {
    form: Arc<MeshForm>,
    solid: Option<Arc<Solid>>,
}

impl Mesh {
    /// From corners (m) and triples of their indices, which run anticlockwise seen from outside (all of them clockwise
    /// works as well). `grid_spacing` is that of the distance grid, m: half a cell is fine enough where no part is
    /// thinner than a cell, and a fourth of the thinnest part otherwise.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for coordinates that are not finite or above 1e6 m, indices of no
    /// vertex, no triangle with an area or more than [`MAX_TRIANGLES`], a grid of more than [`MAX_GRID_POINTS`], and a
    /// mesh without a grid point inside.
    pub fn new(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>, grid_spacing: f64) -> Result<Self> {
        let form = MeshForm { vertices, triangles, grid_spacing: Some(grid_spacing), ..MeshForm::default() };
        let mut mesh = Mesh::from(form);
        mesh.build("mesh", None, grid_spacing)?;
        Ok(mesh)
    }

    /// From an OBJ, STL, glTF or GLB file, recognised by its extension, of at most 64 MiB. Coordinates are multiplied
    /// by `scale`; see [`Mesh::new`] for the rest.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) for a file that cannot be read or is not of the format that its extension says;
    /// [`Error::Invalid`](crate::Error::Invalid) for a scale that is not above 0 or above 1e6; otherwise as
    /// [`Mesh::new`].
    #[cfg(feature = "mesh")]
    pub fn from_file(path: impl AsRef<Path>, scale: f64, grid_spacing: f64) -> Result<Self> {
        form::check_scale(&Check { path: "mesh" }, scale)?;
        let (vertices, triangles) = load::mesh(path.as_ref())?;
        let vertices = vertices.into_iter().map(|v| v * scale).collect();
        Mesh::new(vertices, triangles, grid_spacing)
    }
}

/// Ground with a height for each point of a rectangular grid, solid down to some depth below its lowest point.
///
/// Its own frame has the rectangle's middle at x = z = 0 and height 0 at y = 0. Between its points it consists of
/// triangles; see [`Mesh`] for how solvers represent it.
#[derive(Clone, PartialEq)]
#[cfg_attr(feature = "scene", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "scene", serde(from = "HeightfieldForm", into = "HeightfieldForm"))]
pub struct Heightfield {
    form: Arc<HeightfieldForm>,
    solid: Option<Arc<Solid>>,
}

impl Heightfield {
    /// From heights (m): a row for each z from the smallest on, in it a height for each x from the smallest on, at
    /// least two of both, `spacing` m apart. The ground reaches `depth` m below the lowest of them. `grid_spacing` as
    /// for [`Mesh::new`].
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for too few rows or rows of different lengths, and for numbers that
    /// are not finite or out of range; otherwise as [`Mesh::new`].
    pub fn new(heights: Vec<Vec<f64>>, spacing: f64, depth: f64, grid_spacing: f64) -> Result<Self> {
        let mut field = Heightfield::from(HeightfieldForm {
            heights,
            spacing,
            depth: Some(depth),
            grid_spacing: Some(grid_spacing),
            ..HeightfieldForm::default()
        });
        field.build("heightfield", None, grid_spacing)?;
        Ok(field)
    }
}

macro_rules! of_triangles {
    ($name:ident, $form:ident) => {
        impl $name {
            /// The corners of the triangles in the shape's own frame, m.
            pub fn vertices(&self) -> &[DVec3] {
                self.solid.as_ref().map_or(&[], |solid| &solid.vertices)
            }

            /// Triples of indices into [`vertices`](Self::vertices).
            pub fn triangles(&self) -> &[[u32; 3]] {
                self.solid.as_ref().map_or(&[], |solid| &solid.triangles)
            }

            /// Spacing of the distance grid, m; `None` for a shape whose file has not been read yet.
            pub fn grid_spacing(&self) -> Option<f64> {
                self.grid().map(|grid| grid.spacing)
            }

            /// Reads the files that a scene names, and builds the distance grid.
            pub(crate) fn build(&mut self, path: &str, folder: Option<&Path>, cell_size: f64) -> Result<()> {
                if self.solid.is_none() {
                    let check = Check { path };
                    let (vertices, triangles) = self.form.triangles(&check, folder)?;
                    let spacing =
                        self.form.grid_spacing.unwrap_or_else(|| fitting_spacing(&vertices, &triangles, cell_size));
                    self.solid = Some(Arc::new(Solid::new(&check, vertices, triangles, spacing)?));
                }
                Ok(())
            }

            pub(crate) fn validate(&self, path: &str) -> Result<()> {
                Check { path }.that(self.solid.is_some(), "file", &self.form.file, "read by `scene::from_file`")
            }

            /// Whether a scene states both in the same way.
            #[cfg(feature = "snapshot")]
            pub(crate) fn is_stated_as(&self, other: &Self) -> bool {
                self.form == other.form
            }

            pub(crate) fn grid(&self) -> Option<&DistanceGrid> {
                self.solid.as_ref().map(|solid| &solid.grid)
            }

            /// Every point is outside of a shape that has not been read.
            pub(crate) fn signed_distance(&self, p: DVec3) -> f64 {
                self.grid().map_or(f64::INFINITY, |grid| grid.distance_normal::<f64>(p.to_array()).0)
            }

            pub(crate) fn half_extent(&self) -> DVec3 {
                self.solid.as_ref().map_or(DVec3::ZERO, |solid| solid.half_extent)
            }
        }

        impl From<$form> for $name {
            fn from(form: $form) -> Self {
                $name { form: Arc::new(form), solid: None }
            }
        }

        impl From<$name> for $form {
            fn from(shape: $name) -> Self {
                (*shape.form).clone()
            }
        }

        /// Without the numbers, of which there may be millions.
        impl std::fmt::Debug for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.debug_struct(stringify!($name))
                    .field("file", &self.form.file)
                    .field("triangles", &self.triangles().len())
                    .field("grid_spacing", &self.grid_spacing())
                    .finish()
            }
        }

        #[cfg(feature = "scene")]
        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                $form::json_schema(generator)
            }
        }
    };
}
of_triangles!(Mesh, MeshForm);
of_triangles!(Heightfield, HeightfieldForm);
