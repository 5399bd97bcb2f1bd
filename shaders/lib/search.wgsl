// What the solve keeps per particle: of its pressure as `mean`; where it solves for stresses, also of its shear.
// Twin of `response`: src/cpu/solve.rs.

// The preconditioned residual per residual.
fn response(compliance: f32) -> f32 {
    return 1.0 / (compliance + 1.0);
}

#if SCALARS
struct Sought {
    mean: Search,
}
#endif
#if TENSORS
alias Sought = StressSearch;
#endif
