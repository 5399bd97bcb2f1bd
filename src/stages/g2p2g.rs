//! Gathers each particle's motion and sums it on the nodes again, in iterations that need none of it stored: a pass
//! over the particles in place of three. The CPU path takes the three: [`g2p`](super::g2p),
//! [`constraint`](super::constraint) and [`p2g`](super::p2g).

use super::Kernel;
use crate::gpu::slots::{Over, Slot, read, write};

pub(crate) const KERNEL: Kernel = Kernel {
    binds: &[
        read(Slot::Constants),
        read(Slot::Materials),
        read(Slot::Position),
        read(Slot::Gradient),
        read(Slot::Order),
        read(Slot::Chunks),
        read(Slot::Grid),
        write(Slot::Force),
        write(Slot::Counters),
    ],
    over: Over::Chunks,
    source: include_str!("../../shaders/stages/g2p2g.wgsl"),
};
