//! The two number types of the CPU path: `f32` with fixed-point sums, the twin of the shaders, and `f64` without
//! quantisation, to measure their error.

use super::exponential;
use super::wide::Wide;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};
use wide::{f32x4, f64x4, i32x4};

mod sealed {
    /// Only the two number types.
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A floating-point number that the CPU path is generic over: `f32` or `f64`, and no other type.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// Four lanes of it.
    type V: Lanes<Self>;
    /// Type in which a grid channel is summed.
    type Sum: Copy + Default + Debug + Send + Sync + PartialEq + 'static;
    /// Type in which numbers are summed over all nodes or particles.
    type Whole: Copy + Default + Debug + Send + Sync + AddAssign + 'static;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
    /// Smallest positive number that is not denormal.
    const MIN_POSITIVE: Self;

    /// Nearest value of this type.
    fn of(x: f64) -> Self;
    /// Exact value.
    fn f64(self) -> f64;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Neither infinite nor NaN.
    fn finite(self) -> bool;
    /// Largest whole number not above `self`, which is not negative.
    fn floor_index(self) -> u32;
    /// The floors of four numbers that are not negative, as integers and as numbers of this type.
    fn truncated(v: Self::V) -> ([u32; 4], Self::V);
    /// The largest power of two not above `self`, which is positive and not denormal, and two divided by that power.
    fn binade(self) -> (Self, Self);

    /// The four lanes rounded to units of a channel's sum.
    fn quantise(v: Self::V) -> [Self::Sum; 4];
    /// `a + b`; wraps where integers do.
    fn sum(a: Self::Sum, b: Self::Sum) -> Self::Sum;
    /// `a − b` by channel; wraps where integers do.
    fn difference(a: [Self::Sum; 4], b: [Self::Sum; 4]) -> [Self::Sum; 4];
    /// `a + b` by channel, and whether the last, which holds the mass, left its range.
    fn merge(a: [Self::Sum; 4], b: [Self::Sum; 4]) -> ([Self::Sum; 4], bool);
    /// The value of a sum before scaling. A mass channel (`unsigned`) has no sign.
    fn dequantise(sum: Self::Sum, unsigned: bool) -> Self;
    /// The same for a whole node, whose last channel holds its mass.
    fn dequantised(node: [Self::Sum; 4]) -> Self::V;
    /// Whether a mass channel has passed half of its range, from where saturation is reported.
    fn saturated(mass: Self::Sum) -> bool;
    /// The number's bits in the storage of a sum: a node's displacement replaces its sums in place.
    fn stored(self) -> Self::Sum;
    /// The number that was [`stored`](Self::stored).
    fn loaded(sum: Self::Sum) -> Self;
    /// `self`, which is scaled and not negative, rounded to the units of such a sum.
    fn whole(self) -> Self::Whole;
    /// The value of a sum that is not negative, before scaling.
    fn of_whole(sum: Self::Whole) -> Self;
    /// Adds a scatter's values to 27 nodes by wide vectors, where possible: see [`wide::add_rows`](super::wide).
    #[inline(always)]
    fn add_rows(
        _wide: Wide,
        _nodes: &mut [[Self::Sum; 4]],
        _strides: [usize; 2],
        _middle: Self::V,
        _columns: [Self::V; 3],
        _weights: [[Self; 3]; 3],
    ) -> Option<[Self::Sum; 4]> {
        None
    }
    /// The scale to use where the fixed-point path would use `scale`.
    fn scale(scale: f64) -> f64;
    /// Smaller of two.
    fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }
    /// Larger of two.
    fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }
}

/// Four lanes. Comparisons return masks: lanes whose bits are all set or all clear.
pub trait Lanes<R>:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
{
    /// From an array.
    fn from4(a: [R; 4]) -> Self;
    /// To an array.
    fn to4(self) -> [R; 4];
    /// The same number in every lane.
    fn all(x: R) -> Self;
    /// From columns to rows: from four lanes for each of four points to four points for each of four lanes, and back.
    fn transposed(a: [Self; 4]) -> [Self; 4];
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Where `self < other`.
    fn below(self, other: Self) -> Self;
    /// Where `self <= other`.
    fn at_most(self, other: Self) -> Self;
    /// Of a mask: `a` where it is set, `b` elsewhere.
    fn pick(self, a: Self, b: Self) -> Self;
    /// Of masks: where both are set.
    fn and(self, other: Self) -> Self;
    /// Of a mask: whether it is set in any lane.
    fn any(self) -> bool;
    /// Of a mask: in which lanes it is set.
    fn lanes(self) -> [bool; 4];
    /// Smaller of two numbers.
    fn min(self, other: Self) -> Self;
    /// Larger of two numbers.
    fn max(self, other: Self) -> Self;
    /// See [`Real::binade`].
    fn binade(self) -> (Self, Self);
    /// Natural logarithm of positive numbers.
    fn ln(self) -> Self;
    /// Exponential of numbers between −80 and 80.
    fn exp(self) -> Self;
}

