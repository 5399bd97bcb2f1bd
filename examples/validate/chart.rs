//! Curves as SVG files, and their points as CSV.

use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

type Failure = Box<dyn std::error::Error>;

/// The colours of Okabe and Ito, which people with any colour vision can tell apart.
const COLORS: [RGBColor; 5] =
    [RGBColor(0, 114, 178), RGBColor(213, 94, 0), RGBColor(0, 158, 115), RGBColor(204, 121, 167), RGBColor(80, 80, 80)];

/// A line or some points of a chart.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Not in the legend if empty.
    pub label: String,
    pub points: Vec<(f64, f64)>,
    /// Separate points, as for an experiment.
    pub dots: bool,
    /// Index of the colour; by default the index of the curve.
    pub color: Option<usize>,
}

impl Curve {
    pub fn line(label: impl Into<String>, points: Vec<(f64, f64)>) -> Curve {
        Curve { label: label.into(), points, dots: false, color: None }
    }

    pub fn dots(label: impl Into<String>, points: Vec<(f64, f64)>) -> Curve {
        Curve { label: label.into(), points, dots: true, color: None }
    }
}

/// Curves over one pair of axes.
#[derive(Debug, Clone)]
pub struct Chart {
    /// Also the file's name.
    pub name: String,
    pub x: String,
    pub y: String,
    pub curves: Vec<Curve>,
    /// Whether x and y are logarithmic.
    pub logarithmic: [bool; 2],
}

impl Chart {
    pub fn new(name: impl Into<String>, x: &str, y: &str, curves: Vec<Curve>) -> Chart {
        Chart { name: name.into(), x: x.to_owned(), y: y.to_owned(), curves, logarithmic: [false; 2] }
    }

    /// Writes the points as `folder/name.csv`.
    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        let mut writer = csv::Writer::from_path(folder.join(format!("{}.csv", self.name)))?;
        writer.write_record(["curve", &self.x, &self.y])?;
        for curve in &self.curves {
            curve.points.iter().try_for_each(|(x, y)| writer.serialize((&curve.label, x, y)))?;
        }
        Ok(writer.flush()?)
    }

    /// The contents of such a file, as lines; y is logarithmic where it spans more than two powers of ten.
    pub fn read(path: &Path) -> Result<Chart, Failure> {
        let mut reader = csv::Reader::from_path(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let head = reader.headers()?.clone();
        let (Some(x), Some(y)) = (head.get(1), head.get(2)) else {
            return Err(format!("{}: no points of a chart", path.display()).into());
        };
        let mut curves: Vec<Curve> = Vec::new();
        for point in reader.deserialize() {
            let (label, x, y): (String, f64, f64) = point.map_err(|e| format!("{}: {e}", path.display()))?;
            match curves.iter_mut().find(|curve| curve.label == label) {
                Some(curve) => curve.points.push((x, y)),
                None => curves.push(Curve::line(label, vec![(x, y)])),
            }
        }
        let ys = || curves.iter().flat_map(|curve| curve.points.iter().map(|p| p.1));
        let wide = ys().fold(f64::INFINITY, f64::min) * 100.0 < ys().fold(0.0, f64::max);
        let positive = ys().all(|y| y > 0.0);
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Ok(Chart { logarithmic: [false, wide && positive], ..Chart::new(name, x, y, curves) })
    }

    fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), Failure> {
        let [in_x, in_y] = self.logarithmic;
        let has_place = |v: f64, in_powers: bool| v.is_finite() && (!in_powers || v > 0.0);
        let shown = |p: &&(f64, f64)| has_place(p.0, in_x) && has_place(p.1, in_y);
        let place = |v: f64, in_powers: bool| if in_powers { v.log10() } else { v };
        let scaled = |p: &(f64, f64)| (place(p.0, in_x), place(p.1, in_y));
        let points = |c: &Curve| c.points.iter().filter(shown).map(scaled).collect::<Vec<_>>();
        let all: Vec<_> = self.curves.iter().flat_map(points).collect();
        if all.is_empty() {
            return Ok(());
        }
        let range = |value: fn(&(f64, f64)) -> f64| {
            let (lo, hi) = all.iter().map(value).fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
            let margin = 0.04 * (hi - lo).max(1e-9 * hi.abs()).max(1e-300);
            lo - margin..hi + margin
        };
        let mut chart = ChartBuilder::on(area)
            .caption(&self.name, ("sans-serif", 16))
            .margin(12)
            .x_label_area_size(36)
            .y_label_area_size(60)
            .build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
        let label = |v: &f64, in_powers: bool| match in_powers {
            true => format!("{:.1e}", 10f64.powf(*v)),
            false if *v != 0.0 && v.abs() < 1e-3 => format!("{v:.1e}"),
            false => format!("{}", (v * 1e6).round() / 1e6),
        };
        chart
            .configure_mesh()
            .x_labels(7)
            .y_labels(7)
            .x_desc(self.x.as_str())
            .y_desc(self.y.as_str())
            .x_label_formatter(&|v| label(v, in_x))
            .y_label_formatter(&|v| label(v, in_y))
            .light_line_style(WHITE)
            .draw()?;
        for (i, curve) in self.curves.iter().enumerate() {
            let color = COLORS[curve.color.unwrap_or(i) % COLORS.len()].to_rgba();
            let drawn = if curve.dots {
                chart.draw_series(points(curve).into_iter().map(|p| Circle::new(p, 3, color.filled())))?
            } else {
                chart.draw_series(LineSeries::new(points(curve), color.stroke_width(2)))?
            };
            if !curve.label.is_empty() {
                drawn.label(&curve.label).legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color));
            }
        }
        if self.curves.iter().filter(|curve| !curve.label.is_empty()).count() < 2 {
            return Ok(());
        }
        let (xs, ys) = (chart.x_range(), chart.y_range());
        let share = |v: f64, range: &std::ops::Range<f64>| (v - range.start) / (range.end - range.start);
        let pieces = self.curves.iter().flat_map(|curve| {
            let shares: Vec<_> = points(curve).into_iter().map(|(x, y)| (share(x, &xs), share(y, &ys))).collect();
            // For a line the pieces from each point to the next, for dots the points.
            let next = usize::from(!curve.dots);
            (next..shares.len()).map(|i| [shares[i - next], shares[i]]).collect::<Vec<_>>()
        });
        let corner = emptiest(&pieces.collect::<Vec<_>>());
        chart
            .configure_series_labels()
            .position(corner)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        Ok(())
    }
}

