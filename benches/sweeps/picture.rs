//! The sweeps as pictures, with the values of the thesis.

use crate::report::record::Row;
use crate::report::table::Device;
use crate::report::thesis;
use crate::suite::chart::{Chart, Curve, sheet};
use crate::suite::file::Failure;
use std::path::Path;

/// Charts of all sweeps and of the scaling; a device has the same colour in all of them.
pub fn draw(devices: &[Device], out: &Path) -> Result<(), Failure> {
    let lines = |sweep: &str, point: &dyn Fn(&Row) -> (f64, f64)| -> Vec<Curve> {
        let line = |(color, device): (usize, &Device)| {
            let points = device.rows.iter().filter(|r| r.sweep == sweep).map(point).collect();
            Curve { color: Some(color), ..Curve::line(&device.name, points) }
        };
        devices.iter().enumerate().map(line).collect()
    };
    let thesis_at = |points| Curve { color: Some(4), ..Curve::dots("thesis", points) };
    let chart = |sweep: &str, x: &str, at: fn(&Row) -> f64| {
        let rows = devices.last().map_or(&[][..], |d| &d.rows).iter().filter(|r| r.sweep == sweep);
        let published = rows.filter_map(|r| thesis::ms(sweep, &r.point).map(|ms| (at(r), ms))).collect();
        let mut curves = lines(sweep, &|r| (at(r), r.median_ms));
        curves.push(thesis_at(published));
        Chart { logarithmic: [false, true], ..Chart::new(sweep, x, "ms per step", curves) }
    };
    let mut charts = vec![
        chart("particles", "particles", |r| r.particles as f64),
        chart("iterations", "iterations", |r| r.iterations),
        chart("cells", "cell size, m", |r| r.cell_size),
        chart("frequency", "steps per simulated second", |r| r.hertz),
    ];
    let scaling = lines("scaling", &|r| (r.particles as f64, r.per_particle()));
    charts.push(Chart {
        logarithmic: [true; 2],
        ..Chart::new("scaling", "particles", "ns per particle and iteration", scaling)
    });
    let mut memory = lines("cells", &|r| (r.cell_size, r.mebibytes()));
    memory
        .push(thesis_at(thesis::MEMORY.iter().filter(|m| m.per_axis == 25).map(|m| (m.cell_size, m.total)).collect()));
    charts.push(Chart { logarithmic: [false, true], ..Chart::new("memory", "cell size, m", "MiB", memory) });
    charts.retain(|chart| chart.curves.iter().any(|curve| !curve.dots && !curve.points.is_empty()));
    if charts.is_empty() {
        return Ok(());
    }
    sheet(&out.join("sweeps.svg"), &charts, 3)
}
