//! From triangles to a grid of distances.

use super::bvh::{Bvh, area_vector};
use super::skin::skin;
use crate::cpu::par;
use crate::error::{Check, Result};
use crate::math::distance_grid::DistanceGrid;
use crate::shape::MAX_LENGTH;
use glam::DVec3;
use std::sync::atomic::{AtomicU64, Ordering};

/// The most triangles of a mesh.
pub const MAX_TRIANGLES: usize = 1 << 20;
/// The most points of a shape's distance grid, 16 MiB.
pub const MAX_GRID_POINTS: u64 = 1 << 22;

/// Spacings of the grid around the triangles, so that all faces of the grid lie outside of them.
const MARGIN: f64 = 2.0;
/// Room for rounding in distances, spacings.
const ROUNDING: f32 = 1e-3;
/// Average number of nodes of the tree that may be visited for a point of the grid; common meshes take a few hundred.
const MAX_WORK: u64 = 2048;
/// Largest number of nodes visited for a whole grid, and before that for the skin, about a minute on one core each: no
/// file may occupy its reader for longer.
const MAX_WORK_IN_ALL: u64 = 1 << 31;
/// Default number of spacings across the thinnest edge of the box around the triangles.
const ACROSS: f64 = 4.0;

/// Triangles and the distances from them.
#[derive(Debug, PartialEq)]
pub(crate) struct Solid {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub grid: DistanceGrid,
    /// Half extent of the smallest box around the origin that holds the triangles.
    pub half_extent: DVec3,
}

/// The default spacing of a mesh in a world: half a cell, less where the mesh is thin, but no less than a sixteenth.
pub(crate) fn fitting_spacing(vertices: &[DVec3], triangles: &[[u32; 3]], cell_size: f64) -> f64 {
    // Files may list vertices that no triangle has.
    let corners = triangles.iter().flatten().filter_map(|corner| vertices.get(*corner as usize));
    let (lo, hi) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
    let mut spacing = ((hi - lo).min_element() / ACROSS).clamp(cell_size / 16.0, cell_size / 2.0);
    // A mesh of many cells gets the finest spacing that fits.
    while spacing < MAX_LENGTH && points(counts(lo, hi, spacing)) > MAX_GRID_POINTS {
        spacing *= 1.05;
    }
    spacing
}

/// Points along each axis. The faces of the box around the triangles lie between points, at least a quarter of a
/// spacing from them: if faces went through points, rounding would choose between the faces' normals at an edge.
fn counts(lo: DVec3, hi: DVec3, spacing: f64) -> [u64; 3] {
    ((hi - lo) / spacing).to_array().map(|n| {
        let least = (n + 2.0 * MARGIN).ceil();
        let before = (least - n) * 0.5;
        let off = (before - before.round()).abs();
        ((if off < 0.25 { least + 1.0 } else { least }) as u64).saturating_add(1)
    })
}

fn points(counts: [u64; 3]) -> u64 {
    counts.iter().fold(1, |product, n| product.saturating_mul(*n))
}

impl Solid {
    /// Checks the triangles and computes the distances. `check` is positioned at the shape.
    pub fn new(check: &Check<'_>, vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>, spacing: f64) -> Result<Self> {
        let count = triangles.len();
        check.that(count <= MAX_TRIANGLES, "triangles", count, "at most 2^20 triangles")?;
        for vertex in &vertices {
            check.vector("vertices", *vertex, MAX_LENGTH, "finite, at most 1e6 m")?;
        }
        let unknown = triangles.iter().position(|t| t.iter().any(|i| *i as usize >= vertices.len()));
        let allowed = format!("indices below the number of vertices, {}", vertices.len());
        if let Some(i) = unknown {
            check.that(false, &format!("triangles[{i}]"), triangles[i], &allowed)?;
        }
        check.range("grid_spacing", spacing, f64::MIN_POSITIVE, MAX_LENGTH, "above 0, at most 1e6 m")?;
        let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(|i| vertices[i as usize])).collect();
        let corners: Vec<_> = corners.into_iter().filter(|t| area_vector(t).length() > 0.0).collect();
        check.that(!corners.is_empty(), "triangles", count, "at least one triangle with an area")?;

        let tree = Bvh::new(corners.clone());
        let (lo, hi) = tree.bounds();
        let counts = counts(lo, hi, spacing);
        let allowed = "large enough for at most 2^22 points in the box around the mesh";
        check.that(points(counts) <= MAX_GRID_POINTS, "grid_spacing", spacing, allowed)?;
        let counts = counts.map(|n| n as u32);
        let size = DVec3::from_array(counts.map(|n| f64::from(n - 1))) * spacing;
        let first = (lo + hi - size) * 0.5;
        let skin = skin(&tree, &corners, spacing, MAX_WORK_IN_ALL).filter(|skin| !skin.is_empty());
        let values = skin.and_then(|skin| {
            // In most meshes all triangles belong to the skin.
            let bare = (skin != corners).then(|| Bvh::new(skin));
            distances(&tree, bare.as_ref().unwrap_or(&tree), first, spacing, counts)
        });
        let allowed = "spread out: they overlap so much that to measure distances from them takes too long";
        check.that(values.is_some(), "triangles", count, allowed)?;
        let mut values = values.unwrap_or_default();
        close_holes(&mut values, counts);
        tilt_ridges(&mut values, counts);
        let allowed = "small enough for points inside of the mesh, which has to enclose a volume";
        check.that(values.iter().any(|d| *d < 0.0), "grid_spacing", spacing, allowed)?;
        let grid = DistanceGrid { lo: first, spacing, counts, extent: (hi - lo) * 0.5, values: values.into() };
        Ok(Solid { vertices, triangles, grid, half_extent: hi.abs().max(lo.abs()) })
    }
}

