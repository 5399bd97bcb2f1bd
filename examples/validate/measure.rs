//! Small statistics over particles and over time.

use pbmpm::{DVec3, Particle};

/// Volume ratio beyond which a liquid has come apart: the default of `Settings::tension_limit`.
const APART: f64 = 1.1;

/// Mean over the particles, by mass.
pub fn mean(particles: &[Particle], value: impl Fn(&Particle) -> f64) -> f64 {
    let mass: f64 = particles.iter().map(|p| p.mass).sum();
    particles.iter().map(|p| p.mass * value(p)).sum::<f64>() / mass
}

/// Mean vector over the particles, by mass.
pub fn mean_vector(particles: &[Particle], value: impl Fn(&Particle) -> DVec3) -> DVec3 {
    let mass: f64 = particles.iter().map(|p| p.mass).sum();
    particles.iter().map(|p| p.mass * value(p)).sum::<DVec3>() / mass
}

/// J, from the particles' velocities.
pub fn kinetic(particles: &[Particle]) -> f64 {
    particles.iter().map(|p| 0.5 * p.mass * p.velocity.length_squared()).sum()
}

/// J, from velocities and from the motion within each particle that the transfers keep, on cells of `cell_size`.
pub fn kinetic_affine(particles: &[Particle], cell_size: f64) -> f64 {
    let own = |p: &Particle| {
        let g = p.velocity_gradient;
        0.125
            * cell_size
            * cell_size
            * (g.x_axis.length_squared() + g.y_axis.length_squared() + g.z_axis.length_squared())
    };
    particles.iter().map(|p| p.mass * (0.5 * p.velocity.length_squared() + own(p))).sum()
}

/// Angular momentum about the origin, including that of the particles' own affine motion, kg m²/s.
pub fn angular_momentum(particles: &[Particle], cell_size: f64) -> DVec3 {
    let of = |p: &Particle| {
        let g = p.velocity_gradient;
        // A quarter of a cell squared is the second moment of the kernel.
        let own = DVec3::X.cross(g.x_axis) + DVec3::Y.cross(g.y_axis) + DVec3::Z.cross(g.z_axis);
        p.mass * (p.position.cross(p.velocity) + own * (0.25 * cell_size * cell_size))
    };
    particles.iter().map(of).sum()
}

/// Root of the mean square of the volume ratio minus 1, of matter that has not come apart: the ratio of a particle alone
/// on its way goes up to 4.
pub fn volume_noise(particles: &[Particle]) -> f64 {
    let whole = |p: &Particle| f64::from(p.volume_ratio <= APART);
    let square = mean(particles, |p| whole(p) * (p.volume_ratio - 1.0).powi(2));
    (square / mean(particles, whole)).sqrt()
}

/// Share of the cells that hold no particle, in a box from the origin with this many cells along x, y and z, on cells
/// of `cell_size`.
pub fn empty_cells(particles: &[Particle], counts: [usize; 3], cell_size: f64) -> f64 {
    let mut empty = vec![true; counts.iter().product()];
    for p in particles {
        let [x, y, z] = (p.position / cell_size).to_array().map(|x| x as usize);
        if let Some(cell) = empty.get_mut(x + counts[0] * (y + counts[1] * z)) {
            *cell = false;
        }
    }
    empty.iter().filter(|e| **e).count() as f64 / empty.len() as f64
}

/// The value below which the share `q` of the values lies.
pub fn quantile(mut values: Vec<f64>, q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((q * last as f64).round() as usize).copied().unwrap_or(f64::NAN)
}

/// Root of the mean square.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(s, n), x| (s + x * x, n + 1.0));
    f64::sqrt(sum / count)
}

/// Mean of the second values.
pub fn average(series: &[(f64, f64)]) -> f64 {
    series.iter().map(|(_, y)| y).sum::<f64>() / series.len() as f64
}

/// Least-squares line through the points: value at 0, slope, and the share of the variance that it explains.
pub fn line(points: &[(f64, f64)]) -> (f64, f64, f64) {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p.0 - mx, p.1 - my)).sum::<f64>();
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    let slope = xy / xx;
    (my - slope * mx, slope, xy * xy / (xx * yy))
}

/// The curve's value at `x`, interpolated linearly between its points, which are in order of x.
pub fn at(curve: &[(f64, f64)], x: f64) -> f64 {
    let next = curve.partition_point(|p| p.0 < x).clamp(1, curve.len() - 1);
    let ((x0, y0), (x1, y1)) = (curve[next - 1], curve[next]);
    y0 + (y1 - y0) * (x - x0) / (x1 - x0)
}

/// A damped oscillation about 0.
#[derive(Debug, Clone, Copy)]
pub struct Oscillation {
    /// rad/s, from the mean time between passages through 0.
    pub frequency: f64,
    /// Damping ratio, from the decay of successive extremes.
    pub damping: f64,
}

/// The oscillation of a series about 0; NaN if it passes 0 less than twice.
pub fn oscillation(series: &[(f64, f64)]) -> Oscillation {
    let passages: Vec<f64> = series
        .windows(2)
        .filter(|w| (w[0].1 < 0.0) != (w[1].1 < 0.0))
        .map(|w| w[0].0 - w[0].1 * (w[1].0 - w[0].0) / (w[1].1 - w[0].1))
        .collect();
    let (Some(first), Some(last)) = (passages.first(), passages.last()) else {
        return Oscillation { frequency: f64::NAN, damping: f64::NAN };
    };
    let halves = (passages.len() - 1) as f64;
    let extremes: Vec<(f64, f64)> = passages
        .windows(2)
        .enumerate()
        .map(|(k, w)| {
            let between = series.iter().filter(|p| p.0 > w[0] && p.0 < w[1]);
            (k as f64, between.map(|p| p.1.abs()).fold(0.0, f64::max).ln())
        })
        .collect();
    let decay = if extremes.len() < 2 { f64::NAN } else { -line(&extremes).1 };
    Oscillation { frequency: std::f64::consts::PI * halves / (last - first), damping: decay / std::f64::consts::PI }
}
