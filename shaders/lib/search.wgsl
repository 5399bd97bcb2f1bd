// What the solve keeps per particle: of its pressure as `mean`; where it solves for stresses, also of its shear.

#if SCALARS
struct Sought {
    mean: Search,
}
#endif
#if TENSORS
alias Sought = StressSearch;
#endif
