//! How closely devices must agree with the CPU path in single precision, and pipelines of one device with each other.
//!
//! Drivers that run on a CPU compute exactly as specified, and give its bits. A graphics processor may contract a
//! product and a sum, flush denormals to zero, and be off by 2.5 units in the last place in a division, differently in
//! each pipeline. On these, single passes are compared within the rounding errors that can add up in them, and states
//! by their sums, since contact and the iterations for stresses amplify differences of single particles.

use crate::backends::Backend;
use crate::worlds::{DX, apart, larger};
use pbmpm::lockstep::Difference;
use pbmpm::{DVec3, Loads, Particle, state_hash};

/// Tolerance of numbers up to about 4 in size after the few operations of a pass.
const FLOATS: f64 = 1e-5;
/// Tolerance of nodes' values from sums, and of particles' values from nodes.
const NODES: f64 = 1e-4;
/// A borderline rounding changes a fixed-point sum by one unit (of the published scheme's) for each particle that
/// contributes, of which a node has at most a few hundred.
const UNITS: f64 = 256.0;
/// Gaps are stored in units of 2⁻¹⁶ cells; positions and distances of up to some 16 cells are off by four roundings of
/// 2⁻²⁰.
const GAPS: f64 = 4.0;

/// Whether rounding depends on the driver.
pub fn rounds_by_itself(backend: Backend) -> bool {
    backend == Backend::Gpu
}

/// The difference from the CPU path that a device may have after a pass, and the one that it has, where rounding may
/// differ. Decisions and counts must be equal.
pub fn allowed(d: &Difference, backend: Backend) -> (f64, f64) {
    let own = rounds_by_itself(backend);
    let most = match d.stage.name() {
        "p2g" | "volume_p2g" => UNITS,
        "constraint" | "stress" | "volume_g2p" | "rescale" | "gauge" => FLOATS,
        "grid_update" | "sharpen" | "g2p" | "integrate" => NODES,
        "drain" | "emit_place" if own && !d.integers => NODES,
        "sense" if own => f64::INFINITY,
        "gap" if own => GAPS,
        _ => 0.0,
    };
    (most, if own { d.weighed } else { d.largest })
}

/// Fails unless a pass on a device gives the CPU's bits, or on a GPU is within the tolerance.
pub fn assert_pass(d: &Difference, backend: Backend) {
    let place = format!("{} after {}: {} of {} differ", d.what, d.stage.name(), d.unequal, d.compared);
    let (most, found) = allowed(d, backend);
    if rounds_by_itself(backend) {
        assert!(found <= most && (most > 0.0 || d.unequal == 0), "{place}, by up to {found:e}");
    } else {
        assert_eq!(d.unequal, 0, "{place}, by up to {:e}", d.largest);
    }
}

/// Mass, centre and kinetic energy.
fn sums(particles: &[Particle]) -> (f64, DVec3, f64) {
    let mass: f64 = particles.iter().map(|p| p.mass).sum();
    let centre = particles.iter().map(|p| p.position * p.mass).sum::<DVec3>() / mass;
    (mass, centre, particles.iter().map(|p| 0.5 * p.mass * p.velocity.length_squared()).sum())
}

/// Distance in cells within which half of the particles must agree: with other rounding the solve ends elsewhere within
/// its tolerance, and contact then amplifies the difference for single particles, but not for their sums.
const HALF: f64 = 0.25;
/// Effect of rounding after some tens of steps of contact, as a share: of a cell, of loads and of counts.
const SHARE: f64 = 0.05;
/// The same for energies: on the CPU path itself they differ by 6 % 24 steps after liquids with a tolerance of 0.02
/// have hit bodies, if the initial speed changes by a millionth.
const ENERGY: f64 = 0.1;

/// As [`assert_states_on`], on cells of [`DX`].
pub fn assert_states(backend: Backend, here: &[Particle], there: &[Particle], place: &str) {
    assert_states_on(DX, backend, here, there, place);
}

/// Fails unless two states have the same bits. If the backend's rounding differs: unless slots hold the same matter,
/// its centre agrees within a twentieth of a cell, its energy within a tenth, and half of the particles are within a
/// quarter of a cell.
pub fn assert_states_on(cell: f64, backend: Backend, here: &[Particle], there: &[Particle], place: &str) {
    if !rounds_by_itself(backend) {
        assert_eq!(state_hash(here), state_hash(there), "{place}: {} m apart", apart(here, there));
        return;
    }
    assert_eq!(here.len(), there.len(), "{place}");
    let of = |p: &Particle| (p.fate, p.material, p.mass.to_bits());
    assert!(here.iter().zip(there).all(|(a, b)| of(a) == of(b)), "{place}: other particles");
    let ((mass, a, energy), (other_mass, b, other_energy)) = (sums(here), sums(there));
    assert_eq!(mass, other_mass, "{place}");
    assert!(a.distance(b) < SHARE * cell, "{place}: centres at {a} and {b} m");
    assert!((energy - other_energy).abs() <= ENERGY * energy, "{place}: {energy} and {other_energy} J");
    let mut distances: Vec<_> = here.iter().zip(there).map(|(a, b)| a.position.distance(b.position)).collect();
    distances.sort_by(f64::total_cmp);
    let half = distances.get(distances.len() / 2).copied().unwrap_or_default();
    assert!(half < HALF * cell, "{place}: half of the particles are {half} m and more apart");
}

/// The same for loads: to the last bit, or within a twentieth of the largest impulse.
pub fn assert_loads(backend: Backend, here: &Loads, there: &Loads, bodies: usize) {
    if !rounds_by_itself(backend) {
        assert!(here == there, "{:?} and {:?}", here.of(0), there.of(0));
        return;
    }
    assert_eq!((here.step, here.time), (there.step, there.time));
    let loads = |of: &Loads| (0..bodies).map(|i| of.of(i).unwrap_or_default()).collect::<Vec<_>>();
    let (here, there) = (loads(here), loads(there));
    let largest = here.iter().map(|load| load.impulse.length()).fold(0.0, larger);
    for (i, (a, b)) in here.iter().zip(&there).enumerate() {
        assert!(a.impulse.distance(b.impulse) <= SHARE * largest, "body {i}: {a:?} and {b:?}");
    }
}

/// The same for counts.
pub fn assert_counts<const N: usize>(backend: Backend, [here, there]: [[u64; N]; 2], place: &str) {
    let most = |count: u64| if rounds_by_itself(backend) { SHARE * count as f64 } else { 0.0 };
    let alike = here.iter().zip(there).all(|(a, b)| a.abs_diff(b) as f64 <= most(*a));
    assert!(alike, "{place}: {here:?} and {there:?}");
}

/// The same for positions in buffers, in cells, after a dozen steps: to the last bit, or within much less than the
/// matter's motion in one step.
pub fn assert_positions(backend: Backend, here: &[[f32; 4]], there: &[[f32; 4]]) {
    assert_eq!(here.len(), there.len());
    let lanes = here.as_flattened().iter().zip(there.as_flattened());
    let largest = lanes.map(|(a, b)| (a - b).abs()).fold(0.0, larger);
    assert!(largest < 1e-4 && rounds_by_itself(backend) || here == there, "{largest} cells apart");
}
