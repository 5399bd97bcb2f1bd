//! Wide vectors, where the processor has them. With AVX-512 there are twice as many registers, comparisons and
//! selections are one operation each, and three nodes fit into one vector. Results are the same to the bit: no
//! operations are fused.

use std::sync::atomic::{AtomicBool, Ordering};

/// Disables wide vectors, so that a test can compute what other processors do.
pub static NARROW: AtomicBool = AtomicBool::new(false);

/// A processor with wide vectors.
#[cfg(target_arch = "x86_64")]
pub use pulp::x86::V4 as Wide;

/// Other processors count as having none.
#[cfg(not(target_arch = "x86_64"))]
#[derive(Debug, Clone, Copy)]
pub enum Wide {}

/// Work that is compiled twice: for any processor and for wide vectors. `on` and all that it calls should be inlined;
/// functions that are not use narrow vectors.
pub trait Work<T>: Sync {
    /// Does the work for one item; `wide` is `Some` where there are wide vectors.
    fn on(&self, wide: Option<Wide>, item: T);
}

/// Does the work for an item, with vectors as wide as the processor has.
#[inline(always)]
pub fn widely<T>(work: &impl Work<T>, item: T) {
    #[cfg(target_arch = "x86_64")]
    if let Some(wide) = Wide::try_new().filter(|_| !NARROW.load(Ordering::Relaxed)) {
        return wide.vectorize(Job { work, wide, item });
    }
    work.on(None, item);
}

#[cfg(target_arch = "x86_64")]
pub use x86::add_rows;

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{Wide, Work};
    use bytemuck::cast;
    use std::arch::x86_64::{__m512, __m512i};
    use wide::{f32x4, i32x4};

    pub struct Job<'a, T, W: Work<T>> {
        pub work: &'a W,
        pub wide: Wide,
        pub item: T,
    }

    impl<T, W: Work<T>> pulp::NullaryFnOnce for Job<'_, T, W> {
        type Output = ();

        #[inline(always)]
        fn call(self) {
            self.work.on(Some(self.wide), self.item);
        }
    }

    /// Adds to 27 nodes, which lie in rows of three that begin `strides` apart, a value that is `middle` at the middle
    /// one and changes by `columns` from node to node, weighted and rounded; returns the sum of all parts. A row is one
    /// vector, whose fourth lane is zero.
    #[inline(always)]
    pub fn add_rows(
        wide: Wide,
        nodes: &mut [[i32; 4]],
        strides: [usize; 2],
        middle: f32x4,
        [dx, dy, dz]: [f32x4; 3],
        [wx, wy, wz]: [[f32; 3]; 3],
    ) -> [i32; 4] {
        let v = wide.avx512f;
        let all = |x: f32x4| v._mm512_broadcast_f32x4(cast(x));
        let zero = f32x4::splat(0.0);
        let dx: __m512 = cast([-dx, zero, dx, zero]);
        let [dy, dz] = [all(dy), all(dz)];
        let wx: __m512 = cast([f32x4::splat(wx[0]), f32x4::splat(wx[1]), f32x4::splat(wx[2]), zero]);
        let middle = all(middle);
        let mut total: __m512i = cast([0; 16]);
        for (k, plane) in [v._mm512_sub_ps(middle, dz), middle, v._mm512_add_ps(middle, dz)].into_iter().enumerate() {
            for (j, row) in [v._mm512_sub_ps(plane, dy), plane, v._mm512_add_ps(plane, dy)].into_iter().enumerate() {
                let weights = v._mm512_mul_ps(v._mm512_set1_ps(wz[k] * wy[j]), wx);
                let values = v._mm512_mul_ps(v._mm512_add_ps(row, dx), weights);
                let part = v._mm512_maskz_cvtps_epi32(0x0fff, values);
                total = v._mm512_add_epi32(total, part);
                let first = k * strides[1] + j * strides[0];
                // There is nothing behind the last row, so that its fourth lane goes before it.
                let last = first + 3 == nodes.len();
                let (first, part) =
                    if last { (first - 1, v._mm512_shuffle_i32x4::<0b10_01_00_11>(part, part)) } else { (first, part) };
                if let Some(sums) = nodes[first..].first_chunk_mut::<4>() {
                    *sums = cast(v._mm512_add_epi32(cast(*sums), part));
                }
            }
        }
        let [a, b, c, _]: [i32x4; 4] = cast(total);
        (a + b + c).to_array()
    }
}
#[cfg(target_arch = "x86_64")]
use x86::Job;
