//! Advances volume ratio and position, keeps particles out of bodies and inside the domain.

use super::believed::{BESIDE_SOLIDS, LOOSE};
use super::collider_cull::touching;
use super::contact::{FIXED, Friction, Near, distance_normal_after, resolve_all};
use super::correction::{corrected_gradient, correction, keep, kept, lacking};
use super::faces::{self, Face};
use super::grid_update::slowed;
use super::matter::CLEARANCE;
use super::room::{Room, SIGHT, room};
use super::solid::{self, Solids};
use super::sound::{sound, sound_lanes};
use super::walls::Walls;
use super::{Kernel, load};
use crate::bins::origin;
use crate::cpu::constants::{ColliderConstants, Constants, MaterialConstants};
use crate::cpu::gradient::{Gradient, beside_of_lanes, mass_of, material_of, note_beside};
use crate::cpu::lanes::{columns, entries, materials_of, matrices, store};
use crate::cpu::par;
use crate::cpu::state::{CpuState, ESCAPED, QUARANTINED, Tally};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::load::Running;
use crate::math::linear::{add, cross, dot};
use crate::math::real::{Lanes, Real};
use crate::math::wide::{Wide, Work, widely};
use crate::units::FIRST_BETWEEN;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        write(Slot::Position),
        write(Slot::Displacement),
        write(Slot::Gradient),
        read(Slot::Colliders).with_colliders(),
        read(Slot::Cull).with_colliders(),
        read(Slot::Order),
        read(Slot::Chunks),
        write(Slot::Counters),
        read(Slot::Materials).with_kinds(),
        write(Slot::Deformation).with_deformation(),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/integrate.wgsl"),
};

/// Margin by which the measured density may exceed the room before that counts as compression. A regular lattice of
/// particles reads up to 2 % too dense between nodes; that must not push it apart in free flight.
pub(crate) const MEASURE_MARGIN: f64 = 0.02;

/// Margin by which the measured density may fall short of the room before matter counts as having come apart.
pub(crate) const SHORTFALL: f64 = 0.03;

/// How fast sand and viscoplastic matter follow a deficit, relative to liquids. Sheared matter is loose in places for
/// moments without a gap; if it followed faster, it would give way sooner.
pub(crate) const LOOSENING: f64 = 0.25;

/// The share of what loose matter lacks that bodies and walls must not account for.
pub(crate) const OF_ITSELF: f64 = 0.5;

/// The volume ratio below which loose matter is under pressure. A few roundings count as none; the weight of one cell
/// of liquid compresses by about 4·10⁻⁵ in steps of 1/300 s, where its block is stiffest.
pub(crate) const UNDER_PRESSURE: f64 = 1.0 - 2e-5;

/// Smallest and largest volume ratio that a particle stores.
pub(crate) const VOLUME_RATIO: [f64; 2] = [0.1, 4.0];

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let walls = Walls::of(s);
    // Worlds that need no deformation gradients have none.
    let deformation = (!s.deformation.is_empty()).then_some(&mut s.deformation[..]);
    let particles = ((&mut s.position[..], &mut s.displacement[..]), (&mut s.gradient[..], deformation));
    let work = Integrate {
        constants: &s.constants,
        colliders: &s.colliders,
        materials: &s.materials,
        loads: &s.loads,
        tally: &s.tally,
        corrects: s.features.corrects,
        sticks: s.features.sticks,
        periodic: s.features.periodic,
        walls,
        largest: par::Largest::new(),
    };
    let (cull, words) = (&s.cull, s.cull_words);
    par::block_particles(&s.blocks[..s.occupied], particles, &|b, block, parts| {
        widely(&work, (block.key, &cull[b * words..(b + 1) * words], parts));
    });
    [s.largest_square] = work.largest.take();
}

/// Advances the particles of a block.
struct Integrate<'a, R: Real> {
    constants: &'a Constants<R>,
    colliders: &'a [ColliderConstants<R::V>],
    materials: &'a [MaterialConstants<R>],
    loads: &'a [Running],
    tally: &'a Tally,
    corrects: bool,
    sticks: bool,
    periodic: bool,
    walls: Walls<R>,
    largest: par::Largest<1>,
}

