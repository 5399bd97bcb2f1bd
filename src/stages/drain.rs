//! Deletes the particles that are in a drain, and frees the slots of quarantined ones where a host has asked for that.

use super::Kernel;
use super::contact::distance_normal_after;
use crate::cpu::par;
use crate::cpu::state::{CpuState, DRAINED, QUARANTINED, VACANT};
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::real::{Lanes, Real};
use std::sync::atomic::Ordering;

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Regions),
        write(Slot::Position),
        write(Slot::Counters),
        read(Slot::DistanceGrids).with_meshes(),
        read(Slot::Distances).with_meshes(),
    ],
    over: Over::Particles,
    source: include_str!("../../shaders/stages/drain.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (drains, tally, release) = (&s.drains, &s.tally, s.constants.release);
    par::each_chunk(&mut s.position, 4, |_, position| {
        let last = position.len() - 1;
        let lanes = [0, 1, 2, 3].map(|n: usize| R::V::from4(position[n.min(last)]));
        let [x, y, z, _] = R::V::transposed(lanes);
        let zero = R::V::all(R::of(0.0));
        let mut inside = zero.below(zero);
        for drain in drains {
            let here = distance_normal_after::<R>(drain, [x, y, z]).0.below(zero);
            inside = here.pick(here, inside);
        }
        for (p, inside) in position.iter_mut().zip(inside.lanes()) {
            if inside && p[3] > R::of(0.0) {
                p[3] = R::of(DRAINED);
                tally.drained.fetch_add(1, Ordering::Relaxed);
            } else if release && p[3] == R::of(QUARANTINED) {
                p[3] = R::of(VACANT);
            }
        }
    });
}
