//! The points of the maps.

use serde::{Deserialize, Serialize};

pub const MAPS: &[&str] =
    &["iterations", "tolerance", "relaxation", "stiffness", "yield", "viscosity", "density", "cells", "fill"];

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    Published,
    Implicit,
    Explicit,
}

impl Scheme {
    pub const ALL: [Scheme; 3] = [Scheme::Published, Scheme::Implicit, Scheme::Explicit];

    pub fn engine(self) -> pbmpm::Scheme {
        match self {
            Scheme::Published => pbmpm::Scheme::Published,
            Scheme::Implicit => pbmpm::Scheme::Implicit,
            Scheme::Explicit => pbmpm::Scheme::Explicit,
        }
    }
}

/// What happens to the matter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Case {
    /// It lies on a plate from wall to wall.
    Rest,
    /// A block of it is thrown at the plate.
    Impact,
    /// It fills the lower half of a hollow ball, whose wall is not aligned with the nodes.
    Bowl,
    /// Another plate presses a block to two thirds of its height, and withdraws.
    Press,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Matter {
    Liquid,
    Elastic,
    Sand,
    Clay,
    /// Two liquids, the lighter one below.
    LightBelow,
    /// Two liquids, the lighter one above.
    LightAbove,
}

/// A world: its matter, and how it is stepped.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Point {
    pub map: String,
    pub scheme: Scheme,
    pub matter: Matter,
    pub case: Case,
    pub hertz: f64,
    pub iterations: u32,
    pub tolerance: f64,
    pub relaxation: f64,
    pub youngs_modulus: f64,
    pub poisson_ratio: f64,
    /// Of clay, in Pa.
    pub yield_stress: f64,
    pub viscosity: f64,
    /// For two liquids: density of the heavier over that of the lighter one.
    pub density_ratio: f64,
    pub cell_size: f64,
    pub per_cell: f64,
}

impl Point {
    fn new(map: &str, scheme: Scheme, matter: Matter, case: Case, hertz: f64) -> Point {
        let iterations = match scheme {
            Scheme::Published => 8,
            Scheme::Implicit => 14,
            Scheme::Explicit => 1,
        };
        Point {
            map: map.to_owned(),
            scheme,
            matter,
            case,
            hertz,
            iterations,
            tolerance: 0.01,
            relaxation: 1.5,
            youngs_modulus: 1e5,
            poisson_ratio: 0.3,
            yield_stress: 300.0,
            viscosity: 0.0,
            density_ratio: 1.0,
            cell_size: 0.02,
            per_cell: 8.0,
        }
    }

    /// The quantity in which the map's rows differ: its name and value.
    pub fn row(&self) -> (&'static str, f64) {
        match self.map.as_str() {
            "iterations" => ("iterations", f64::from(self.iterations)),
            "tolerance" => ("tolerance", self.tolerance),
            "relaxation" => ("relaxation", self.relaxation),
            "stiffness" => ("Young's modulus, Pa", self.youngs_modulus),
            "yield" => ("yield stress, Pa", self.yield_stress),
            "viscosity" => ("viscosity, Pa s", self.viscosity),
            "density" => ("density ratio", self.density_ratio),
            "cells" => ("cell size, m", self.cell_size),
            _ => ("particles per cell", self.per_cell),
        }
    }

    /// The label that distinguishes the map's panels.
    pub fn panel(&self) -> String {
        let matter = match self.matter {
            Matter::Liquid => "liquid",
            Matter::Elastic => "elastic",
            Matter::Sand => "sand",
            Matter::Clay => "clay",
            Matter::LightBelow => "light below",
            Matter::LightAbove => "light above",
        };
        let poisson = if self.map == "stiffness" { format!(", ν {}", self.poisson_ratio) } else { String::new() };
        format!("{:?}, {matter}{poisson}", self.scheme).to_lowercase()
    }
}

const HERTZ: &[f64] = &[5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 240.0, 480.0, 960.0, 2400.0];
use Case::{Bowl, Impact, Press, Rest};

/// Changes a point into one of a certain row.
type Change = Box<dyn Fn(&mut Point)>;

