// What the solve keeps for a particle, with or without the shear that worlds with solids have. Needs the binding search.

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
