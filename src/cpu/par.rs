//! Loops over slices: on all cores with the feature `parallel`, in order without it. No loop's result depends on which.

use super::state::Block;
use std::sync::{Mutex, PoisonError};

/// Items that one task takes at least; below that, sharing costs more than it gains.
#[cfg(feature = "parallel")]
const GRAIN: usize = 1024;

/// Calls `f` on one of the threads that share the loops' work: a loop that starts there needs no hand-over, which would cost
/// as much as a small loop.
pub fn inside<T: Send>(f: impl FnOnce() -> T + Send) -> T {
    #[cfg(feature = "parallel")]
    {
        rayon::scope(|_| f())
    }
    #[cfg(not(feature = "parallel"))]
    f()
}

/// Calls `f` with the index of each item and the item.
pub fn each<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        items.par_iter_mut().with_min_len(GRAIN).enumerate().for_each(|(i, item)| f(i, item));
    }
    #[cfg(not(feature = "parallel"))]
    items.iter_mut().enumerate().for_each(|(i, item)| f(i, item));
}

/// Calls `f` with the index of each item and the item, where an item is a whole block's work.
pub fn each_block<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        items.par_iter_mut().with_min_len(4).enumerate().for_each(|(i, item)| f(i, item));
    }
    #[cfg(not(feature = "parallel"))]
    items.iter_mut().enumerate().for_each(|(i, item)| f(i, item));
}

/// Calls `f` with the index and the items of two slices of equal length, where an item is a whole block's work.
pub fn each_pair<A: Send, B: Send>(a: &mut [A], b: &mut [B], f: impl Fn(usize, &mut A, &mut B) + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        a.par_iter_mut().zip(b).with_min_len(4).enumerate().for_each(|(i, (a, b))| f(i, a, b));
    }
    #[cfg(not(feature = "parallel"))]
    a.iter_mut().zip(b).enumerate().for_each(|(i, (a, b))| f(i, a, b));
}

/// The same of three slices.
pub fn each_triple<A: Send, B: Send, C: Send>(
    a: &mut [A],
    b: &mut [B],
    c: &mut [C],
    f: impl Fn(usize, &mut A, &mut B, &mut C) + Sync,
) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        a.par_iter_mut().zip(b).zip(c).with_min_len(4).enumerate().for_each(|(i, ((a, b), c))| f(i, a, b, c));
    }
    #[cfg(not(feature = "parallel"))]
    a.iter_mut().zip(b).zip(c).enumerate().for_each(|(i, ((a, b), c))| f(i, a, b, c));
}

/// Calls `f` with the index of each chunk of `size` items and the chunk; the last may be shorter.
pub fn each_chunk<T: Send>(items: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        items.par_chunks_mut(size).with_min_len(4).enumerate().for_each(|(i, chunk)| f(i, chunk));
    }
    #[cfg(not(feature = "parallel"))]
    items.chunks_mut(size).enumerate().for_each(|(i, chunk)| f(i, chunk));
}

/// A value for each block, noted by whoever works on it and taken in the order of the blocks.
#[derive(Debug)]
pub struct PerBlock<T>(Mutex<Vec<T>>);

impl<T: Copy + Default> PerBlock<T> {
    pub fn new(blocks: usize) -> Self {
        PerBlock(Mutex::new(vec![T::default(); blocks]))
    }

    pub fn set(&self, block: usize, value: T) {
        // A thread that panics takes the step with it; what it noted is whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)[block] = value;
    }

    pub fn take(self) -> Vec<T> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Something that can be cut in two at a particle.
pub trait Cut: Send + Sized {
    /// The first `at` particles, and the others.
    fn cut(self, at: usize) -> (Self, Self);
}

impl<T: Send> Cut for &mut [T] {
    fn cut(self, at: usize) -> (Self, Self) {
        self.split_at_mut(at)
    }
}

impl<T: Send> Cut for Option<&mut [T]> {
    fn cut(self, at: usize) -> (Self, Self) {
        self.map_or((None, None), |items| {
            let (low, high) = items.split_at_mut(at);
            (Some(low), Some(high))
        })
    }
}

impl<A: Cut, B: Cut> Cut for (A, B) {
    fn cut(self, at: usize) -> (Self, Self) {
        let (a, b) = (self.0.cut(at), self.1.cut(at));
        ((a.0, b.0), (a.1, b.1))
    }
}

/// Calls `f` with the index of each occupied block, the block, and its particles' part of `particles`. The ranges of
/// `blocks` follow each other from particle 0; what lies behind the last takes no part.
pub fn block_particles<P: Cut>(blocks: &[Block], particles: P, f: &(impl Fn(usize, &Block, P) + Sync)) {
    let Some(last) = blocks.last() else { return };
    let (taking_part, _) = particles.cut((last.start + last.count) as usize);
    halves(0, blocks, taking_part, f);
}

fn halves<P: Cut>(first: usize, blocks: &[Block], particles: P, f: &(impl Fn(usize, &Block, P) + Sync)) {
    match blocks {
        [] => {}
        [block] => f(first, block, particles),
        _ => {
            let middle = blocks.len() / 2;
            let (low, high) = blocks.split_at(middle);
            let (a, b) = particles.cut((high[0].start - low[0].start) as usize);
            let work = [(first, low, a), (first + middle, high, b)];
            join(work, blocks.len(), |(first, blocks, particles)| halves(first, blocks, particles, f));
        }
    }
}

#[cfg(feature = "parallel")]
fn join<T: Send>(work: [T; 2], size: usize, f: impl Fn(T) + Sync) {
    let [a, b] = work;
    if size > 8 {
        rayon::join(|| f(a), || f(b));
    } else {
        f(a);
        f(b);
    }
}

#[cfg(not(feature = "parallel"))]
fn join<T: Send>(work: [T; 2], _size: usize, f: impl Fn(T) + Sync) {
    work.into_iter().for_each(f);
}
