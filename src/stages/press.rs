//! Prepares the solve of the implicit scheme: viscosity, the stress that each particle carries over from the step
//! before, and the strain to be taken back beyond what this stress accounts for.
//!
//! A pressure q adds q (x_i − x_p) to what a particle brings to a node, so that one scatter takes motion and pressure
//! there; a stress with the deviator S, which is positive where it pushes, adds (q + S) (x_i − x_p).

use super::Kernel;
use super::compliance::{compliance_with_block, compliances, elastic_share, weights};
use super::correction::{corrected, kept as correction_of, missed, turned_strain};
use super::motion::{self, bound_gradient};
use super::seek::bounded;
use super::solid::{self, LIQUID, Matrix, VISCOPLASTIC};
use super::viscosity::viscosity;
use super::walls::{Walls, factors_beside};
use crate::bins::origin;
use crate::cpu::constants::{Constants, MaterialConstants};
use crate::cpu::gradient::{Gradient, beside_of, material_of, pressure_mut, pressure_of};
use crate::cpu::lanes::{entries, materials_of, matrices};
use crate::cpu::par;
use crate::cpu::solve::{Search, Shear, Solve, response};
use crate::cpu::state::{CpuState, Tally};
use crate::features::Features;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::Real;
use crate::math::symmetric::Symmetric;
use crate::math::wide::{Wide, Work, widely};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        write(Slot::Gradient),
        read(Slot::Deformation).with_deformation(),
        write(Slot::Search),
        write(Slot::Solve),
        write(Slot::Counters),
        read(Slot::Bin).with_sleep(),
        read(Slot::Displacement),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/press.wgsl"),
};

/// Largest pressure that a particle carries over.
pub(crate) const MAX_PRESSURE: f64 = 1024.0;
/// Divergence that this pressure may correspond to; more where a larger part of a liquid's error in volume is taken
/// back.
pub(crate) const MAX_DIVERGENCE: f64 = 0.25;
/// Largest error in volume that a step takes back, as a share.
pub(crate) const MAX_ERROR: f64 = 0.02;
/// Pressure by which that may be exceeded, whatever the compliance.
pub(crate) const MAX_LOAD: f64 = 32.0;
/// Largest elastic strain whose stress is carried over.
pub(crate) const MAX_SHEAR: f64 = 1.0;
/// Largest factor by which yielding softens matter.
pub(crate) const MAX_SOFTENING: f64 = 100.0;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let Features { corrects, sticks, resumes, shares_pressure: shares, .. } = s.features;
    let walls = Walls::of(s);
    let count = s.position.len();
    s.search.resize(count, Search::default());
    let tensors = s.features.tensors();
    s.shear.resize(if tensors { count } else { 0 }, Shear::default());
    s.deviator.resize(if tensors { count } else { 0 }, Default::default());
    let press = Press {
        constants: &s.constants,
        position: &s.position,
        displacement: &s.displacement,
        deformation: &s.deformation,
        tally: &s.tally,
        corrects: corrects && tensors,
        sticks,
        resumes,
        shares,
    };
    let shear = (tensors.then_some(&mut s.shear[..]), tensors.then_some(&mut s.deviator[..]));
    let particles = ((&mut s.gradient[..], &mut s.search[..]), shear);
    let materials = &s.materials;
    let solids = materials.iter().any(|m| m.model != LIQUID);
    let all = par::Largest::new();
    par::block_particles(&s.blocks[..s.occupied], particles, &|_, block, parts| {
        let ((gradient, search), (mut shear, mut deviator)) = parts;
        let walls = walls.beside(origin(block.key));
        let mut largest = Largest::default();
        let mut strains = [Matrix::default(); 4];
        for (first, (gradient, search)) in (0..).step_by(4).zip(gradient.chunks_mut(4).zip(search.chunks_mut(4))) {
            if solids && materials_of(gradient, materials).iter().any(|m| m.model != LIQUID) {
                widely(&Strain(&press.deformation[block.start as usize + first..][..gradient.len()]), &mut strains);
            }
            for (n, (gradient, search)) in gradient.iter_mut().zip(search).enumerate() {
                let i = first + n;
                let material = &materials[material_of(gradient)];
                let strain = (material.model != LIQUID).then_some(&strains[n]);
                let tensor = shear.as_deref_mut().zip(deviator.as_deref_mut());
                let tensor = tensor.map(|(shear, deviator)| (&mut shear[i], &mut deviator[i]));
                let p = block.start as usize + i;
                *search = press.pressed(p, material, gradient, tensor, strain, walls.as_ref(), &mut largest);
            }
        }
        let Largest { stress, rate, motion, compliance, response, residual } = largest;
        all.note([stress, rate, motion, compliance, response, residual]);
    });
    let [pressure, rate, motion, compliance, response, largest_answer] = all.take::<R>();
    motion::note(&mut s.largest_motion, motion);
    s.solve = Solve {
        tensors,
        corrects: corrects && tensors,
        resumes,
        pressure,
        rate: rate.sqrt(),
        compliance,
        response,
        largest_answer,
        ..Solve::default()
    };
}