macro_rules! lanes {
    ($v:ty, $r:ty, $ln:expr, $exp:expr) => {
        impl Lanes<$r> for $v {
            #[inline(always)]
            fn from4(a: [$r; 4]) -> Self {
                Self::from(a)
            }
            #[inline(always)]
            fn to4(self) -> [$r; 4] {
                self.to_array()
            }
            #[inline(always)]
            fn all(x: $r) -> Self {
                Self::splat(x)
            }
            #[inline(always)]
            fn transposed(a: [Self; 4]) -> [Self; 4] {
                Self::transpose(a)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn below(self, other: Self) -> Self {
                self.simd_lt(other)
            }
            #[inline(always)]
            fn at_most(self, other: Self) -> Self {
                self.simd_le(other)
            }
            #[inline(always)]
            fn pick(self, a: Self, b: Self) -> Self {
                self.bitselect(a, b)
            }
            #[inline(always)]
            fn and(self, other: Self) -> Self {
                self & other
            }
            // In this order: of two zeros of different sign it returns `self`, as for single numbers.
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                other.fast_min(self)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                other.fast_max(self)
            }
            #[inline(always)]
            fn binade(self) -> (Self, Self) {
                let [a, b, c, d] = self.to_array();
                let (a, b, c, d) = (Real::binade(a), Real::binade(b), Real::binade(c), Real::binade(d));
                (Self::from([a.0, b.0, c.0, d.0]), Self::from([a.1, b.1, c.1, d.1]))
            }
            #[inline(always)]
            fn ln(self) -> Self {
                $ln(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline(always)]
            fn any(self) -> bool {
                self.any()
            }
            #[inline(always)]
            fn lanes(self) -> [bool; 4] {
                let bits = self.to_bitmask();
                [0, 1, 2, 3].map(|n| bits >> n & 1 != 0)
            }
        }
    };
}
lanes!(f32x4, f32, exponential::ln, exponential::exp);
lanes!(f64x4, f64, |x: f64x4| f64x4::from(x.to_array().map(f64::ln)), |x: f64x4| f64x4::from(
    x.to_array().map(f64::exp)
));

macro_rules! float {
    ($r:ident, $exponent:literal) => {
        const EPSILON: Self = $r::EPSILON;
        const MIN_POSITIVE: Self = $r::MIN_POSITIVE;

        #[inline(always)]
        fn of(x: f64) -> Self {
            x as $r
        }
        #[inline(always)]
        fn f64(self) -> f64 {
            f64::from(self)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            self.sqrt()
        }
        #[inline(always)]
        fn abs(self) -> Self {
            self.abs()
        }
        #[inline(always)]
        fn finite(self) -> bool {
            self.is_finite()
        }
        #[inline(always)]
        fn floor_index(self) -> u32 {
            // Positions are not negative, so truncation is the floor.
            self as u32
        }
        #[inline(always)]
        fn binade(self) -> (Self, Self) {
            let exponent = self.to_bits() & $exponent;
            // Twice the inverse: the inverse itself would be denormal for the largest numbers.
            ($r::from_bits(exponent), $r::from_bits($exponent - exponent))
        }
    };
}

impl Real for f32 {
    type V = f32x4;
    type Sum = i32;
    type Whole = u64;
    float!(f32, 0x7f80_0000);

    #[inline(always)]
    fn truncated(v: f32x4) -> ([u32; 4], f32x4) {
        let whole: i32x4 = v.fast_trunc_int();
        (whole.to_array().map(|i| i as u32), whole.round_float())
    }
    #[inline(always)]
    fn quantise(v: f32x4) -> [i32; 4] {
        let rounded: i32x4 = v.fast_round_int();
        rounded.to_array()
    }
    #[inline(always)]
    fn sum(a: i32, b: i32) -> i32 {
        a.wrapping_add(b)
    }
    #[inline(always)]
    fn difference(a: [i32; 4], b: [i32; 4]) -> [i32; 4] {
        [0, 1, 2, 3].map(|c| a[c].wrapping_sub(b[c]))
    }
    #[inline(always)]
    fn merge(a: [i32; 4], b: [i32; 4]) -> ([i32; 4], bool) {
        let sum = [0, 1, 2, 3].map(|c| a[c].wrapping_add(b[c]));
        (sum, (sum[3] as u32) < b[3] as u32)
    }
    #[inline(always)]
    fn dequantise(sum: i32, unsigned: bool) -> f32 {
        if unsigned { sum as u32 as f32 } else { sum as f32 }
    }
    #[inline(always)]
    fn dequantised(node: [i32; 4]) -> f32x4 {
        let value = i32x4::from(node).round_float();
        if !f32::saturated(node[3]) {
            return value;
        }
        let [x, y, z, _] = value.to_array();
        f32x4::from([x, y, z, f32::dequantise(node[3], true)])
    }
    #[inline(always)]
    fn saturated(mass: i32) -> bool {
        mass < 0
    }
    #[inline(always)]
    fn stored(self) -> i32 {
        self.to_bits() as i32
    }
    #[inline(always)]
    fn loaded(sum: i32) -> f32 {
        f32::from_bits(sum as u32)
    }
    #[inline(always)]
    fn whole(self) -> u64 {
        // From there on all numbers are whole. Below it, the last bits of the sum are the rounded number; rounding
        // otherwise would take a function call.
        const WHOLE: f64 = (1u64 << 52) as f64;
        let x = f64::from(self.max(0.0));
        if x < WHOLE {
            return (x + WHOLE).to_bits() - WHOLE.to_bits();
        }
        x.min((1u64 << 62) as f64) as u64
    }
    #[inline(always)]
    fn of_whole(sum: u64) -> f32 {
        // By parts of 16 bits, which are exact: devices differ in how they convert whole words from 2³¹ on.
        [48, 32, 16, 0].into_iter().fold(0.0, |x, shift| x * 65_536.0 + (sum >> shift) as u16 as f32)
    }
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    fn add_rows(
        wide: Wide,
        nodes: &mut [[i32; 4]],
        strides: [usize; 2],
        middle: f32x4,
        columns: [f32x4; 3],
        weights: [[f32; 3]; 3],
    ) -> Option<[i32; 4]> {
        Some(super::wide::add_rows(wide, nodes, strides, middle, columns, weights))
    }
    fn scale(scale: f64) -> f64 {
        scale
    }
}

impl Real for f64 {
    type V = f64x4;
    type Sum = f64;
    type Whole = f64;
    float!(f64, 0x7ff0_0000_0000_0000);

    #[inline(always)]
    fn truncated(v: f64x4) -> ([u32; 4], f64x4) {
        let whole = v.to_array().map(f64::floor_index);
        (whole, f64x4::from(whole.map(f64::from)))
    }
    #[inline(always)]
    fn quantise(v: f64x4) -> [f64; 4] {
        v.to_array()
    }
    #[inline(always)]
    fn sum(a: f64, b: f64) -> f64 {
        a + b
    }
    #[inline(always)]
    fn difference(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
        [0, 1, 2, 3].map(|c| a[c] - b[c])
    }
    #[inline(always)]
    fn merge(a: [f64; 4], b: [f64; 4]) -> ([f64; 4], bool) {
        ([0, 1, 2, 3].map(|c| a[c] + b[c]), false)
    }
    #[inline(always)]
    fn dequantise(sum: f64, _unsigned: bool) -> f64 {
        sum
    }
    #[inline(always)]
    fn dequantised(node: [f64; 4]) -> f64x4 {
        f64x4::from(node)
    }
    #[inline(always)]
    fn saturated(_mass: f64) -> bool {
        false
    }
    #[inline(always)]
    fn stored(self) -> f64 {
        self
    }
    #[inline(always)]
    fn loaded(sum: f64) -> f64 {
        sum
    }
    #[inline(always)]
    fn whole(self) -> f64 {
        self
    }
    #[inline(always)]
    fn of_whole(sum: f64) -> f64 {
        sum
    }
    fn scale(_scale: f64) -> f64 {
        1.0
    }
}
