//! Signed distances on a regular grid, interpolated between its points. Twin: `shaders/lib/distance_grid.wgsl`.

use super::linear::{dot, scale};
use super::real::Real;
use glam::DVec3;
use std::sync::Arc;

/// Lower bound of the path length per change of an interpolated distance. Each slope is a mean of differences between
/// neighbours, none of which exceeds 1, so that a distance changes by at most √3 times the path; this is the inverse,
/// rounded down.
pub const REACH: f64 = 0.577;

/// Below this slope there is no direction away from the surface.
const FLAT: f64 = 1e-6;

/// A grid of distances in units of its spacing, so that it can be used in metres and in cells.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceGrid {
    /// The first point.
    pub lo: DVec3,
    /// Distance between neighbours.
    pub spacing: f64,
    /// Points along each axis, at least 2.
    pub counts: [u32; 3],
    /// Half the edges of the box around the body; its middle is that of the grid.
    pub extent: DVec3,
    /// x runs fastest, then y.
    pub values: Arc<[f32]>,
}

impl DistanceGrid {
    /// The same with other units of length.
    pub fn scaled(&self, factor: f64) -> Self {
        DistanceGrid {
            lo: self.lo * factor,
            spacing: self.spacing * factor,
            extent: self.extent * factor,
            ..self.clone()
        }
    }

    /// The middle of the grid.
    pub fn middle(&self) -> DVec3 {
        self.lo + DVec3::from_array(self.counts.map(|n| f64::from(n - 1))) * (0.5 * self.spacing)
    }

    /// Distance (negative inside) and outward unit normal at `p`. For a point outside of the grid's box the distance is
    /// a lower bound from the nearest point of the box: the body lies behind that face of the box.
    pub fn distance_normal<R: Real>(&self, p: [R; 3]) -> (R, [R; 3]) {
        let inverse = R::of(1.0 / self.spacing);
        let (zero, one) = (R::of(0.0), R::of(1.0));
        let last = self.counts.map(|n| n - 1);
        let lo = self.lo.to_array().map(R::of);
        let asked = [0, 1, 2].map(|a| (p[a] - lo[a]) * inverse);
        let inside = [0, 1, 2].map(|a| asked[a].min(R::of(f64::from(last[a]))).max(zero));
        let out = [0, 1, 2].map(|a| asked[a] - inside[a]);
        let cell = [0, 1, 2].map(|a| inside[a].floor_index().min(last[a] - 1));
        let f = [0, 1, 2].map(|a| inside[a] - R::of(f64::from(cell[a])));
        let e = f.map(|f| one - f);
        let row = self.counts[0] as usize;
        let layer = row * self.counts[1] as usize;
        let first = cell[0] as usize + cell[1] as usize * row + cell[2] as usize * layer;
        let at = |offset: usize| R::of(f64::from(self.values[first + offset]));
        let (v000, v100, v010, v110) = (at(0), at(1), at(row), at(row + 1));
        let (v001, v101, v011, v111) = (at(layer), at(layer + 1), at(layer + row), at(layer + row + 1));
        let (x00, x10) = (v000 * e[0] + v100 * f[0], v010 * e[0] + v110 * f[0]);
        let (x01, x11) = (v001 * e[0] + v101 * f[0], v011 * e[0] + v111 * f[0]);
        let (y0, y1) = (x00 * e[1] + x10 * f[1], x01 * e[1] + x11 * f[1]);
        let value = y0 * e[2] + y1 * f[2];
        let near = (v100 - v000) * e[1] + (v110 - v010) * f[1];
        let far = (v101 - v001) * e[1] + (v111 - v011) * f[1];
        let slope = [near * e[2] + far * f[2], (x10 - x00) * e[2] + (x11 - x01) * f[2], y1 - y0];
        let beyond = dot(out, out);
        let (distance, away) = if beyond > zero {
            let across = [0, 1, 2].map(|a| if out[a] == zero { slope[a] * value } else { out[a] });
            ((beyond + value * value).sqrt(), across)
        } else {
            (value, slope)
        };
        let length = dot(away, away).sqrt();
        let normal = if length > R::of(FLAT) { scale(away, one / length) } else { [zero, one, zero] };
        (distance * R::of(self.spacing), normal)
    }
}
