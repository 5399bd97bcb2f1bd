//! The thesis' claim of O(I (P + G)) per step, fitted to the measurements.

use super::record::Row;

/// Milliseconds of a step as a sum of terms, with the least sum of squared relative errors.
#[derive(Debug, Clone)]
pub struct Fit {
    /// In the order of the terms.
    pub coefficients: Vec<f64>,
    /// Root of the mean square of the relative errors.
    pub residual: f64,
    /// The largest relative error.
    pub worst: f64,
    pub points: usize,
}

/// `None` if the points do not distinguish the terms.
fn fit(points: &[(Vec<f64>, f64)]) -> Option<Fit> {
    let n = points.first()?.0.len();
    // The normal equations, with the right side as the last column.
    let mut rows = vec![vec![0.0; n + 1]; n];
    for (terms, y) in points {
        let scaled: Vec<f64> = terms.iter().map(|t| t / y).chain([1.0]).collect();
        for (i, row) in rows.iter_mut().enumerate() {
            row.iter_mut().zip(&scaled).for_each(|(sum, s)| *sum += scaled[i] * s);
        }
    }
    // Terms differ much in size.
    let scale: Vec<f64> = (0..n).map(|i| rows[i][i].sqrt()).collect();
    if scale.contains(&0.0) {
        return None;
    }
    for i in 0..n {
        for j in 0..n {
            rows[i][j] /= scale[i] * scale[j];
        }
        rows[i][n] /= scale[i];
    }
    for i in 0..n {
        let pivot = (i..n).max_by(|a, b| rows[*a][i].abs().total_cmp(&rows[*b][i].abs()))?;
        rows.swap(i, pivot);
        if rows[i][i].abs() < 1e-9 {
            return None;
        }
        let lead = rows[i].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(j, _)| *j != i) {
            let factor = row[i] / lead[i];
            row.iter_mut().zip(&lead).for_each(|(x, l)| *x -= factor * l);
        }
    }
    let coefficients: Vec<f64> = (0..n).map(|i| rows[i][n] / rows[i][i] / scale[i]).collect();
    let error =
        |(terms, y): &(Vec<f64>, f64)| terms.iter().zip(&coefficients).map(|(t, c)| t * c).sum::<f64>() / y - 1.0;
    let errors: Vec<f64> = points.iter().map(error).collect();
    let residual = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let worst = errors.iter().map(|e| e.abs()).fold(0.0, f64::max);
    Some(Fit { coefficients, residual, worst, points: points.len() })
}

fn points(rows: &[Row], terms: fn(&Row) -> Vec<f64>) -> Vec<(Vec<f64>, f64)> {
    let swept = |row: &&Row| ["particles", "iterations", "cells", "frequency"].contains(&row.sweep.as_str());
    rows.iter().filter(swept).map(|row| (terms(row), row.best())).collect()
}

/// ms = a + I (b P + c G), with the active blocks as G.
pub fn of_thesis(rows: &[Row]) -> Option<Fit> {
    fit(&points(rows, |r| vec![1.0, r.iterations * r.particles as f64, r.iterations * r.active_blocks]))
}

/// ms = a + d P + I (b P + c G): some stages run once per step.
pub fn with_once(rows: &[Row]) -> Option<Fit> {
    let terms = |r: &Row| {
        let particles = r.particles as f64;
        vec![1.0, r.iterations * particles, r.iterations * r.active_blocks, particles]
    };
    fit(&points(rows, terms))
}