/// Prepares particles for the solve.
struct Press<'a, R: Real> {
    constants: &'a Constants<R>,
    position: &'a [[R; 4]],
    displacement: &'a [[R; 4]],
    deformation: &'a [Gradient<R>],
    tally: &'a Tally,
    /// Beside bodies that hold them some particles see a corrected gradient.
    corrects: bool,
    /// Thick liquids are among these.
    sticks: bool,
    /// The solve begins with a search along the stress carried over.
    resumes: bool,
    /// Liquids share pressures of blocks.
    shares: bool,
}

/// The largest of what particles bring to the solve.
#[derive(Default)]
struct Largest<R> {
    stress: R,
    rate: R,
    motion: R,
    // Of those that take part.
    compliance: R,
    response: R,
    residual: R,
}

/// The deviator's part of a particle's search, and the one that it carries over.
type Tensor<'a, R> = (&'a mut Shear<R>, &'a mut [[R; 4]; 2]);

impl<R: Real> Press<'_, R> {
    /// Prepares a particle's search, and adds the effect of the stress that it carries over to its gradient. `strain` is
    /// that of solids.
    #[allow(clippy::too_many_arguments)] // a particle's fields, and where it is
    #[inline(always)]
    fn pressed(
        &self,
        p: usize,
        material: &MaterialConstants<R>,
        gradient: &mut Gradient<R>,
        tensor: Option<Tensor<'_, R>>,
        strain: Option<&Matrix<R>>,
        walls: Option<&Walls<R>>,
        largest: &mut Largest<R>,
    ) -> Search<R> {
        let Press { constants, position, displacement, deformation, tally, corrects, sticks, resumes, shares } = *self;
        let (kept, rate) = bound_gradient(gradient, constants, tally);
        let liquid = material.model == LIQUID;
        viscosity(material, gradient, constants);
        let trace = gradient[0][0] + gradient[1][1] + gradient[2][2];
        let mut compliance = compliances(material, constants);
        if apart(material, position[p][3], trace, constants) {
            compliance[0] = R::of(0.0);
        }
        if let Some(strain) = strain {
            compliance[1] *= softening(material, strain, &kept);
        }
        let limit = if liquid { most_of_liquid(position[p][3], compliance) } else { R::of(MAX_SHEAR) };
        let bears = if shares && liquid && compliance[0] > R::of(0.0) {
            compliance_with_block(material, constants)
        } else {
            compliance[0]
        };
        let lasting = brought(pressure_of(gradient), bears, limit);
        let [ahead, pressure] = parted(lasting, R::of(0.0), resumes);
        *pressure_mut(gradient) = pressure;
        let corrects_it = corrects && (sticks || !liquid);
        let correction = if corrects_it { correction_of(&deformation[p]) } else { [R::of(0.0); 3] };
        let wrong = strain.map(|strain| {
            let kept = if corrects { corrected(&kept, correction) } else { kept };
            let (mean, shear) = solid_error(weights(material, constants), strain, &kept);
            (mean, shear.times(elastic_share(material, constants, compliance[1])))
        });
        let mut size = lasting.abs();
        // For a liquid only the viscous stress is corrected.
        let pushes = if liquid { R::of(0.0) } else { pressure };
        let mut brings = Symmetric { diagonal: [pushes; 3], ..Symmetric::default() };
        let factors = factors_beside(walls.filter(|_| compliance[1] <= R::of(0.0)), position[p], beside_of(gradient));
        (0..3).for_each(|c| gradient[c][c] += pressure * factors[c]);
        if let Some((shear, deviator)) = tensor {
            let stress = Symmetric::of_lanes(deviator);
            let lasting = turned(stress, lasting, &kept, compliance[1]);
            size += lasting.square().sqrt();
            let [ahead, stress] = parted(lasting, Symmetric::default(), resumes);
            stress.store(deviator);
            brings = brings.plus(&stress);
            add_columns(gradient, &stress.columns());
            let viscous = sticks && liquid && compliance[1] > R::of(0.0);
            let of_liquid = if viscous { turned_strain(&deformation[p], constants) } else { Symmetric::default() };
            let residual = wrong.map_or(of_liquid, |(_, w)| w).minus(&stress.times(compliance[1]));
            largest.note_compliant(compliance[1], residual.square().sqrt());
            *shear = Shear { residual, direction: ahead, compliance: compliance[1], correction, ..Shear::default() };
        }
        if corrects_it {
            add_columns(gradient, &missed(&brings.columns(), correction));
        }
        let wanted = wrong.map_or_else(|| compression(position[p][3], compliance[0]), |(mean, _)| mean);
        let residual = wanted - compliance[0] * pressure;
        largest.note_compliant(compliance[0], residual.abs());
        largest.stress = largest.stress.max(size);
        largest.rate = largest.rate.max(rate);
        largest.motion = largest.motion.max(motion::largest(displacement[p], gradient, constants));
        Search { residual, direction: ahead, compliance: compliance[0], ..Search::default() }
    }
}

