//! Turns sums into displacements, adds gravity and the effect of tools, applies boundaries.

use super::collider_cull::touching;
use super::contact::{Friction, Near, STUCK, resolve_all};
use super::drag::braked;
use super::gap::{LIQUID_NEAR, Noted, PARTS, SAND_NEAR, VISCOPLASTIC_NEAR, near, parts};
use super::matter::{Matter, ON_SURFACE};
use super::motion::momentum_scale;
use super::seam::BESIDE_SEAM;
use super::tool::wielded;
use super::{Kernel, load};
use crate::bins::{EDGE, NODES, origin};
use crate::cpu::constants::{ColliderConstants, Constants, ToolConstants};
use crate::cpu::par;
use crate::cpu::state::{Block, CpuState, Tally};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::load::Running;
use crate::math::kernel::KERNEL_REACH;
use crate::math::linear::{add, dot};
use crate::math::real::{Lanes, Real};
use crate::math::wide::{Wide, Work, widely};
use std::sync::atomic::Ordering;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Colliders).with_colliders(),
        read(Slot::Blocks),
        read(Slot::Cull).with_colliders(),
        write(Slot::Grid),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
        read(Slot::Tools).with_tools(),
        read(Slot::Materials).with_sticking(),
        write(Slot::Force).with_repeats(),
    ],
    over: Over::Nodes,
    source: include_str!("../../shaders/stages/grid_update.wgsl"),
};

/// The [`Bodies`] of a state. Borrows its fields one by one, since others change meanwhile.
macro_rules! bodies {
    ($s:expr) => {
        $crate::stages::grid_update::Bodies {
            constants: &$s.constants,
            blocks: &$s.blocks,
            colliders: &$s.colliders,
            cull: &$s.cull,
            words: $s.cull_words,
            gaps: &$s.gaps,
            viscosity: $s.wall_viscosity(),
            liquid: $s.features.liquid,
            at_rest: $s.constants.at_rest(),
        }
    };
}
pub(super) use bodies;

pub(crate) fn run<R: Real>(s: &mut CpuState<R>, first: bool) {
    let free = Free {
        constants: &s.constants,
        largest_motion: s.largest_motion,
        pressed: false,
        first,
        tools: &s.tools,
        tally: &s.tally,
    };
    let bodies = bodies!(s);
    let work = Update { free, bodies, loads: &s.loads, load_scale: R::V::all(s.constants.load_scale) };
    par::each_block(&mut s.grid[..], |b, stored| widely(&work, (b, stored)));
}

/// Updates the nodes of a block.
struct Update<'a, R: Real> {
    free: Free<'a, R>,
    bodies: Bodies<'a, R>,
    loads: &'a [Running],
    load_scale: R::V,
}

impl<R: Real> Work<(usize, &mut [[R::Sum; 4]; NODES])> for Update<'_, R> {
    #[inline(always)]
    fn on(&self, _: Option<Wide>, (b, stored): (usize, &mut [[R::Sum; 4]; NODES])) {
        let Update { free, bodies, loads, load_scale } = self;
        if bodies.blocks[b].is_idle() {
            return;
        }
        let mut nodes = free.nodes(bodies.origin(b), stored);
        bodies.resolve(b, &mut nodes, Friction::Full, |touch| touch.load(loads, *load_scale));
        bodies.blocks[b].hold(&mut nodes);
        for (stored, [x, y, z, mass]) in stored.iter_mut().zip(nodes) {
            *stored = [x.stored(), y.stored(), z.stored(), mass.stored()];
        }
    }
}

/// The bodies that a block's nodes can meet.
pub(super) struct Bodies<'a, R: Real> {
    pub constants: &'a Constants<R>,
    pub blocks: &'a [Block],
    pub colliders: &'a [ColliderConstants<R::V>],
    pub cull: &'a [u32],
    pub words: usize,
    /// Empty where the stage `gap` is not planned.
    pub gaps: &'a [Noted],
    /// The viscosity with which bodies drag, where viscous liquids stick to them.
    pub viscosity: Option<R>,
    /// There are liquids.
    pub liquid: bool,
    /// The motion that counts as rest beside edges.
    pub at_rest: R,
}

