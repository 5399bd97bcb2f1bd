//! Loops over slices: on all cores with the feature `parallel`, in order without it. No loop's result depends on which.

use super::state::Block;
use crate::math::real::Real;
use crate::stages::bin_sleep::AWAKE;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// The fewest items of a task; with fewer, sharing the work costs more than it gains.
#[cfg(feature = "parallel")]
const GRAIN: usize = 1024;

/// The fewest particles in blocks of a task: contact makes some of them cost many times what others do.
#[cfg(feature = "parallel")]
const CROWD: usize = 256;

/// Calls `f` on one of the threads that share the loops' work. A loop that starts there needs no hand-over, which would
/// cost as much as a small loop.
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

/// Slices of equal length that are gone through side by side.
pub trait Zipped {
    /// An item of each.
    type Item: Send;

    #[cfg(feature = "parallel")]
    fn zipped(self) -> impl rayon::iter::IndexedParallelIterator<Item = Self::Item>;
    #[cfg(not(feature = "parallel"))]
    fn zipped(self) -> impl Iterator<Item = Self::Item>;
}

impl<'a, T: Send> Zipped for &'a mut [T] {
    type Item = &'a mut T;

    #[cfg(feature = "parallel")]
    fn zipped(self) -> impl rayon::iter::IndexedParallelIterator<Item = &'a mut T> {
        rayon::iter::IntoParallelIterator::into_par_iter(self)
    }
    #[cfg(not(feature = "parallel"))]
    fn zipped(self) -> impl Iterator<Item = &'a mut T> {
        self.iter_mut()
    }
}

impl<A: Zipped, B: Zipped> Zipped for (A, B) {
    type Item = (A::Item, B::Item);

    #[cfg(feature = "parallel")]
    fn zipped(self) -> impl rayon::iter::IndexedParallelIterator<Item = Self::Item> {
        rayon::iter::IndexedParallelIterator::zip(self.0.zipped(), self.1.zipped())
    }
    #[cfg(not(feature = "parallel"))]
    fn zipped(self) -> impl Iterator<Item = Self::Item> {
        self.0.zipped().zip(self.1.zipped())
    }
}

/// Calls `f` with the index of each item and the item, or one of each slice, for items that are much work, such as
/// whole blocks.
pub fn each_block<Z: Zipped>(items: Z, f: impl Fn(usize, Z::Item) + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        items.zipped().with_min_len(4).enumerate().for_each(|(i, item)| f(i, item));
    }
    #[cfg(not(feature = "parallel"))]
    items.zipped().enumerate().for_each(|(i, item)| f(i, item));
}

/// Calls `f` with the number of each of `count` blocks.
pub fn blocks(count: usize, f: impl Fn(usize) + Sync) {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_min_len(64).for_each(&f);
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).for_each(f);
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

/// Sums over all blocks, added up in the order of the blocks whichever thread works on them.
#[derive(Debug)]
pub struct Totals<R: Real, const N: usize>(Mutex<Vec<[R::Whole; N]>>);

impl<R: Real, const N: usize> Totals<R, N> {
    pub fn new(blocks: usize) -> Self {
        Totals(Mutex::new(vec![[R::Whole::default(); N]; blocks]))
    }

    /// Notes what a block contributes.
    pub fn set(&self, block: usize, sums: [R::Whole; N]) {
        // A thread that panics ends the step; what it has noted is complete.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)[block] = sums;
    }

    /// The sums, before scaling.
    pub fn take(self) -> [R; N] {
        let mut total = [R::Whole::default(); N];
        for sums in self.0.into_inner().unwrap_or_else(PoisonError::into_inner) {
            total.iter_mut().zip(sums).for_each(|(total, sum)| *total += sum);
        }
        total.map(R::of_whole)
    }
}

/// The largest of non-negative numbers, noted from all cores.
#[derive(Debug)]
pub struct Largest<const N: usize>([AtomicU64; N]);

impl<const N: usize> Largest<N> {
    pub fn new() -> Self {
        Largest([const { AtomicU64::new(0) }; N])
    }

    pub fn note<R: Real>(&self, most: [R; N]) {
        // The bits of non-negative numbers are in the order of the numbers.
        self.0.iter().zip(most).for_each(|(largest, most)| {
            largest.fetch_max(most.f64().to_bits(), Ordering::Relaxed);
        });
    }

    pub fn take<R: Real>(self) -> [R; N] {
        self.0.map(|largest| R::of(f64::from_bits(largest.into_inner())))
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

/// Calls `f` with the index of each block that is awake, the block, and its particles' part of `particles`. The ranges
/// of `blocks` follow each other from particle 0; what lies behind the last takes no part.
pub fn block_particles<P: Cut>(blocks: &[Block], particles: P, f: &(impl Fn(usize, &Block, P) + Sync)) {
    all_block_particles(blocks, particles, &|b, block: &Block, particles| {
        if block.sleep == AWAKE {
            f(b, block, particles);
        }
    });
}

/// The same with those that sleep.
pub fn all_block_particles<P: Cut>(blocks: &[Block], particles: P, f: &(impl Fn(usize, &Block, P) + Sync)) {
    let Some(last) = blocks.last() else { return };
    let (taking_part, _) = particles.cut((last.start + last.count) as usize);
    halves(0, blocks, taking_part, f);
}

fn halves<P: Cut>(first: usize, blocks: &[Block], particles: P, f: &(impl Fn(usize, &Block, P) + Sync)) {
    match blocks {
        [] => {}
        [block] => f(first, block, particles),
        _ => {
            // The same number of particles on either side, whatever the blocks hold.
            let last = blocks.len() - 1;
            let count = blocks[last].start + blocks[last].count - blocks[0].start;
            let half = blocks[0].start + count / 2;
            let middle = blocks.partition_point(|block| block.start < half).clamp(1, last);
            let (low, high) = blocks.split_at(middle);
            let (a, b) = particles.cut((high[0].start - low[0].start) as usize);
            let work = [(first, low, a), (first + middle, high, b)];
            join(work, count as usize, |(first, blocks, particles)| halves(first, blocks, particles, f));
        }
    }
}

#[cfg(feature = "parallel")]
fn join<T: Send>(work: [T; 2], particles: usize, f: impl Fn(T) + Sync) {
    let [a, b] = work;
    if particles > CROWD {
        rayon::join(|| f(a), || f(b));
    } else {
        f(a);
        f(b);
    }
}

#[cfg(not(feature = "parallel"))]
fn join<T: Send>(work: [T; 2], _particles: usize, f: impl Fn(T) + Sync) {
    work.into_iter().for_each(f);
}
