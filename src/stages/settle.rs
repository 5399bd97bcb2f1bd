//! Adds the effect of the stresses found to the nodes' displacements, and applies boundaries to them.

use super::Kernel;
use super::contact::Friction;
use super::grid_update::{Bodies, bodies};
use super::load;
use super::predict::free;
use crate::bins::{EDGE, NODES};
use crate::cpu::constants::Constants;
use crate::cpu::par;
use crate::cpu::solve::Held;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::load::{NONE, Running};
use crate::math::linear::{add, dot, scale, sub};
use crate::math::real::{Lanes, Real};
use crate::math::wide::{Wide, Work, widely};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Colliders).with_colliders(),
        read(Slot::Blocks),
        read(Slot::Cull).with_colliders(),
        write(Slot::Grid),
        read(Slot::Held),
        write(Slot::Force),
        read(Slot::Solve),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
        read(Slot::Materials).with_sticking(),
    ],
    over: Over::Nodes,
    source: include_str!("../../shaders/stages/settle.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let bodies = bodies!(s);
    let work = Settle {
        constants: &s.constants,
        bodies,
        held: &s.held,
        unit: R::of(1.0) / s.solve.force_scale(&s.constants, true),
        loads: &s.loads,
        load_scale: R::V::all(s.constants.load_scale),
    };
    let nodes = (&mut s.grid[..], &mut s.force[..]);
    par::each_block(nodes, |b, (stored, force)| widely(&work, (b, stored, force)));
}

/// Updates the nodes of a block.
struct Settle<'a, R: Real> {
    constants: &'a Constants<R>,
    bodies: Bodies<'a, R>,
    held: &'a [[Held<R>; NODES]],
    /// Momentum per unit of the sums of stresses.
    unit: R,
    loads: &'a [Running],
    load_scale: R::V,
}

/// A block's motion, and the effect of the stresses on it.
type Pushed<'a, R> = (usize, &'a mut [[<R as Real>::Sum; 4]; NODES], &'a mut [[<R as Real>::Sum; 4]; NODES]);

impl<R: Real> Work<Pushed<'_, R>> for Settle<'_, R> {
    #[inline(always)]
    fn on(&self, _: Option<Wide>, (b, stored, force): Pushed<'_, R>) {
        let Settle { constants, bodies, held, unit, loads, load_scale } = self;
        if bodies.blocks[b].is_idle() {
            return;
        }
        let mut nodes = [[R::of(0.0); 4]; NODES];
        let bound = constants.max_displacement;
        let square = R::V::all(bound * bound);
        let rows =
            stored.as_chunks::<EDGE>().0.iter().zip(force.as_chunks::<EDGE>().0).zip(held[b].as_chunks::<EDGE>().0);
        for (nodes, ((stored, force), held)) in nodes.as_chunks_mut::<EDGE>().0.iter_mut().zip(rows) {
            let [x, y, z, mass] = R::V::transposed(stored.map(|node| R::V::from4(node.map(R::loaded))));
            let [fx, fy, fz, _] = R::V::transposed(force.map(R::dequantised));
            let unit = R::V::all(*unit) * (R::V::all(R::of(1.0)) / mass);
            let u = add([x, y, z], [fx * unit, fy * unit, fz * unit]);
            let zero = R::V::all(R::of(0.0));
            let taking_part = zero.below(mass);
            let kept = [u[0], u[1], u[2], mass].map(|c| taking_part.pick(c, zero));
            *nodes = R::V::transposed(kept).map(Lanes::to4);
            if square.below(dot(u, u)).any() {
                for (node, held) in nodes.iter_mut().zip(held) {
                    let u = slowed_where_free(held, [node[0], node[1], node[2]], bound);
                    node[..3].copy_from_slice(&u);
                }
            }
        }
        *force = [[R::Sum::default(); 4]; NODES];
        bodies.resolve(b, &mut nodes, Friction::Full, |touch| touch.load(loads, *load_scale));
        // The pressures were found with these nodes held; contact may release them in the next step.
        for (n, (node, held)) in nodes.iter_mut().zip(&held[b]).enumerate().filter(|(_, (_, held))| held.count > 0) {
            let before = [node[0], node[1], node[2]];
            let kept = sub(held.motion, free(held, held.motion));
            let u = add(free(held, before), kept);
            node[..3].copy_from_slice(&u);
            if let Some(body) = bodies.colliders.get(held.body as usize).filter(|body| body.load != NONE) {
                let x = bodies.node_position(b, n);
                load::note_node(loads, body, x, sub(before, u), node[3] * load_scale.to4()[0]);
            }
        }
        *stored = nodes.map(|node| node.map(R::stored));
    }
}

/// The displacement `u`, of which the part in the directions in which the node is free is shortened to `bound`. The rest
/// is for the body that holds the node to take, however fast stresses would make it.
fn slowed_where_free<R: Real>(held: &Held<R>, u: [R; 3], bound: R) -> [R; 3] {
    let moved = free(held, u);
    let square = dot(moved, moved);
    if dot(u, u) <= bound * bound || square <= bound * bound {
        return u;
    }
    add(sub(u, moved), scale(moved, bound / square.sqrt()))
}