/// The place in a chart where a legend hides the least of the straight `pieces`; both axes go from 0 to 1.
fn emptiest(pieces: &[[(f64, f64); 2]]) -> SeriesLabelPosition {
    use SeriesLabelPosition::{LowerLeft, LowerRight, MiddleRight, UpperLeft, UpperRight};
    let along = |&[a, b]: &[(f64, f64); 2]| {
        (0..=16).map(move |i| f64::from(i) / 16.0).map(move |t| (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)))
    };
    let all: Vec<_> = pieces.iter().flat_map(along).collect();
    let covered = |middle: (f64, f64)| {
        all.iter().filter(|(x, y)| (x - middle.0).abs() < 0.18 && (y - middle.1).abs() < 0.22).count()
    };
    let places = [
        (UpperLeft, (0.15, 0.82)),
        (UpperRight, (0.85, 0.82)),
        (LowerLeft, (0.15, 0.18)),
        (LowerRight, (0.85, 0.18)),
        (MiddleRight, (0.85, 0.5)),
    ];
    places.into_iter().min_by_key(|(_, middle)| covered(*middle)).map_or(UpperLeft, |(place, _)| place)
}

/// Draws charts into an SVG file, `columns` side by side.
pub fn sheet(path: &Path, charts: &[Chart], columns: usize) -> Result<(), Failure> {
    const SIZE: (u32, u32) = (480, 320);
    let (columns, rows) = (columns.min(charts.len()).max(1), charts.len().div_ceil(columns));
    let area = SVGBackend::new(path, (SIZE.0 * columns as u32, SIZE.1 * rows as u32)).into_drawing_area();
    area.fill(&WHITE)?;
    for (chart, part) in charts.iter().zip(area.split_evenly((rows, columns))) {
        chart.draw(&part)?;
    }
    Ok(area.present()?)
}
