//! Maps as SVG files: steps per second along x, a panel for each scheme and matter, and a square's colour for the worst
//! verdict of its cases.

use crate::run::{Outcome, Verdict};
use crate::sweep::{MAPS, Point};
use plotters::prelude::*;
use std::path::Path;

type Failure = Box<dyn std::error::Error>;

const SQUARE: i32 = 22;
/// Room beside the squares of a panel: left, above, right, below.
const LEFT: i32 = 76;
const ABOVE: i32 = 24;
const RIGHT: i32 = 14;
const BELOW: i32 = 26;
const COLUMNS: usize = 3;

/// The colours of Okabe and Ito, which people with any colour vision can tell apart.
fn color(verdict: Verdict) -> RGBColor {
    match verdict {
        Verdict::Refused => RGBColor(220, 220, 220),
        Verdict::Stable => RGBColor(0, 158, 115),
        Verdict::Collapsed => RGBColor(240, 228, 66),
        Verdict::Growing => RGBColor(230, 159, 0),
        Verdict::Tunnelled => RGBColor(0, 114, 178),
        Verdict::NotFinite => RGBColor(0, 0, 0),
        Verdict::Stopped => RGBColor(90, 90, 90),
    }
}

pub fn draw_all(folder: &Path, rows: &[(Point, Outcome)]) -> Result<(), Failure> {
    for map in MAPS {
        let rows: Vec<_> = rows.iter().filter(|(point, _)| point.map == *map).collect();
        if !rows.is_empty() {
            draw(&folder.join(format!("stability-{map}.svg")), &rows)?;
        }
    }
    Ok(())
}

/// The distinct values, in ascending order.
fn distinct(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    all
}

fn number(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e5).contains(&x) { format!("{x:e}") } else { format!("{x}") }
}

fn draw(path: &Path, rows: &[&(Point, Outcome)]) -> Result<(), Failure> {
    let hertz = distinct(rows.iter().map(|(point, _)| point.hertz));
    let values = distinct(rows.iter().map(|(point, _)| point.row().1));
    let mut panels: Vec<String> = Vec::new();
    for (point, _) in rows {
        if !panels.contains(&point.panel()) {
            panels.push(point.panel());
        }
    }
    let width = LEFT + SQUARE * hertz.len() as i32 + RIGHT;
    let height = ABOVE + SQUARE * values.len() as i32 + BELOW;
    let lines = panels.len().div_ceil(COLUMNS) as i32;
    let size = (width * COLUMNS.min(panels.len()) as i32, height * lines + 44);
    let area = SVGBackend::new(path, (size.0 as u32, size.1 as u32)).into_drawing_area();
    area.fill(&WHITE)?;
    let small = ("sans-serif", 11).into_font();
    for (k, panel) in panels.iter().enumerate() {
        let (x0, y0) = (width * (k % COLUMNS) as i32 + LEFT, height * (k / COLUMNS) as i32 + ABOVE);
        area.draw(&Text::new(panel.as_str(), (x0, y0 - 16), ("sans-serif", 13).into_font()))?;
        for (j, value) in values.iter().enumerate() {
            let y = y0 + SQUARE * (values.len() - 1 - j) as i32;
            let label = Text::new(number(*value), (x0 - 48, y + 6), small.clone());
            area.draw(&label)?;
            for (i, rate) in hertz.iter().enumerate() {
                let x = x0 + SQUARE * i as i32;
                let here = |(p, _): &&&(Point, Outcome)| p.hertz == *rate && p.row().1 == *value && p.panel() == *panel;
                if let Some(worst) = rows.iter().filter(here).map(|(_, outcome)| outcome.verdict).max() {
                    let square = [(x + 1, y + 1), (x + SQUARE - 1, y + SQUARE - 1)];
                    area.draw(&Rectangle::new(square, color(worst).filled()))?;
                }
            }
        }
        for (i, rate) in hertz.iter().enumerate() {
            let at = (x0 + SQUARE * i as i32 + 1, y0 + SQUARE * values.len() as i32 + 4);
            area.draw(&Text::new(number(*rate), at, ("sans-serif", 9).into_font()))?;
        }
    }
    let name = rows.first().map_or("", |(point, _)| point.row().0);
    let y = height * lines + 2;
    area.draw(&Text::new(format!("along x: steps per second; along y: {name}"), (12, y), small.clone()))?;
    for (i, verdict) in Verdict::ALL.into_iter().enumerate() {
        let x = 12 + 84 * i as i32;
        area.draw(&Rectangle::new([(x, y + 20), (x + 12, y + 32)], color(verdict).filled()))?;
        area.draw(&Text::new(verdict.name(), (x + 16, y + 21), small.clone()))?;
    }
    Ok(area.present()?)
}
