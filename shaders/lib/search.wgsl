// What the solve keeps for a particle: of its pressure as the mean, with or without shear.

#if SCALARS
struct Sought {
    mean: Search,
}
#endif
#if TENSORS
alias Sought = StressSearch;
#endif
