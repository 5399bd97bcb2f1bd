//! The cases. Lengths in cells are for a refinement of 1.

mod channel;
mod clamped;
mod column;
mod dam;
mod elastic;
mod endurance;
mod flight;
mod grains;
mod order;
mod slosh;
mod slump;
mod spheres;
mod tank;
mod vortex;

use super::outcome::Outcome;
use super::setup::Setup;
use pbmpm::{DVec3, Result, Spawn};

/// The function that runs a case.
pub type Body = fn(&Setup) -> Result<Outcome>;

/// A case of the suite.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Group, and what distinguishes the case within it.
    pub name: &'static str,
    pub about: &'static str,
    /// Whether it is part of the quick subset.
    pub quick: bool,
    pub body: Body,
}

const fn case(name: &'static str, quick: bool, body: Body, about: &'static str) -> Case {
    Case { name, about, quick, body }
}

/// Every case.
pub const CASES: &[Case] = &[
    case("a1-fall", true, flight::fall, "free fall of a cube against the parabola"),
    case("a1-drift", true, flight::drift, "the same fall watched from a frame that moves a cell per step"),
    case("a2-momentum", true, flight::momentum, "a block in flight for 1000 transfers"),
    case("a2-transfer", true, flight::transfer, "one transfer of a rotation"),
    case("a2-spin", false, flight::spin, "an elastic ball turns once"),
    case("a3-16", true, column::h16, "resting column of water, 16 cells high"),
    case("a3-32", true, column::h32, "32 cells"),
    case("a3-64", false, column::h64, "64 cells"),
    case("a3-128", false, column::h128, "128 cells"),
    case("a3-solid", true, column::solid, "elastic column settles under its weight"),
    case("a4-dam", true, dam::front, "dam break of 1 by 2 (Martin and Moyce)"),
    case("a5-ritter", false, dam::ritter, "long dam break against shallow-water theory"),
    case("a6-deep", true, slosh::deep, "first sloshing mode, half as deep as long"),
    case("a6-shallow", false, slosh::shallow, "first sloshing mode, a quarter as deep as long"),
    case("a7-vortex", true, vortex::inviscid, "decay of four Taylor-Green vortices without viscosity"),
    case("a7-iterations", false, vortex::iterations, "how much of that depends on the iterations"),
    case("a8-viscous", true, vortex::viscous, "decay of four Taylor-Green vortices with viscosity"),
    case("a8-viscometer", false, vortex::viscometer, "torque between two cylinders"),
    case("a8-couette", false, channel::couette, "a plate drags liquid over another (Couette)"),
    case("a8-poiseuille", true, channel::poiseuille, "gravity drives liquid between two plates (Poiseuille)"),
    case("a8-spread", false, channel::spread, "how much its viscosity depends on steps, iterations and cells"),
    case("a9-bar", true, elastic::bar, "longitudinal oscillation of a free bar"),
    case("a9-spread", false, elastic::spread, "its stiffness over steps of 1/60 to 1/480 s"),
    case("a9-hanging", true, clamped::hanging, "sag of a hanging bar"),
    case("a10-beam", true, clamped::cantilever, "sag and frequency of a cantilever, 4 cells high"),
    case("a11-ball", true, elastic::ball, "elastic ball bounces (Hertz)"),
    case("a12-block", true, grains::friction, "elastic block on an incline with friction"),
    case("a12-incline", false, grains::incline, "layer of sand on a rough incline"),
    case("a12-repose", false, grains::repose, "how much the slope of a pile depends on steps, iterations and cells"),
    case("a13-1", true, grains::column_1, "plane column of sand collapses, as high as wide"),
    case("a13-runout", false, grains::columns, "the same, 0.5 to 5 times as high"),
    case("a14-slump", true, slump::slump, "slump of a clay cylinder (Pashias)"),
    case("a14-slumps", false, slump::slumps, "the same at four yield stresses"),
    case("a15-tank", false, tank::torricelli, "tank drains through a slot (Torricelli)"),
    case("a16-step", false, order::step, "order of the error in the step"),
    case("a16-cell", false, order::cell, "order of the error in the cell size"),
    case("a16-iterations", false, order::iterations, "whether more iterations ever make an error larger"),
    case("b1-bore", false, dam::bore, "dam break onto still water against shallow-water theory (Stoker)"),
    case("b2-spheres", false, spheres::stokes, "drag on a ball in a hollow sphere of thick liquid (Stokes)"),
    case("b3-torsion", false, elastic::torsion, "torsional oscillation of a free bar (Saint-Venant)"),
    case("b4-layers", false, column::spirit_on_water, "resting column of a light liquid on water, 16 cells each"),
    case("long-pool", false, endurance::pool, "pool at rest, ten minutes unless --minutes says otherwise"),
    case("long-slosh", false, endurance::tank, "sloshing tank, likewise"),
];

/// Mean displacement of the parts of a column of length 1 that hangs from one end under its own weight. `load` is that
/// weight over section and modulus, negative for a standing column. Its stress is the modulus times the logarithm of
/// the stretch λ, over λ: ln λ = p λ at the load p, whose solution is Σ (n+1)^(n−1) pⁿ/n! (Lambert, Euler). To first
/// order the result is load/3.
fn hung(load: f64) -> f64 {
    let term = |n: i32| {
        let factorial: f64 = (1..=n).map(f64::from).product();
        f64::from(n + 1).powi(n - 1) * load.powi(n) / factorial / f64::from(n + 2)
    };
    (1..12).map(term).sum()
}

/// A jittered block of `material` between two corners in m.
fn block(setup: &Setup, material: &str, lo: [f64; 3], hi: [f64; 3]) -> Spawn {
    let spawn = Spawn::cuboid(material, DVec3::from_array(lo), DVec3::from_array(hi));
    Spawn { jitter: setup.jitter, seed: 1, ..spawn }
}
