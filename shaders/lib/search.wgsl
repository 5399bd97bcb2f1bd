// What the solve keeps for a particle, with or without shear. Needs the binding search.

fn load_search(p: u32) -> Search {
#if SCALARS
    return search[p];
#endif
#if TENSORS
    return search[p].mean;
#endif
}

fn store_search(p: u32, s: Search) {
#if SCALARS
    search[p] = s;
#endif
#if TENSORS
    search[p].mean = s;
#endif
}