/// The points of all maps.
pub fn points() -> Vec<Point> {
    let mut points = Vec::new();
    let mut add = |map: &str, schemes: &[Scheme], matter: Matter, cases: &[Case], rows: &[&dyn Fn(&mut Point)]| {
        for &scheme in schemes {
            for change in rows {
                for &case in cases {
                    for &hertz in HERTZ {
                        let mut point = Point::new(map, scheme, matter, case, hertz);
                        change(&mut point);
                        points.push(point);
                    }
                }
            }
        }
    };
    let [published, implicit, explicit] = Scheme::ALL;
    fn each(values: &[f64], set: fn(&mut Point, f64)) -> Vec<Change> {
        values.iter().map(|&value| Box::new(move |p: &mut Point| set(p, value)) as Change).collect()
    }
    fn refs(all: &[Change]) -> Vec<&dyn Fn(&mut Point)> {
        all.iter().map(|f| &**f).collect()
    }

    let rows = each(&[1.0, 2.0, 4.0, 8.0, 16.0, 40.0], |p, n| p.iterations = n as u32);
    add("iterations", &[published, implicit], Matter::Liquid, &[Rest, Impact, Bowl], &refs(&rows));
    add("iterations", &[published, implicit], Matter::Elastic, &[Impact, Bowl], &refs(&rows));
    add("iterations", &[explicit], Matter::Liquid, &[Rest, Impact, Bowl], &refs(&rows[..1]));

    let rows = each(&[0.0, 0.001, 0.03, 0.05, 0.1], |p, x| p.tolerance = x);
    add("tolerance", &[implicit], Matter::Liquid, &[Rest, Impact], &refs(&rows));
    add("tolerance", &[implicit], Matter::Elastic, &[Impact], &refs(&rows));

    let rows = each(&[0.15, 0.5, 1.0, 1.5, 1.9], |p, x| p.relaxation = x);
    add("relaxation", &[published], Matter::Liquid, &[Rest, Impact], &refs(&rows));
    add("relaxation", &[published], Matter::Elastic, &[Impact, Press], &refs(&rows));

    for poisson in [0.0, 0.3, 0.49, 0.499] {
        let moduli: Vec<_> = (3..=10)
            .map(|power| {
                let change = move |p: &mut Point| {
                    p.youngs_modulus = 10f64.powi(power);
                    p.poisson_ratio = poisson;
                };
                Box::new(change) as Change
            })
            .collect();
        let cases = if poisson == 0.3 { &[Rest, Impact, Press, Bowl][..] } else { &[Impact][..] };
        add("stiffness", &[implicit, explicit], Matter::Elastic, cases, &refs(&moduli));
    }

    let rows = each(&[10.0, 300.0, 1e4], |p, x| p.yield_stress = x);
    add("yield", &Scheme::ALL, Matter::Clay, &[Impact, Press, Bowl], &refs(&rows));
    add("yield", &[published, explicit], Matter::Sand, &[Impact, Press, Bowl], &refs(&rows[..1]));

    let rows = each(&[0.0, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4], |p, x| p.viscosity = x);
    add("viscosity", &Scheme::ALL, Matter::Liquid, &[Impact, Bowl], &refs(&rows));
    add("viscosity", &[implicit, explicit], Matter::Elastic, &[Impact, Bowl], &refs(&rows));

    let rows = each(&[10.0, 100.0, 1000.0], |p, x| p.density_ratio = x);
    add("density", &Scheme::ALL, Matter::LightBelow, &[Rest], &refs(&rows));
    add("density", &Scheme::ALL, Matter::LightAbove, &[Rest], &refs(&rows));

    let rows = each(&[1e-4, 1e-3, 0.02, 0.5, 20.0], |p, x| p.cell_size = x);
    add("cells", &Scheme::ALL, Matter::Liquid, &[Rest, Impact, Bowl], &refs(&rows));
    add("cells", &Scheme::ALL, Matter::Elastic, &[Impact], &refs(&rows));

    let rows = each(&[0.1, 0.5, 1.0, 3.0, 8.0, 27.0, 125.0, 1000.0], |p, x| p.per_cell = x);
    add("fill", &Scheme::ALL, Matter::Liquid, &[Rest, Impact], &refs(&rows));
    points
}
