//! Matrices that a decomposition may meet, and the errors of decompositions. For the unit tests and for the suite.

/// A matrix by columns.
pub type Matrix = [[f64; 3]; 3];

/// A stream of random numbers (SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let a = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let b = (a ^ (a >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        b ^ (b >> 31)
    }

    /// In [-1, 1).
    fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// From `low` to `high`.
    fn whole(&mut self, low: i32, high: i32) -> i32 {
        low + (self.next() % (high - low + 1) as u64) as i32
    }

    fn any(&mut self) -> Matrix {
        [0; 3].map(|_| [0; 3].map(|_| self.signed()))
    }

    /// 10 to a random power between -`decades` and 0.
    fn small(&mut self, decades: f64) -> f64 {
        10f64.powf((self.signed() - 1.0) * 0.5 * decades)
    }

    fn rotation(&mut self) -> Matrix {
        let [x, y, z, w] = loop {
            let q = [0; 4].map(|_| self.signed());
            let square: f64 = q.iter().map(|c| c * c).sum();
            if (0.01..1.0).contains(&square) {
                break q.map(|c| c / square.sqrt());
            }
        };
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }

    fn with_singular_values(&mut self, sigma: [f64; 3]) -> Matrix {
        let (u, v) = (self.rotation(), self.rotation());
        product(&times_diagonal(&u, sigma), &transposed(&v))
    }

    /// The identity's columns in any order with any signs.
    fn permutation(&mut self) -> Matrix {
        let mut m = [[0.0; 3]; 3];
        let first = self.whole(0, 2) as usize;
        let order = if self.next() & 1 == 0 { [0, 1, 2] } else { [0, 2, 1] };
        for (column, k) in m.iter_mut().zip(order) {
            column[(first + k) % 3] = if self.next() & 1 == 0 { 1.0 } else { -1.0 };
        }
        m
    }
}

/// Kinds of matrices: [`matrix`] takes them in turn.
pub const KINDS: u64 = 20;
/// The kind like a step's deformation: near the identity.
pub const NEAR_IDENTITY: u64 = 1;
/// The kind with random entries.
pub const RANDOM: u64 = 0;

/// The `index`-th matrix, always the same.
pub fn matrix(index: u64) -> Matrix {
    let mut r = Random(index.wrapping_mul(0xd134_2543_de82_ef95));
    match index % KINDS {
        RANDOM => r.any(),
        NEAR_IDENTITY => plus_identity(r.any(), 1e-4),
        2 => {
            let size = r.small(8.0);
            plus_identity(r.any(), size)
        }
        3 => r.rotation(),
        4 => times_diagonal(&r.rotation(), [1.0, 1.0, -1.0]),
        // Nearly equal values.
        5 => {
            let sigma = [1.0, 1.0 + r.signed() * r.small(8.0), (1.0 + r.signed() * r.small(8.0)) * r.signed().signum()];
            r.with_singular_values(sigma)
        }
        // Ill-conditioned.
        6 => {
            let sigma = [1.0, r.small(30.0), r.small(30.0) * r.signed().signum()];
            r.with_singular_values(sigma)
        }
        7 => {
            let sigma = [1.0, r.small(9.0), r.small(9.0)];
            r.with_singular_values(sigma)
        }
        8 => {
            let second = r.signed();
            r.with_singular_values([1.0, second, 0.0])
        }
        9 => {
            let (a, b) = (r.any()[0], r.any()[0]);
            b.map(|s| a.map(|c| c * s))
        }
        // Powers of two, over all of the range of f32.
        10 => {
            let power = 2f64.powi(r.whole(-130, 126));
            scaled(r.any(), power)
        }
        11 => {
            let power = 10f64.powi(18 * r.whole(-1, 1));
            scaled(plus_identity(r.any(), 0.3), power)
        }
        // Equal columns.
        12 => {
            let mut m = r.any();
            m[2] = m[0];
            if r.next() & 1 == 0 {
                m[1] = m[0].map(|c| -c);
            }
            m
        }
        13 => r.permutation(),
        14 => {
            let power = 2f64.powi(r.whole(-126, 126));
            scaled(r.permutation(), power)
        }
        // Whole numbers: ranks 0 to 3, many equal values.
        15 => [0; 3].map(|_| [0; 3].map(|_| f64::from(r.whole(-1, 1)))),
        16 => [0; 3].map(|_| [0; 3].map(|_| if r.next() & 1 == 0 { 0.0 } else { r.signed() })),
        // Graded by entry, by column and along the diagonal.
        17 => [0; 3].map(|_| [0; 3].map(|_| r.signed() * r.small(45.0))),
        18 => r.any().map(|column| scaled([column; 3], r.small(25.0))[0]),
        _ => times_diagonal(&r.permutation(), [0; 3].map(|_| r.small(40.0))),
    }
}