/// Offset from a grid point at which the winding number is evaluated, in spacings: on a face where parts abut it is
/// undefined.
const BESIDE: DVec3 = DVec3::new(1.1e-6, 0.7e-6, 1.3e-6);

/// The distance from the skin at each point, in spacings, negative where the absolute winding number exceeds one half.
/// `None` if it takes too much work.
fn distances(mesh: &Bvh, skin: &Bvh, first: DVec3, spacing: f64, counts: [u32; 3]) -> Option<Vec<f32>> {
    let [nx, ny, nz] = counts;
    let mut values = vec![0.0; (nx * ny * nz) as usize];
    let most = (MAX_WORK * values.len() as u64).min(MAX_WORK_IN_ALL);
    // A sum of integers, which stops the work only where the result is discarded anyway.
    let done = AtomicU64::new(0);
    par::each_chunk(&mut values, nx as usize, |row, values| {
        let (y, z) = (row as u32 % ny, row as u32 / ny);
        let mut known = f64::INFINITY;
        let mut work = 0;
        for (x, value) in (0..).zip(values) {
            if done.load(Ordering::Relaxed) + work > most {
                break;
            }
            let p = first + DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * spacing;
            // From one point to the next the distance grows by at most the spacing.
            let distance = skin.distance(p, known, &mut work);
            known = (distance + spacing) * (1.0 + 1e-9);
            let outermost = [(x, nx), (y, ny), (z, nz)].iter().any(|(i, n)| *i == 0 || i + 1 == *n);
            let inside = !outermost && mesh.winding_number(p + BESIDE * spacing, &mut work).abs() > 0.5;
            *value = (if inside { -distance } else { distance } / spacing) as f32;
        }
        done.fetch_add(work, Ordering::Relaxed);
    });
    (done.into_inner() <= most).then_some(values)
}

/// Tilt of a level ridge, in spacings.
const TILT: f32 = 0.02;

/// Where two neighbours are equally deep between two that are less deep, as in the middle of a wall, the distances do
/// not tell which way is out: they change as little across the wall as along it. The second one is made a little less
/// deep.
fn tilt_ridges(values: &mut [f32], counts: [u32; 3]) {
    let [nx, ny, nz] = counts.map(|n| n as usize);
    let mut tilted = values.to_vec();
    for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
        for i in 0..values.len() {
            let at = [i % nx, i / nx % ny, i / (nx * ny)][axis];
            if at == 0 || at + 2 >= [nx, ny, nz][axis] {
                continue;
            }
            let [before, first, second, behind] = [i - stride, i, i + stride, i + 2 * stride].map(|i| values[i]);
            let level = (second - first).abs() < TILT && second.max(first) < 0.0;
            if level && (before - first).min(behind - second) > 0.5 {
                tilted[i + stride] = (second + TILT).min(0.5 * second);
            }
        }
    }
    values.copy_from_slice(&tilted);
}

/// Where inside and outside meet in a hole, far from any triangle, distances are reduced to zero there, so that
/// neighbours nowhere differ by more than the distance between them. Closed meshes remain unchanged.
fn close_holes(values: &mut [f32], counts: [u32; 3]) {
    let [nx, ny, nz] = counts.map(|n| n as usize);
    let strides = [1, nx, nx * ny];
    let coordinates = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
    let mut found = false;
    for i in 0..values.len() {
        for axis in (0..3).filter(|axis| coordinates(i)[*axis] > 0) {
            let (a, b) = (values[i - strides[axis]], values[i]);
            if (a < 0.0) != (b < 0.0) && a.abs() + b.abs() > 1.0 + ROUNDING {
                values[i - strides[axis]] = a.clamp(-0.5, 0.5);
                values[i] = b.clamp(-0.5, 0.5);
                found = true;
            }
        }
    }
    // Back and forth until nothing changes; each change is at least the rounding margin, so that this terminates.
    while found {
        found = false;
        for backward in [false, true] {
            for k in 0..values.len() {
                let i = if backward { values.len() - 1 - k } else { k };
                let at = coordinates(i);
                for axis in 0..3 {
                    let neighbour = match backward {
                        false if at[axis] > 0 => i - strides[axis],
                        true if at[axis] + 1 < [nx, ny, nz][axis] => i + strides[axis],
                        _ => continue,
                    };
                    let most = values[neighbour].abs() + 1.0;
                    if (values[i] < 0.0) == (values[neighbour] < 0.0) && values[i].abs() > most + ROUNDING {
                        values[i] = most.copysign(values[i]);
                        found = true;
                    }
                }
            }
        }
    }
}