/// Positions, displacements, gradients and deformation gradients of a block's particles.
type Parts<'a, R> = ((&'a mut [[R; 4]], &'a mut [[R; 4]]), (&'a mut [Gradient<R>], Option<&'a mut [Gradient<R>]>));

impl<R: Real> Work<(u32, &[u32], Parts<'_, R>)> for Integrate<'_, R> {
    #[inline(always)]
    fn on(&self, _: Option<Wide>, (key, masks, parts): (u32, &[u32], Parts<'_, R>)) {
        let Integrate { constants, colliders, materials, loads, corrects, sticks, .. } = *self;
        let ((position, displacement), (gradient, mut deformation)) = parts;
        let model = |gradient: &Gradient<R>| materials[material_of(gradient)].model;
        if let Some(deformation) = deformation.as_deref().filter(|_| sticks) {
            let particles = position.iter().zip(&mut *displacement).zip(&mut *gradient).zip(deformation);
            for (((x, u), d), wall) in particles.filter(|(((x, u), d), _)| sound(x, u, d) && model(d) == solid::LIQUID)
            {
                let Some(lacking) = lacking(d, wall, constants) else { continue };
                (0..3).for_each(|a| u[a] += lacking.u[a]);
                (0..3).for_each(|b| (0..3).for_each(|a| d[b][a] += lacking.d[b][a]));
                if let Some(body) = colliders.get(lacking.body) {
                    load::note_lacking(loads, body, *x, &lacking.u, &lacking.d, mass_of(d) * constants.load_scale);
                }
            }
        }
        let walls = self.walls.beside(origin(key));
        let walls = walls.as_ref();
        // A particle whose state is not finite is quarantined before it can touch anything.
        let fastest = displacement.iter().map(|u| u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).fold(R::of(0.0), R::max);
        let speed = fastest.sqrt().min(constants.max_displacement);
        // Bodies that particles may touch or come to lie before, or that may occlude their kernels.
        let ahead = if self.walls.faces { speed + R::of(1.0) } else { speed };
        let near = touching::<R>(colliders, masks, key, ahead.max(R::of(SIGHT)));
        let faces =
            if self.walls.faces { faces::of_block(origin(key), constants, colliders, &near) } else { Vec::new() };
        // All bodies that the block may touch, wherever its particles move.
        let holding = if corrects { touching::<R>(colliders, masks, key, R::of(f32::MAX.into())) } else { Vec::new() };
        let fours = position.chunks_mut(LANES).zip(displacement.chunks_mut(LANES)).zip(gradient.chunks_mut(LANES));
        for (i, ((position, displacement), gradient)) in fours.enumerate() {
            let forms = deformation.as_deref_mut().map(|all| {
                let deformation = &mut all[i * LANES..][..gradient.len()];
                Forms { deformation, materials, corrects, sticks, colliders, holding: &holding }
            });
            self.four((position, displacement), gradient, forms, walls, &near);
            if self.walls.faces {
                note_faces(position, gradient, &faces);
            }
            if self.periodic {
                position.iter_mut().for_each(|x| fold(x, constants));
            }
        }
        self.largest.note([largest_square(position, displacement)]);
    }
}

/// Square of the largest displacement of the particles that are in the simulation.
pub(crate) fn largest_square<R: Real>(position: &[[R; 4]], displacement: &[[R; 4]]) -> R {
    let alive = position.iter().zip(displacement).filter(|(x, _)| x[3] > R::of(0.0));
    alive.map(|(_, &[x, y, z, _])| dot([x, y, z], [x, y, z])).fold(R::of(0.0), R::max)
}

/// Notes before which of these faces the particles have come that are in the simulation.
#[inline(always)]
fn note_faces<R: Real>(position: &[[R; 4]], gradient: &mut [Gradient<R>], faces: &[Face<R>]) {
    for (&[x, y, z, ratio], gradient) in position.iter().zip(gradient) {
        if ratio != R::of(QUARANTINED) {
            let beside = if faces.is_empty() { R::of(0.0) } else { faces::beside([x, y, z], faces) };
            note_beside(gradient, beside);
        }
    }
}

const LANES: usize = 4;

/// Up to four particles' deformation gradients, and what affects them.
struct Forms<'a, R: Real> {
    deformation: &'a mut [Gradient<R>],
    materials: &'a [MaterialConstants<R>],
    corrects: bool,
    sticks: bool,
    colliders: &'a [ColliderConstants<R::V>],
    /// The bodies that may hold matter.
    holding: &'a [Near<R>],
}

impl<R: Real> Forms<'_, R> {
    /// Advances the deformation gradients of the particles that are `sound` and move `to` these places. Returns the
    /// volume ratio of each solid particle, and whether it was clamped.
    #[inline(always)]
    fn advance(
        self,
        gradient: &[Gradient<R>],
        sound: [bool; LANES],
        around: &solid::Around<R::V>,
        to: &[[R; 4]; LANES],
    ) -> [Option<(R, bool)>; LANES] {
        let Forms { deformation, materials, corrects, sticks, colliders, holding } = self;
        let of = materials_of(gradient, materials);
        let solids = of.map(|m| m.model != solid::LIQUID);
        let corrected = of.map(|m| match m.model {
            solid::LIQUID => sticks,
            solid::SAND => false,
            _ => corrects,
        });
        let mut ratios = [None; LANES];
        if solids.contains(&true) {
            let mut seen = [Gradient::default(); LANES];
            for (n, (seen, gradient)) in seen.iter_mut().zip(gradient).enumerate() {
                let hidden = corrected[n] && solids[n];
                *seen = if hidden { corrected_gradient(gradient, kept(&deformation[n])) } else { *gradient };
            }
            let (f, slack) = matrices::<R>(deformation);
            let (seen, _) = matrices::<R>(&seen[..gradient.len()]);
            let advanced = solid::advance::<R>(&Solids::of(of), (&f, slack), &seen, around);
            let (f, slack) = (entries::<R>(advanced.f), advanced.slack.to4());
            let (ratio, clamped) = (advanced.volume_ratio.to4(), advanced.clamped.lanes());
            for (n, to) in deformation.iter_mut().enumerate().filter(|(n, _)| sound[*n] && solids[*n]) {
                store(to, f[n]);
                to[0][3] = slack[n];
                ratios[n] = Some((ratio[n], clamped[n]));
            }
        }
        for (n, deformation) in deformation.iter_mut().enumerate().filter(|(n, _)| sound[*n] && corrected[*n]) {
            let [x, y, z, _] = to[n];
            keep(deformation, !solids[n], correction([x, y, z], !solids[n], colliders, holding));
        }
        ratios
    }
}