impl<R: Real> Largest<R> {
    /// Notes that a particle takes part in the solve with this compliance, and the strain that it is to take back.
    #[inline(always)]
    fn note_compliant(&mut self, compliance: R, residual: R) {
        if compliance > R::of(0.0) {
            self.compliance = self.compliance.max(compliance);
            self.response = self.response.max(response(compliance));
            self.residual = self.residual.max(residual);
        }
    }
}

/// Adds to the columns of a gradient.
#[inline(always)]
fn add_columns<R: Real>(gradient: &mut Gradient<R>, added: &Matrix<R>) {
    for (to, added) in gradient.iter_mut().zip(added) {
        (0..3).for_each(|c| to[c] += added[c]);
    }
}

/// The strains of up to four particles.
struct Strain<'a, R>(&'a [Gradient<R>]);

impl<R: Real> Work<&mut [Matrix<R>; 4]> for Strain<'_, R> {
    #[inline(always)]
    fn on(&self, _: Option<Wide>, strains: &mut [Matrix<R>; 4]) {
        *strains = entries::<R>(solid::strain::<R>(&matrices::<R>(self.0).0));
    }
}

/// The stress that a particle carries over, as the first direction of search and as the part that acts from the start.
#[inline(always)]
fn parted<T>(lasting: T, none: T, resumes: bool) -> [T; 2] {
    if resumes { [lasting, none] } else { [none, lasting] }
}

/// The divergence that takes back a liquid's error in volume: of its compression as 1 − J, which a step with the
/// divergence tr D changes by J tr D, so that no more is stored than the step accounts for.
#[inline(always)]
fn compression<R: Real>(ratio: R, compliance: R) -> R {
    let bound = R::of(MAX_ERROR) + R::of(MAX_LOAD) * compliance;
    bounded(R::of(1.0) - ratio, bound)
}

/// The largest divergence that a liquid's pressure may correspond to. If it were less than what is taken back of the
/// error in volume, the iterations would have to find the rest anew in each step. Where viscosity is solved for it is
/// not raised: thick liquids in corners, where held nodes leave them no freedom, would not come to rest.
#[inline(always)]
fn most_of_liquid<R: Real>(ratio: R, [compliance, to_shear]: [R; 2]) -> R {
    let least = R::of(MAX_DIVERGENCE);
    if to_shear > R::of(0.0) { least } else { least.max(compression(ratio, compliance)) }
}

/// The strain of a solid to be taken back, as divergence and deviator, plus the share of the last step's change of it;
/// see [`weights`].
#[inline(always)]
fn solid_error<R: Real>([later, before]: [R; 2], strain: &Matrix<R>, d: &Matrix<R>) -> (R, Symmetric<R>) {
    let now = R::of(1.0) / later;
    let change = Symmetric::deviator(d).times(before);
    let mean = before * (d[0][0] + d[1][1] + d[2][2]) - now * (strain[0][0] + strain[1][1] + strain[2][2]);
    (mean, change.minus(&Symmetric::deviator(strain).times(now)))
}

/// How many times softer to shear yielding matter counts: if it goes on as in the step before, its stress stays on the
/// yield surface.
#[inline(always)]
fn softening<R: Real>(m: &MaterialConstants<R>, strain: &Matrix<R>, d: &Matrix<R>) -> R {
    let one = R::of(1.0);
    if m.model != VISCOPLASTIC {
        return one;
    }
    let trial = Symmetric::deviator(strain).plus(&Symmetric::deviator(d)).square().sqrt();
    (trial * (one / m.yield_limit.max(R::of(1e-6)))).max(one).min(R::of(MAX_SOFTENING))
}

/// Whether a particle has come apart and does not close up: it carries no pressure.
#[inline(always)]
fn apart<R: Real>(m: &MaterialConstants<R>, ratio: R, trace: R, constants: &Constants<R>) -> bool {
    m.model == LIQUID && ratio + ratio * trace > constants.tension_limit
}

/// The pressure that a particle carries over, bounded.
#[inline(always)]
fn brought<R: Real>(pressure: R, compliance: R, limit: R) -> R {
    if compliance <= R::of(0.0) {
        return R::of(0.0);
    }
    let most = (limit * (R::of(1.0) / compliance)).min(R::of(MAX_PRESSURE));
    pressure.max(-most).min(most)
}

/// The deviator of stress that a particle carries over, rotated with it. New particles, which have no pressure, and
/// matter that has come apart have none.
#[inline(always)]
fn turned<R: Real>(stress: Symmetric<R>, pressure: R, d: &Matrix<R>, compliance: R) -> Symmetric<R> {
    if compliance <= R::of(0.0) || pressure == R::of(0.0) {
        return Symmetric::default();
    }
    let most = (R::of(MAX_SHEAR) * (R::of(1.0) / compliance)).min(R::of(MAX_PRESSURE));
    stress.turned(d).within(most)
}