/// The effect of a body on a row of four nodes.
pub(super) struct Touch<'a, R: Real> {
    /// Index of the body.
    pub body: usize,
    pub collider: &'a ColliderConstants<R::V>,
    /// The row's first node.
    pub first: usize,
    pub at: [R::V; 3],
    pub before: [R::V; 3],
    pub after: [R::V; 3],
    /// Which of the nodes stick to it.
    pub stuck: R::V,
    /// See [`Resolved::more`](super::contact::Resolved::more).
    pub more: bool,
    /// Where it only drags: the share that it removes, and its normal.
    pub braked: Option<Taken<R::V>>,
    pub mass: R::V,
}

impl<R: Real> Touch<'_, R> {
    /// Adds the effect to the body's load, where that is measured.
    #[inline(always)]
    pub fn load(&self, loads: &[Running], scale: R::V) {
        load::note::<R>(loads, self.collider, self.at, self.before, self.after, self.mass * scale);
    }
}

impl<R: Real> Bodies<'_, R> {
    /// A block's first node.
    #[inline(always)]
    pub fn origin(&self, block: usize) -> [u32; 3] {
        origin(self.blocks[block].key)
    }

    /// Position of a node of a block.
    pub fn node_position(&self, block: usize, node: usize) -> [R; 3] {
        let steps = [node % EDGE, node / EDGE % EDGE, node / EDGE / EDGE];
        let origin = self.origin(block);
        [0, 1, 2].map(|axis| R::of(f64::from(origin[axis])) + R::of(steps[axis] as f64))
    }

    /// How full nodes of this mass are, in cells at rest, if those on the domain's sides counted for whole cells.
    #[inline(always)]
    fn fill(&self, at: [R::V; 3], mass: R::V) -> R::V {
        let Constants { lo, hi, lightest, .. } = self.constants;
        let mut fill = mass / R::V::all(*lightest);
        for (a, at) in at.into_iter().enumerate() {
            let below = at.below(R::V::all(lo[a]));
            let beyond = below.pick(below, R::V::all(hi[a]).below(at));
            fill = beyond.pick(fill + fill, fill);
        }
        fill
    }

    /// What is recorded at four nodes of a block: what their matter would record without a gap, its gap in parts of a
    /// cell, and the axis along which it lies before a box.
    #[inline(always)]
    fn noted(&self, block: usize, first: usize) -> [R::V; 3] {
        let numbers = self.gaps.get(block).map_or([[LIQUID_NEAR; 4], [0; 4], [3; 4]], |noted| {
            let gaps = [0, 1, 2, 3].map(|n| noted.gaps[first + n].load(Ordering::Relaxed));
            [gaps.map(near), gaps.map(parts), [0, 1, 2, 3].map(|n| noted.axis(first + n))]
        });
        numbers.map(|number| R::V::from4(number.map(|number| R::of(f64::from(number)))))
    }

    /// The matter at four nodes.
    #[inline(always)]
    fn matter(&self, row: Row<R::V>) -> Matter<R::V> {
        let Row { at, mass, noted: [near, parts, axis], .. } = row;
        let [zero, on, stuck] = [0.0, ON_SURFACE, STUCK].map(|x| R::V::all(R::of(x)));
        let [liquid, sand, viscoplastic] =
            [LIQUID_NEAR, SAND_NEAR, VISCOPLASTIC_NEAR].map(|near| R::V::all(R::of(f64::from(near))));
        let gap = parts * R::V::all(R::of(1.0 / PARTS));
        // Less far where matter has still to come nearer: it touches within that, however little presses on it.
        let near_enough = (stuck - gap).max(on);
        // Liquids then stick by their viscosity.
        let sticky = if self.viscosity.is_some() { sand.at_most(near).pick(near_enough, on) } else { near_enough };
        let yields = near.at_most(viscoplastic).and(sand.below(near));
        // Where there is no liquid, what comes apart is sand.
        let loose = if self.liquid { sand.at_most(near) } else { zero.at_most(near) };
        Matter {
            fill: self.fill(at, mass),
            gap,
            sticky,
            parts: near.at_most(liquid),
            yields,
            grips: near.at_most(viscoplastic).and(loose),
            axis,
            at_rest: R::V::all(self.at_rest),
        }
    }

    /// Displacements of four nodes, kept out of the bodies in reach.
    #[inline(always)]
    fn contact(
        &self,
        near: &[Near<R>],
        row: Row<R::V>,
        u: [R::V; 3],
        friction: Friction,
        mut note: impl FnMut(Touch<'_, R>),
    ) -> [R::V; 3] {
        let Row { first, at, mass, .. } = row;
        resolve_all::<R>(self.colliders, near, at, u, friction, Some(self.matter(row)), |body, before, kept| {
            note(Touch {
                body,
                collider: &self.colliders[body],
                first,
                at,
                before,
                after: kept.u,
                stuck: kept.stuck,
                more: kept.more,
                braked: None,
                mass,
            });
        })
    }

    /// The same, with the drag of bodies that viscous liquids stick to. Nodes that this pushes into another body are
    /// kept out once more.
    #[inline(never)]
    fn contact_and_drag(
        &self,
        near: &[Near<R>],
        row: Row<R::V>,
        u: [R::V; 3],
        friction: Friction,
        note: &mut dyn FnMut(Touch<'_, R>),
    ) -> [R::V; 3] {
        let Row { first, at, mass, noted } = row;
        let u = self.contact(near, row, u, friction, &mut *note);
        let drag = |viscosity| braked::<R>(self.colliders, near, at, u, viscosity);
        let Some(braked) = self.viscosity.and_then(drag) else { return u };
        let zero = R::V::all(R::of(0.0));
        let liquid = noted[0].at_most(zero).and(zero.below(braked.share));
        for (i, near) in near.iter().enumerate() {
            let here = braked.body.map(|body| R::of(f64::from(u8::from(body == i))));
            let here = liquid.and(zero.below(R::V::from4(here)));
            if here.any() {
                let after = [0, 1, 2].map(|a| here.pick(braked.u[a], u[a]));
                let taken = Some((here.pick(braked.share, zero), braked.normal));
                let (body, collider) = (near.collider, &self.colliders[near.collider]);
                note(Touch {
                    body,
                    collider,
                    first,
                    at,
                    before: u,
                    after,
                    stuck: zero,
                    more: false,
                    braked: taken,
                    mass,
                });
            }
        }
        let slower = [0, 1, 2].map(|a| liquid.pick(braked.u[a], u[a]));
        let kept = self.contact(near, row, slower, friction, |touch| {
            let after = [0, 1, 2].map(|a| liquid.pick(touch.after[a], touch.before[a]));
            note(Touch { after, stuck: touch.stuck.and(liquid), ..touch });
        });
        [0, 1, 2].map(|a| liquid.pick(kept[a], u[a]))
    }

    /// Keeps a block's nodes out of the bodies in reach, row by row, and calls `note` with the bodies' effects. Nodes
    /// without mass stay as they are.
    #[inline(always)]
    pub fn resolve(
        &self,
        block: usize,
        nodes: &mut [[R; 4]; NODES],
        friction: Friction,
        mut note: impl FnMut(Touch<'_, R>),
    ) {
        let square = |node: &[R; 4]| node[0] * node[0] + node[1] * node[1] + node[2] * node[2];
        let fastest = nodes.iter().map(square).fold(R::of(0.0), R::max);
        let masks = &self.cull[block * self.words..(block + 1) * self.words];
        let speed = fastest.sqrt() + R::of(BESIDE_SEAM);
        let reach = if self.viscosity.is_some() { speed.max(R::of(KERNEL_REACH)) } else { speed };
        let near = touching::<R>(self.colliders, masks, self.blocks[block].key, reach);
        if near.is_empty() {
            return;
        }
        let origin = self.origin(block);
        let zero = R::V::all(R::of(0.0));
        for (row, nodes) in nodes.as_chunks_mut::<EDGE>().0.iter_mut().enumerate() {
            let [ux, uy, uz, mass] = R::V::transposed(nodes.map(R::V::from4));
            let taking_part = zero.below(mass);
            if !taking_part.any() {
                continue;
            }
            let (first, at) = (row * EDGE, row_at::<R>(origin, row));
            let row = Row { first, at, mass, noted: self.noted(block, first) };
            let u = if self.viscosity.is_some() {
                self.contact_and_drag(&near, row, [ux, uy, uz], friction, &mut note)
            } else {
                self.contact(&near, row, [ux, uy, uz], friction, &mut note)
            };
            let [ux, uy, uz] = u.map(|c| taking_part.pick(c, zero));
            *nodes = R::V::transposed([ux, uy, uz, mass]).map(Lanes::to4);
        }
    }
}

/// Four nodes along x of a block.
#[derive(Clone, Copy)]
struct Row<V> {
    /// The first of them.
    first: usize,
    at: [V; 3],
    mass: V,
    /// See [`Bodies::noted`].
    noted: [V; 3],
}

/// The share of the motion along a body that it removes, and its normal.
pub(super) type Taken<V> = (V, [V; 3]);

/// Positions of the four nodes in a row of the block whose first node is `origin`.
#[inline(always)]
fn row_at<R: Real>(origin: [u32; 3], row: usize) -> [R::V; 3] {
    let [x, y, z] = origin.map(|c| R::of(f64::from(c)));
    let [j, k] = [row % EDGE, row / EDGE].map(|c| R::of(c as f64));
    [R::V::from4([0.0, 1.0, 2.0, 3.0].map(|i| x + R::of(i))), R::V::all(y + j), R::V::all(z + k)]
}

/// Turns sums into displacements, without boundaries.
pub(super) struct Free<'a, R: Real> {
    pub constants: &'a Constants<R>,
    /// The largest motion that particles bring, where it is known.
    pub largest_motion: Option<R>,
    /// Whether the sums contain pressures, which may make nodes faster than is allowed while the solve lasts.
    pub pressed: bool,
    /// Whether gravity and tools act.
    pub first: bool,
    pub tools: &'a [ToolConstants<R>],
    pub tally: &'a Tally,
}

impl<R: Real> Free<'_, R> {
    /// Displacement and mass of a block's nodes, the first at `origin`.
    #[inline(always)]
    pub fn nodes(&self, origin: [u32; 3], stored: &[[R::Sum; 4]; NODES]) -> [[R; 4]; NODES] {
        let scale = self.constants.mass_scale / momentum_scale(self.largest_motion, self.constants);
        let mut nodes = [[R::of(0.0); 4]; NODES];
        let mut saturated = 0;
        let rows = nodes.as_chunks_mut::<EDGE>().0.iter_mut().zip(stored.as_chunks::<EDGE>().0);
        for (row, (nodes, stored)) in rows.enumerate() {
            *nodes = self.row(stored, R::V::all(scale), || row_at::<R>(origin, row)).map(Lanes::to4);
            saturated += stored.iter().map(|sum| u32::from(R::saturated(sum[3]))).sum::<u32>();
        }
        Tally::add(&self.tally.saturated_nodes, saturated);
        nodes
    }

    /// For four nodes along x, at the positions `at`. Nodes without mass get 0.
    #[inline(always)]
    fn row(&self, stored: &[[R::Sum; 4]; EDGE], scale: R::V, at: impl Fn() -> [R::V; 3]) -> [R::V; EDGE] {
        let Free { constants, pressed, first, tools, .. } = *self;
        let zero = R::V::all(R::of(0.0));
        let [x, y, z, mass] = R::V::transposed(stored.map(R::dequantised));
        let taking_part = zero.below(mass);
        if !taking_part.any() {
            return [zero; EDGE];
        }
        let unit = scale / mass;
        let mut u = [x * unit, y * unit, z * unit];
        if first {
            let kick = constants.kick.map(R::V::all);
            u = add(u, kick);
            if !tools.is_empty() {
                u = wielded(tools, at(), u);
            }
        }
        if !pressed {
            u = slowed::<R>(u, constants);
        }
        let [x, y, z] = u.map(|c| taking_part.pick(c, zero));
        R::V::transposed([x, y, z, taking_part.pick(mass / R::V::all(constants.mass_scale), zero)])
    }
}

/// Displacements `u`; one that is longer than allowed is shortened to that length.
#[inline(always)]
pub(super) fn slowed<R: Real>(u: [R::V; 3], constants: &Constants<R>) -> [R::V; 3] {
    let length = dot(u, u);
    let bound = R::V::all(constants.max_displacement);
    let above = (bound * bound).below(length);
    if !above.any() {
        return u;
    }
    let factor = bound / length.sqrt();
    u.map(|c| above.pick(c * factor, c))
}