/// What the measure of the volume makes of four particles.
struct Measured<R: Real> {
    /// The share of the space around them that matter fills.
    fraction: R::V,
    /// Of liquids.
    ratio: R::V,
    /// Which of these would be smaller than particles can store.
    squeezed: [bool; LANES],
    around: solid::Around<R::V>,
}

impl<R: Real> Integrate<'_, R> {
    /// What becomes of the volume ratios that particles carry: beside what their gradients change, the density moves
    /// towards the measured one. `noted` is the volume fraction around them, with what is believed of it.
    #[inline(always)]
    fn measured(&self, carried: R::V, noted: R::V, room: &Room<R::V>, change: R::V) -> Measured<R> {
        let constants = self.constants;
        let zero = R::V::all(R::of(0.0));
        let [one, beside, loose] = [1.0, BESIDE_SOLIDS, LOOSE].map(|x| R::V::all(R::of(x)));
        let believed = noted.below(zero);
        let is_loose = noted.at_most(zero - loose);
        let beside_solids = noted.at_most(zero - beside);
        let fraction = noted.abs() - is_loose.pick(loose, beside_solids.pick(beside, zero));
        let most = room.most + R::V::all(R::of(MEASURE_MARGIN));
        let more = (fraction * carried - most).max(zero);
        let less = (fraction * carried - (room.least - R::V::all(R::of(SHORTFALL)))).min(zero);
        // Beside solids liquids draw in until gaps are filled, and loose ones under pressure do.
        let tension = R::V::all(constants.tension_limit);
        let loose_bound = carried.below(R::V::all(R::of(UNDER_PRESSURE))).pick(tension, one);
        let bound = carried.max(is_loose.pick(loose_bound, beside_solids.pick(tension, one)));
        let of_itself = (R::V::all(R::of(OF_ITSELF)) * (one - fraction * carried)).at_most(zero - less);
        let lacking = is_loose.pick(of_itself.pick(less, zero), believed.pick(less, zero));
        let ratio = volume_ratio::<R>(carried, more + lacking, bound, constants) * change;
        let loosened = -lacking * R::V::all(constants.volume_gain * R::of(LOOSENING));
        let [smallest, largest] = VOLUME_RATIO.map(|bound| R::V::all(R::of(bound)));
        Measured {
            fraction,
            ratio: ratio.max(smallest).min(largest),
            squeezed: ratio.below(smallest).lanes(),
            around: solid::Around { dense: most.below(fraction), loosened },
        }
    }

    /// The motion that contact leaves of `u` to particles of this mass, and where it takes them, pushed out of bodies at
    /// their places at the end of the step. The push is bounded and never becomes velocity.
    #[inline(always)]
    fn moved(
        &self,
        at: [R::V; 3],
        u: [R::V; 3],
        mass: impl Fn() -> [R; 4],
        near: &[Near<R>],
    ) -> ([R::V; 3], [R::V; 3]) {
        let Integrate { constants, colliders, loads, .. } = *self;
        let mut motion = slowed::<R>(u, constants);
        let speed = dot(motion, motion).sqrt();
        if !near.is_empty() {
            // The grid has applied the friction of what it has stopped. What is stopped here has its own: single grains
            // before a body between nodes are borne by it alone.
            motion = resolve_all::<R>(colliders, near, at, motion, Friction::Rubbing, None, |c, before, kept| {
                let weight = R::V::from4(mass()) * R::V::all(constants.load_scale);
                load::note::<R>(loads, &colliders[c], at, before, kept.u, weight);
            });
        }
        if !colliders.is_empty() {
            // Contact may have made it longer. Where there was none, as on devices: shortening twice rounds twice.
            motion = slowed::<R>(motion, constants);
        }
        let mut to = add(at, motion);
        for near in near {
            // Clamped matter stays where it is.
            if colliders[near.collider].friction.to4()[0] >= R::of(FIXED) || !near.holds(at, speed, to) {
                continue;
            }
            let (distance, normal) = distance_normal_after::<R>(&colliders[near.collider], to);
            let out = (R::V::all(R::of(CLEARANCE)) - distance).min(R::V::all(constants.push_out));
            let inside = distance.below(R::V::all(R::of(0.0)));
            to = [0, 1, 2].map(|a| inside.pick(to[a] + normal[a] * out, to[a]));
        }
        (motion, to)
    }

    /// Advances up to four particles. `forms` is `None` in worlds without deformation gradients, `walls` in blocks that
    /// are not beside them.
    #[inline(always)]
    fn four(
        &self,
        (position, displacement): (&mut [[R; 4]], &mut [[R; 4]]),
        gradient: &[Gradient<R>],
        forms: Option<Forms<'_, R>>,
        walls: Option<&Walls<R>>,
        near: &[Near<R>],
    ) {
        let Integrate { constants, colliders, materials, tally, .. } = *self;
        // Lanes beyond the last particle repeat it; their results are dropped.
        let last = position.len() - 1;
        let [i, j, k, l] = [0, 1, 2, 3].map(|n: usize| n.min(last));
        let by_lanes = |v: &[[R; 4]]| R::V::transposed([v[i], v[j], v[k], v[l]].map(R::V::from4));
        let columns = columns::<R>(gradient);
        let (of_position, of_displacement) = (by_lanes(position), by_lanes(displacement));
        let sound = sound_lanes::<R>([of_position, of_displacement, columns[0], columns[1], columns[2]]);
        let [x, y, z, carried] = of_position;
        let mut seen = columns;
        if let Some(walls) = walls {
            let zero = R::V::all(R::of(0.0));
            let thick = zero.below(R::V::from4(materials_of(gradient, materials).map(|m| m.solved_viscosity)));
            let beside = beside_of_lanes::<R>(&columns);
            for (a, x) in [x, y, z].into_iter().enumerate() {
                seen[a][a] = thick.pick(seen[a][a], seen[a][a] * walls.along(a, x, beside));
            }
        }
        let change = volume_change::<R>(seen);
        let [ux, uy, uz, noted] = of_displacement;
        let at = [x, y, z];
        let Measured { fraction, ratio, squeezed, around } =
            self.measured(carried, noted, &room::<R>(at, colliders, near, constants), change);
        // Without lanes that only repeat, and particles that are about to be quarantined.
        let mass = || [0, 1, 2, 3].map(|n| if n <= last && sound[n] { mass_of(&gradient[n]) } else { R::of(0.0) });
        let (motion, to) = self.moved(at, [ux, uy, uz], mass, near);

        let fraction = fraction.to4();
        let motion = R::V::transposed([motion[0], motion[1], motion[2], R::V::from4(fraction)]).map(Lanes::to4);
        let [lo, hi] = [constants.lo, constants.hi].map(|bound| bound.map(R::V::all));
        let placed = [to[0].max(lo[0]).min(hi[0]), to[1].max(lo[1]).min(hi[1]), to[2].max(lo[2]).min(hi[2])];
        let to = R::V::transposed([to[0], to[1], to[2], ratio]).map(Lanes::to4);
        let placed = R::V::transposed([placed[0], placed[1], placed[2], ratio]).map(Lanes::to4);
        let solid = match forms {
            Some(forms) => forms.advance(gradient, sound, &around, &placed),
            None => Default::default(),
        };
        for n in 0..=last {
            if !sound[n] {
                position[n][3] = R::of(QUARANTINED);
                Tally::add(&tally.quarantined, 1);
                continue;
            }
            let [x, y, z, ratio] = placed[n];
            let (ratio, clamped) =
                solid[n].map_or((ratio, squeezed[n]), |(ratio, clamped)| (remembered(ratio), clamped));
            if clamped {
                Tally::add(&tally.strain_clamped, 1);
            }
            displacement[n] = motion[n];
            position[n] = [x, y, z, ratio];
            if constants.open_sides != 0 && escapes(to[n], constants) {
                position[n][3] = R::of(ESCAPED);
                Tally::add(&tally.escaped, 1);
            }
        }
    }
}

