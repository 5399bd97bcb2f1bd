//! The sweeps as pictures, with what the thesis says.

use crate::report::record::{Failure, Row};
use crate::report::table::Device;
use crate::report::thesis;
use crate::suite::chart::{Chart, Curve, sheet};
use std::path::Path;

/// Charts of all sweeps, in which a device has the same colour throughout, and of the scaling.
pub fn draw(devices: &[Device], out: &Path) -> Result<(), Failure> {
    let chart = |sweep: &str, x: &str, at: fn(&Row) -> f64| {
        let rows = |d: &Device| d.rows.iter().filter(|r| r.sweep == sweep).cloned().collect::<Vec<_>>();
        let mut curves: Vec<Curve> = Vec::new();
        let mut published = Vec::new();
        for (color, device) in devices.iter().enumerate() {
            let rows = rows(device);
            let points = rows.iter().map(|r| (at(r), r.median_ms)).collect();
            curves.push(Curve { color: Some(color), ..Curve::line(&device.name, points) });
            published = rows.iter().filter_map(|r| thesis::ms(sweep, &r.point).map(|ms| (at(r), ms))).collect();
        }
        curves.push(Curve { color: Some(4), ..Curve::dots("thesis", published) });
        Chart { logarithmic: [false, true], ..Chart::new(sweep, x, "ms per step", curves) }
    };
    let mut charts = vec![
        chart("particles", "particles", |r| r.particles as f64),
        chart("iterations", "iterations", |r| r.iterations),
        chart("cells", "cell size, m", |r| r.cell_size),
        chart("frequency", "steps per simulated second", |r| r.hertz),
    ];
    let curve = |(color, device): (usize, &Device)| {
        let rows = device.rows.iter().filter(|r| r.sweep == "scaling");
        let points = rows.map(|r| (r.particles as f64, r.per_particle())).collect();
        Curve { color: Some(color), ..Curve::line(&device.name, points) }
    };
    let scaling = devices.iter().enumerate().map(curve).collect();
    charts.push(Chart {
        logarithmic: [true; 2],
        ..Chart::new("scaling", "particles", "ns per particle and iteration", scaling)
    });
    let memory = |(color, device): (usize, &Device)| {
        let rows = device.rows.iter().filter(|r| r.sweep == "cells");
        let points = rows.map(|r| (r.cell_size, r.mebibytes())).collect();
        Curve { color: Some(color), ..Curve::line(&device.name, points) }
    };
    let mut curves: Vec<Curve> = devices.iter().enumerate().map(memory).collect();
    let published = thesis::MEMORY.iter().filter(|m| m.per_axis == 25).map(|m| (m.cell_size, m.total)).collect();
    curves.push(Curve { color: Some(4), ..Curve::dots("thesis", published) });
    charts.push(Chart { logarithmic: [false, true], ..Chart::new("memory", "cell size, m", "MiB", curves) });
    charts.retain(|chart| chart.curves.iter().any(|curve| !curve.dots && !curve.points.is_empty()));
    if charts.is_empty() {
        return Ok(());
    }
    sheet(&out.join("sweeps.svg"), &charts, 3)
}
