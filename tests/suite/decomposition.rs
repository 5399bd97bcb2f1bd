//! The singular value decomposition in WGSL: valid text, the CPU's bits, and bounds on the errors.

use crate::alike::rounds_by_itself;
use crate::backends::{Backend, DEVICES, Tests};
use crate::kernels::run_kernel;
use crate::matrices::{self, Errors, Matrix, svd_errors};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use pbmpm::math::svd::{SWEEPS, Svd, svd};
use pbmpm::shaders;

pub fn add(tests: &mut Tests) {
    tests.once("decomposition", "text_is_valid", text_is_valid);
    tests.each("decomposition", DEVICES, "has_the_bits_of_the_cpu", has_the_bits_of_the_cpu);
}

const COUNT: usize = 100_000;
/// Numbers returned for each matrix: U, singular values, V.
const OUT: usize = 21;

const MAIN: &str = "
@group(0) @binding(0) var<storage, read> matrices: array<f32>;
@group(0) @binding(1) var<storage, read_write> results: array<f32>;

fn put(at: u32, m: mat3x3f) {
    put3(at, m[0]);
    put3(at + 3u, m[1]);
    put3(at + 6u, m[2]);
}

fn put3(at: u32, x: vec3f) {
    results[at] = x.x;
    results[at + 1u] = x.y;
    results[at + 2u] = x.z;
}

fn take3(at: u32) -> vec3f {
    return vec3f(matrices[at], matrices[at + 1u], matrices[at + 2u]);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= arrayLength(&matrices) / 9u {
        return;
    }
    let f = mat3x3f(take3(9u * i), take3(9u * i + 3u), take3(9u * i + 6u));
    let d = svd(f);
    put(21u * i, d.u);
    put3(21u * i + 9u, d.sigma);
    put(21u * i + 12u, d.v);
}
";

fn text() -> String {
    let sweeps = format!("const SVD_SWEEPS = {SWEEPS}u;\n");
    [&*sweeps, &*shaders::library("linear"), &*shaders::library("svd"), MAIN].concat()
}

fn text_is_valid() {
    let text = text();
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    validator.validate(&module).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
}

fn has_the_bits_of_the_cpu(backend: Backend) {
    let mut matrices: Vec<_> = (0..COUNT as u64).map(|i| matrices::matrix(i).map(|c| c.map(|x| x as f32))).collect();
    let finite = matrices.len();
    for x in [f32::NAN, f32::INFINITY] {
        matrices.extend([[[x; 3]; 3], [[1.0, 2.0, x], [0.0; 3], [3.0; 3]]]);
    }
    let found: Vec<[f32; OUT]> = run_kernel(backend, &text(), &matrices, matrices.len());
    assert_eq!(found.len(), matrices.len(), "what is not finite ends too");

    let (mut unequal, mut first) = (0, None);
    let mut largest = Errors::default();
    for (f, out) in matrices[..finite].iter().zip(&found) {
        let Svd { u, sigma, v } = svd(f);
        let whole = [u.as_flattened(), &sigma, v.as_flattened()].concat();
        if whole.iter().zip(out).any(|(a, b)| a.to_bits() != b.to_bits()) {
            unequal += 1;
            first = first.or_else(|| Some(format!("{f:?}\n{whole:?}\n{out:?}")));
        }
        let part = |at: usize| -> Matrix { [0, 3, 6].map(|j| [0, 1, 2].map(|i| f64::from(out[at + j + i]))) };
        let exact = f.map(|column| column.map(f64::from));
        let sigma = [9, 10, 11].map(|i| f64::from(out[i]));
        let tiny = f64::from(f32::MIN_POSITIVE);
        largest = largest.max(svd_errors(&exact, &part(0), sigma, &part(12), tiny));
    }
    // Quotients and roots within half a unit in the last place, or within 2.5 if rounding depends on the driver.
    let most = if rounds_by_itself(backend) { 5.0 } else { 1.0 };
    assert!(largest.product <= 1e-6 * most && largest.rotation <= 2e-6 * most, "{largest:?}");
    if !rounds_by_itself(backend) {
        assert_eq!(unequal, 0, "of {finite}; {}", first.unwrap_or_default());
    }
}