/// The carried ratio, with its density moved towards the measured one by the `excess` over the room, up to a bound.
/// Matter that has come apart is relieved of pressure; it begins to pull only where the bound is above 1.
#[inline(always)]
fn volume_ratio<R: Real>(carried: R::V, excess: R::V, bound: R::V, constants: &Constants<R>) -> R::V {
    let one = R::V::all(R::of(1.0));
    (carried * (one / (one + R::V::all(constants.volume_gain) * excess))).min(bound)
}

/// `det(1 + D)` of gradients by columns.
#[inline(always)]
fn volume_change<R: Real>([[xx, xy, xz, _], [yx, yy, yz, _], [zx, zy, zz, _]]: [[R::V; 4]; 3]) -> R::V {
    let one = R::V::all(R::of(1.0));
    dot([one + xx, xy, xz], cross([yx, one + yy, yz], [zx, zy, one + zz]))
}

/// A volume ratio within the range that a particle stores.
#[inline(always)]
fn remembered<R: Real>(ratio: R) -> R {
    ratio.max(R::of(VOLUME_RATIO[0])).min(R::of(VOLUME_RATIO[1]))
}

/// Moves a particle to the same place between periodic sides.
#[inline(always)]
fn fold<R: Real>(x: &mut [R; 4], constants: &Constants<R>) {
    let first = R::of(FIRST_BETWEEN);
    for (x, period) in x.iter_mut().zip(constants.period).filter(|(_, period)| *period > R::of(0.0)) {
        let end = first + period;
        if *x < first {
            let up = *x + period;
            // Rounding may lead to the end itself, which is the beginning.
            *x = if up >= end { first } else { up };
        } else if *x >= end {
            *x -= period;
        }
    }
}

/// Whether `x` lies beyond an open side.
#[inline(always)]
fn escapes<R: Real>(x: [R; 4], constants: &Constants<R>) -> bool {
    (0..3).any(|a| {
        let sides = constants.open_sides >> (2 * a);
        (sides & 1 != 0 && x[a] < constants.lo[a]) || (sides & 2 != 0 && x[a] > constants.hi[a])
    })
}
