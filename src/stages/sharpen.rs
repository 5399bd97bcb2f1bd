//! Restores the motion that transfers smooth away. A transfer to the grid and back, by APIC with quadratic B-splines,
//! removes the share 0.11 k⁴ of a motion of wave number k per cell. What it removes from the particles' motion is known
//! once that has been summed on the nodes unchanged; adding it beforehand cancels the loss to that order. XPIC of order
//! 2 does the same to PIC (Hammerquist and Nairn 2017).
//!
//! If a transfer leaves the share S of a motion, S (2 − S) is left instead: never more than there was, since S is
//! symmetric by mass and between 0 and 1.

use super::Kernel;
use super::g2p::{gather, tile};
use super::motion::momentum_scale;
use crate::bins::origin;
use crate::cpu::gradient::Gradient;
use crate::cpu::par;
use crate::cpu::state::CpuState;
use crate::gpu::slots::{Over, Slot, read, write};
use crate::math::kernel::Stencil;
use crate::math::real::{Lanes, Real};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Position),
        write(Slot::Displacement),
        write(Slot::Gradient),
        read(Slot::Order),
        read(Slot::Chunks),
        read(Slot::Grid),
        write(Slot::Counters),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/sharpen.wgsl"),
};

pub(crate) fn run<R: Real>(s: &mut CpuState<R>) {
    let (grid, links, position) = (&s.grid, &s.links, &s.position);
    let scale = s.constants.mass_scale / momentum_scale(s.largest_motion, &s.constants);
    let particles = (&mut s.displacement[..], &mut s.gradient[..]);
    par::block_particles(&s.blocks[..s.occupied], particles, &|b, block, (displacement, gradient)| {
        let tile = tile(grid, &links[b], |sums| node::<R>(*sums, scale));
        let origin = origin(block.key);
        let moved = displacement.iter_mut().zip(gradient).zip(&position[block.start as usize..]);
        for ((u, d), x) in moved {
            let mut left = Gradient::<R>::default();
            let after = gather(&tile, origin, &Stencil::at(*x), &mut left);
            let add = |to: &mut [R; 4], left: [R; 4]| {
                to.iter_mut().zip(left).take(3).for_each(|(to, left)| *to += *to - left);
            };
            add(u, after);
            d.iter_mut().zip(left).for_each(|(to, left)| add(to, left));
        }
    });
}

/// The motion of a node; 0 for one without mass.
#[inline(always)]
fn node<R: Real>(sums: [R::Sum; 4], scale: R) -> [R; 4] {
    let sums = R::dequantised(sums);
    let [.., mass] = sums.to4();
    if mass > R::of(0.0) { (sums * R::V::all(scale / mass)).to4() } else { [R::of(0.0); 4] }
}
