//! Measurements from the text of the thesis, on eight cores of an AMD Ryzen 7 7840HS.

/// Time of a step, ms, at a point of a sweep.
pub fn ms(sweep: &str, point: &str) -> Option<f64> {
    let known: &[(&str, f64)] = match sweep {
        "particles" => &[("25", 3.428)],
        "iterations" => &[("1", 3.428), ("5", 16.016), ("6", 19.016)],
        "cells" => &[
            ("0.3", 9.931),
            ("0.5", 4.902),
            ("1", 3.428),
            ("1.1", 3.484),
            ("1.5", 3.831),
            ("2.1", 4.270),
            ("3", 4.227),
        ],
        "frequency" => &[("30", 3.428)],
        _ => &[],
    };
    known.iter().find(|k| k.0 == point).map(|k| k.1)
}

/// Frames per second in the frequency sweep, which rendering limits to about 146.
pub fn fps(hertz: &str) -> Option<f64> {
    let known =
        [("10", 146.267), ("30", 145.172), ("130", 136.709), ("140", 134.785), ("200", 72.479), ("250", 27.838)];
    known.into_iter().find(|k| k.0 == hertz).map(|k| k.1)
}

/// Memory that the solver owns, MiB.
pub struct Memory {
    pub per_axis: u32,
    pub cell_size: f64,
    pub particles: f64,
    pub nodes: f64,
    pub tiles: f64,
    pub total: f64,
}

const fn memory(per_axis: u32, cell_size: f64, particles: f64, nodes: f64, tiles: f64, total: f64) -> Memory {
    Memory { per_axis, cell_size, particles, nodes, tiles, total }
}

/// The rows of the thesis' table of memory.
pub const MEMORY: [Memory; 6] = [
    memory(10, 1.0, 0.27, 6.68, 1.28, 8.29),
    memory(25, 1.0, 4.17, 6.68, 20.12, 31.03),
    memory(50, 1.0, 33.38, 6.68, 160.96, 201.08),
    memory(25, 3.0, 4.17, 0.28, 20.12, 24.58),
    memory(25, 0.5, 4.17, 51.91, 20.12, 77.10),
    memory(25, 0.3, 4.17, 238.03, 20.12, 264.45),
];

impl Memory {
    /// The point of the memory sweep that a row belongs to.
    pub fn point(&self) -> String {
        format!("{} at {}", 2 * self.per_axis.pow(3), self.cell_size)
    }
}

/// Number of cells of the thesis' box, whose edges are rounded to whole numbers of them.
pub fn cells(cell_size: f64) -> u64 {
    [50.0, 54.0, 51.0].iter().map(|edge| (edge / cell_size).round_ties_even() as u64).product()
}