fn plus_identity(m: Matrix, size: f64) -> Matrix {
    let mut sum = scaled(m, size);
    (0..3).for_each(|i| sum[i][i] += 1.0);
    sum
}

fn scaled(m: Matrix, s: f64) -> Matrix {
    m.map(|column| column.map(|c| c * s))
}

fn times_diagonal(m: &Matrix, d: [f64; 3]) -> Matrix {
    [0, 1, 2].map(|i| m[i].map(|c| c * d[i]))
}

fn transposed(m: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [m[0][i], m[1][i], m[2][i]])
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    b.map(|column| [0, 1, 2].map(|i| a[0][i] * column[0] + a[1][i] * column[1] + a[2][i] * column[2]))
}

fn norm(m: &Matrix) -> f64 {
    m.iter().flatten().map(|c| c * c).sum::<f64>().sqrt()
}

fn difference(a: &Matrix, b: &Matrix) -> f64 {
    norm(&[0, 1, 2].map(|j| [0, 1, 2].map(|i| a[j][i] - b[j][i])))
}

fn determinant(m: &Matrix) -> f64 {
    let [a, b, c] = m;
    a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// ‖QᵀQ − I‖, or infinity if Q is not a proper rotation.
fn improper(q: &Matrix) -> f64 {
    let off = difference(&product(&transposed(q), q), &plus_identity([[0.0; 3]; 3], 0.0));
    if determinant(q) > 0.0 { off } else { f64::INFINITY }
}

/// Errors of a decomposition of `f`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Errors {
    /// ‖F − UΣVᵀ‖ over ‖F‖.
    pub product: f64,
    /// The larger of ‖UᵀU − I‖ and ‖VᵀV − I‖.
    pub rotation: f64,
}

impl Errors {
    /// The larger of each; infinite if one is NaN.
    pub fn max(self, other: Errors) -> Errors {
        let larger = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::INFINITY } else { a.max(b) };
        Errors { product: larger(self.product, other.product), rotation: larger(self.rotation, other.rotation) }
    }
}

/// ‖F − P‖ over ‖F‖; entries below `tiny` may be missing.
fn relative(f: &Matrix, product: &Matrix, tiny: f64) -> f64 {
    let off = difference(f, product);
    if off <= 8.0 * tiny { 0.0 } else { off / norm(f) }
}

/// Errors of a singular value decomposition; infinite if the values are out of order. Entries below `tiny` may be
/// missing.
pub fn svd_errors(f: &Matrix, u: &Matrix, sigma: [f64; 3], v: &Matrix, tiny: f64) -> Errors {
    let ordered = sigma[0] >= sigma[1] && sigma[1] >= sigma[2].abs() && sigma[1] >= 0.0;
    let product = relative(f, &product(&times_diagonal(u, sigma), &transposed(v)), tiny);
    let rotation = improper(u).max(improper(v));
    Errors { product: if ordered { product } else { f64::INFINITY }, rotation }
}
